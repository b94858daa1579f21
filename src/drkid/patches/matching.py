"""Matching: triangles merged in pairs, as many as can be, into as few different shapes as can be found."""

import numpy as np
import rustworkx as rx

from drkid.mesh import Bools, Floats, Ints, TriMesh
from drkid.patches.identity import residuals, shapes
from drkid.patches.outline import outlined

ROUNDS = 12  # of a matching for the shapes that are popular and a count of those that it leaves
SHARES = 1_000_000  # weights of a matching are whole numbers


def paired(mesh: TriMesh, tolerance: float) -> list[tuple[int, ...]]:
    """Pairs of neighbouring faces and the faces left over, as tuples.

    Only pairs of convex outline are taken, folded by a right angle at most. A maximum matching of the dual graph
    (Edmonds 1965): where no edge is sharper every face of a closed surface, whose dual is cubic and bridgeless, finds a
    partner (Petersen 1891). Of the perfect matchings one is sought that needs few shapes: pairs count by how many of
    the pairs chosen before, at first of all possible ones, have their shape.
    """
    pairs = [tuple(int(f) for f in pair) for pair in mesh.edge_faces]
    candidates = [piece for piece in (outlined(mesh, pair) for pair in pairs) if piece.makes_a_piece(mesh)]
    pairs = [piece.faces for piece in candidates]
    if not pairs:
        return [(f,) for f in range(len(mesh.faces))]
    near = residuals(mesh, candidates)[0] <= tolerance
    weight = near.sum(axis=1).astype(np.float64)
    best: tuple[int, list[int]] | None = None
    for _ in range(ROUNDS):
        chosen = _matched(pairs, weight)
        stands = shapes(np.where(near, 0.0, 1.0)[np.ix_(chosen, chosen)], 0.5)
        count = len(np.unique(stands))
        if best is None or count < best[0]:
            best = count, chosen
        weight = _popularity(near, np.array(chosen), stands)
    assert best is not None
    taken = [pairs[i] for i in best[1]]
    alone = set(range(len(mesh.faces))) - {f for pair in taken for f in pair}
    return [*taken, *((f,) for f in sorted(alone))]


def _popularity(near: Bools, chosen: Ints, stands: Ints) -> Floats:
    """(E,): for each possible pair the size of the largest chosen shape that it can take."""
    leaders, size = np.unique(stands, return_counts=True)
    return (near[:, chosen[leaders]] * size.astype(np.float64) ** 2).max(axis=1)


def _matched(pairs: list[tuple[int, ...]], weight: Floats) -> list[int]:
    """Numbers of the pairs in a matching of the most pairs, the heaviest of those."""
    graph = rx.PyGraph()
    graph.add_nodes_from(range(1 + max((max(pair) for pair in pairs), default=-1)))
    whole = np.rint(weight / max(weight.max(), 1.0) * SHARES).astype(np.int64)
    graph.add_edges_from([(a, b, int(w)) for (a, b), w in zip(pairs, whole, strict=True)])
    found = rx.max_weight_matching(graph, max_cardinality=True, weight_fn=int)
    number = {frozenset(pair): i for i, pair in enumerate(pairs)}
    return sorted(number[frozenset(pair)] for pair in found)
