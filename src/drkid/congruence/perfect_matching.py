"""Perfect matchings of the dual graph: one edge of every face, no two of the same face.

The dual graph of a closed triangle mesh is cubic and has no bridge, so that a perfect matching exists (Petersen 1891).
"""

import numpy as np
import rustworkx as rx

from drkid.errors import SpecError
from drkid.mesh import Bools, Floats, Ints, read_only

STEPS = 1_000_000  # the matching takes whole numbers only: so many between the least and the largest weight


def perfect_matching(edge_faces: Ints, weights: Floats) -> Bools:
    """(E,): is an edge one of those that match the faces in pairs, with the largest total of `weights` (E,)?

    Edmonds' blossom algorithm (Galil 1986), on weights rounded to a millionth of their range.

    Args:
        edge_faces: (E, 2) the two faces of each edge, numbered from 0.
        weights: (E,) of any sign.

    Raises:
        SpecError: the faces cannot be matched.
    """
    low, high = float(weights.min()), float(weights.max())
    whole = np.rint((weights - low) * (STEPS / max(high - low, 1e-300))).astype(np.int64)
    faces = int(edge_faces.max()) + 1
    graph: rx.PyGraph[int, int] = rx.PyGraph()
    graph.add_nodes_from(range(faces))
    graph.add_edges_from([(int(a), int(b), edge) for edge, (a, b) in enumerate(edge_faces.tolist())])
    pairs = rx.max_weight_matching(graph, max_cardinality=True, weight_fn=lambda edge: int(whole[edge]))
    matched = np.zeros(len(weights), np.bool_)
    matched[[graph.get_edge_data(a, b) for a, b in pairs]] = True
    if not (np.bincount(edge_faces[matched].ravel(), minlength=faces) == 1).all():
        raise SpecError(
            "the faces cannot be matched in pairs",
            wanted="a closed, manifold mesh",
            found=f"{int(matched.sum())} pairs of {faces} faces",
            remedy="another mesh, or more --classes",
        )
    return read_only(matched)
