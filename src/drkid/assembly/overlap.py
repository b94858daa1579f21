"""Overlap: where placed pieces reach into one another."""

from dataclasses import dataclass

import numpy as np

from drkid.kit import Part, Piece
from drkid.mesh import Floats, Ints, read_only
from drkid.solid import Solid

NOTHING_MM3 = 1e-6  # what rounding leaves of two pieces that touch


@dataclass(frozen=True)
class Overlap:
    """Two faces' pieces that share `volume_mm3`, which is `share` of the smaller piece."""

    faces: tuple[int, int]
    volume_mm3: float
    share: float


def overlaps(pieces: tuple[Piece, ...], parts: tuple[Part, ...]) -> tuple[Overlap, ...]:
    """Every pair of placed pieces that overlap, the largest share first.

    Looked at are all pairs whose boxes meet, which those with a common vertex do. Most are settled by the planes of
    their convex hulls: where all corners of one lie beyond a face of the other nothing is shared. The others are
    intersected exactly, hulls first.
    """
    bodies = [_Body.of(part.solid) for part in parts]
    placed = [bodies[piece.part].corners @ piece.transform[:3, :3].T + piece.transform[:3, 3] for piece in pieces]
    found: list[Overlap] = []
    for a, b in meeting_boxes(np.array([[x.min(axis=0), x.max(axis=0)] for x in placed])).tolist():
        one, other = bodies[pieces[a].part], bodies[pieces[b].part]
        if _apart(one, pieces[a], placed[b]) or _apart(other, pieces[b], placed[a]):
            continue
        volume = _shared_mm3(one, pieces[a].transform, other, pieces[b].transform)
        if volume > NOTHING_MM3:
            smaller = min(one.solid.volume, other.solid.volume)
            found.append(Overlap((pieces[a].face, pieces[b].face), volume, volume / smaller))
    return tuple(sorted(found, key=lambda one: (-one.share, one.faces)))


def meeting_boxes(boxes: Floats) -> Ints:
    """(m, 2): the pairs, lower first, of boxes (n, 2, 3), given by lowest and highest corner, that meet.

    By a sweep along x: each box is held against those that begin before it ends.
    """
    low, high = boxes[:, 0], boxes[:, 1]
    order = np.argsort(low[:, 0], kind="stable")
    last = np.searchsorted(low[order, 0], high[order, 0], side="right")
    pairs: list[Ints] = [np.empty((0, 2), np.int64)]
    for i, (one, end) in enumerate(zip(order, last, strict=True)):
        others = order[i + 1 : end]
        meet = ((low[others] <= high[one]) & (low[one] <= high[others])).all(axis=1)
        pairs.append(np.column_stack([np.full(int(meet.sum()), one), others[meet]]))
    found = np.sort(np.concatenate(pairs), axis=1)
    return read_only(found[np.lexsort(found.T[::-1])])


@dataclass(frozen=True, eq=False)
class _Body:
    """A part with its convex hull: `corners` (n, 3) and the planes (p, 4) that bound it, outward."""

    solid: Solid
    hull: Solid
    corners: Floats
    planes: Floats

    @classmethod
    def of(cls, solid: Solid) -> "_Body":
        hull = Solid.hull(solid.mesh().vertices)
        mesh = hull.mesh()
        normals = mesh.face_normals[mesh.areas > 0]
        planes = np.column_stack([normals, np.einsum("ij,ij->i", normals, mesh.corners[mesh.areas > 0, 0])])
        return cls(solid, hull, mesh.vertices, np.unique(np.round(planes, 9), axis=0))


def _apart(body: _Body, piece: Piece, points: Floats) -> bool:
    """Whether a plane of a placed piece's hull has all `points` (n, 3) on its outer side."""
    local = (points - piece.transform[:3, 3]) @ piece.transform[:3, :3]
    return bool(((local @ body.planes[:, :3].T).min(axis=0) >= body.planes[:, 3] - 1e-9).any())


def _shared_mm3(one: _Body, at_one: Floats, other: _Body, at_other: Floats) -> float:
    relative = np.linalg.inv(at_one) @ at_other
    if (one.hull & other.hull.moved(relative)).volume <= NOTHING_MM3:
        return 0.0
    return (one.solid & other.solid.moved(relative)).volume
