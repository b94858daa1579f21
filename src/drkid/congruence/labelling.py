"""First labels: the nearest length of the palette for each edge, repaired until every triangle is an allowed one."""

from itertools import product

import numpy as np

from drkid.congruence.palette import Palette
from drkid.mesh import Floats, Ints, TriMesh

SWEEPS = 200


def nearest_labels(mesh: TriMesh, lengths: Floats) -> Ints:
    """(E,): number of the length in `lengths` (q,) nearest to each edge's own."""
    return np.abs(mesh.edge_lengths[:, None] - lengths).argmin(axis=1).astype(np.int64)


def repaired(mesh: TriMesh, labels: Ints, palette: Palette, lengths: Floats, rng: np.random.Generator) -> Ints | None:
    """Labels near the given ones with which every face is allowed, or None where the search finds none.

    A face that is not allowed takes the cheapest allowed labels, counting the faces beside that break (min-conflicts,
    Minton et al. 1992).
    """
    labels = labels.copy()
    options = np.array([o for o in product(range(palette.size), repeat=3) if palette.allowed[o]])
    misfit = (mesh.edge_lengths[:, None] - lengths) ** 2 / lengths.mean() ** 2
    for _ in range(SWEEPS):
        bad = np.flatnonzero(~palette.allowed[tuple(labels[mesh.face_edges].T)])
        if len(bad) == 0:
            return labels
        for face in rng.permutation(bad).tolist():
            edges = mesh.face_edges[face]
            if not palette.allowed[tuple(labels[edges])]:
                cost = misfit[edges, options].sum(axis=1) + _conflicts(mesh, labels, palette, face, options)
                labels[edges] = options[np.argmin(cost + 0.05 * rng.random(len(options)))]
    return None


def _conflicts(mesh: TriMesh, labels: Ints, palette: Palette, face: int, options: Ints) -> Floats:
    """(n,): how many of the three neighbours each option (n, 3) for a face would leave disallowed."""
    count = np.zeros(len(options))
    for side, edge in enumerate(mesh.face_edges[face]):
        first, second = mesh.edge_faces[edge]
        other = mesh.face_edges[second if first == face else first]
        around = [np.where(e == edge, options[:, side], labels[e]) for e in other]
        count += ~palette.allowed[tuple(around)]
    return count
