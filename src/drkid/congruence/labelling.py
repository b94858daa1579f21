"""First labels: near the edges' own lengths, and every triangle an allowed one.

With one class of isosceles triangles every face has one odd edge: a perfect matching of the dual graph, of which the
best is found. Otherwise the nearest length of the palette for each edge, repaired by a local search.
"""

from itertools import product

import numpy as np

from drkid.congruence.palette import Multiset, Palette
from drkid.congruence.perfect_matching import perfect_matching
from drkid.errors import SpecError
from drkid.mesh import Floats, Ints, TriMesh

SWEEPS = 200
TRIALS = 4


def first_labels(mesh: TriMesh, palette: Palette, lengths: Floats, rng: np.random.Generator) -> Ints:
    """(E,): labels near the edges' lengths with which every face is allowed.

    Where the local search finds none, one class may do alone: isosceles by a matching, or equilateral.

    Args:
        mesh: closed.
        palette: which triangles are allowed.
        lengths: (q,) lengths of the palette, in the unit of the mesh.
        rng: breaks ties of the search.

    Raises:
        SpecError: no labelling with only allowed triangles was found.
    """
    if len(palette.multisets) == 1 and _is_isosceles(palette.multisets[0]):
        return matched_labels(mesh, palette.multisets[0], lengths)
    nearest = nearest_labels(mesh, lengths)
    for _ in range(TRIALS):
        labels = repaired(mesh, nearest, palette, lengths, rng)
        if labels is not None:
            return labels
    alone = [matched_labels(mesh, m, lengths) for m in palette.multisets if _is_isosceles(m)]
    alone += [np.full(len(mesh.edges), m[0]) for m in palette.multisets if m[0] == m[2]]
    if alone:
        return min(alone, key=lambda labels: float(((mesh.edge_lengths - lengths[labels]) ** 2).sum()))
    raise SpecError(
        "no labelling of this mesh has only allowed triangles",
        wanted=f"triangles of {len(palette.multisets)} kinds",
        found=f"none after {TRIALS} trials",
        remedy="other --classes or --faces",
    )


def matched_labels(mesh: TriMesh, multiset: Multiset, lengths: Floats) -> Ints:
    """(E,): of all labels that give every face this isosceles multiset, those of the least sum of squared misfits.

    An edge costs (l − odd)² as the odd one of its two faces and (l − twin)² otherwise, so that the best labels are the
    perfect matching of the largest saving.

    Raises:
        SpecError: the mesh is not closed.
    """
    twin = multiset[1]
    odd = multiset[2] if multiset[0] == twin else multiset[0]
    saving = (mesh.edge_lengths - lengths[twin]) ** 2 - (mesh.edge_lengths - lengths[odd]) ** 2
    return np.where(perfect_matching(mesh.edge_faces, saving), odd, twin).astype(np.int64)


def _is_isosceles(multiset: Multiset) -> bool:
    return len(set(multiset)) == 2


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
