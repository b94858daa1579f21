"""Tips of merged pieces cut off where pieces that share a vertex reach into one another.

Bevels keep neighbours apart at their joints; around a sharp or saddle-shaped vertex the tips of pieces that are no
neighbours may still meet. Both are cut by parallel planes through the middle of what they share.
"""

from collections import defaultdict
from itertools import combinations

import numpy as np

from drkid.kit import MergedPiece
from drkid.mesh import Floats, TriMesh
from drkid.rigid_fit import rigid_fit
from drkid.solid import Solid

APART_CLEARANCES = 3.0  # between two tips that met: most can then swing
ROUNDS = 4  # a cut for one pair of members is made on all of a shape, which seldom needs another
NOTHING_MM3 = 1e-9
MOST_OF_PIECE = 0.02  # of a piece's volume: what more is shared is no tip, and left to the figures of the assembly
AROUND_MM = 1.0  # beyond what is shared: how far a cut reaches


def tips_cut(
    solids: list[Solid],
    corners: list[Floats],
    pieces: tuple[MergedPiece, ...],
    mesh_mm: TriMesh,
    achiral: list[bool],
    clearance_mm: float,
) -> list[Solid]:
    """The shapes' solids without the tips that meet others.

    Args:
        solids: of the shapes, in their part frames.
        corners: (n, 3) of each.
        pieces: which shape lies where.
        mesh_mm: M_f.
        achiral: whether a shape is its own mirror image, and stays so.
        clearance_mm: of which two tips are drawn apart by `APART_CLEARANCES`.
    """
    apart_mm = APART_CLEARANCES * clearance_mm
    motions = [rigid_fit(corners[p.class_index], mesh_mm.vertices[list(p.vertices)]) for p in pieces]
    back = [np.asarray(np.linalg.inv(motion), np.float64) for motion in motions]
    pairs = _near(pieces)
    solids = list(solids)
    for _ in range(ROUNDS):
        cuts = defaultdict[int, list[Solid]](list)
        for a, b in pairs:
            own, other = pieces[a].class_index, pieces[b].class_index
            first, second = solids[own].moved(motions[a]), solids[other].moved(motions[b])
            shared = first & second
            if not NOTHING_MM3 < shared.volume < MOST_OF_PIECE * min(first.volume, second.volume):
                continue
            middle = shared.bounds.mean(axis=0)
            away = _away(pieces[a], mesh_mm, middle) - _away(pieces[b], mesh_mm, middle)
            away /= np.linalg.norm(away)
            low, high = shared.bounds + np.array([[-AROUND_MM], [AROUND_MM]])
            box = Solid.box(low, high)
            cuts[own].append(box.beyond(-away, -float(middle @ away) - apart_mm / 2).moved(back[a]))
            cuts[other].append(box.beyond(away, float(middle @ away) - apart_mm / 2).moved(back[b]))
        if not cuts:
            break
        for own, cutters in cuts.items():
            mirrored = [c.mirrored() for c in cutters] if achiral[own] else []
            solids[own] = solids[own].minus_all([*cutters, *mirrored])
    return solids


def _near(pieces: tuple[MergedPiece, ...]) -> list[tuple[int, int]]:
    """Pairs of pieces that have a vertex in common."""
    around = defaultdict[int, list[int]](list)
    for number, piece in enumerate(pieces):
        for vertex in piece.vertices:
            around[vertex].append(number)
    return sorted({pair for own in around.values() for pair in combinations(sorted(set(own)), 2)})


def _away(piece: MergedPiece, mesh_mm: TriMesh, point: Floats) -> Floats:
    """(3,): unit vector from a point to the middle of the piece's face that is nearest to it."""
    middles = mesh_mm.corners[list(piece.faces)].mean(axis=1) - point
    distance = np.linalg.norm(middles, axis=1)
    nearest = int(distance.argmin())
    return middles[nearest] / distance[nearest]
