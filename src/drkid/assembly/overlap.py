"""Overlap: where placed pieces reach into one another."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drkid.assembly.hinge_framework import HingeFramework
from drkid.assembly.piece_graph import PieceGraph
from drkid.kit import Overlapping, Part, Piece
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
    """Every pair of placed pieces that overlap, the largest share first."""
    bodies = Bodies([part.solid for part in parts])
    placed = Placements(
        [piece.part for piece in pieces], [piece.face for piece in pieces], np.stack([p.transform for p in pieces])
    )
    return bodies.overlaps(placed)


@dataclass(frozen=True, eq=False)
class Placements:
    """Pieces by the number of their part, a face of M_f each, and their motions (P, 4, 4)."""

    parts: Sequence[int]
    faces: Sequence[int]
    motions: Floats


class Bodies:
    """The parts' solids with their convex hulls, which settle most questions.

    Where all corners of one hull lie beyond a face of the other nothing is shared. Other pairs are intersected exactly,
    hulls first.
    """

    def __init__(self, solids: Sequence[Solid]) -> None:
        """Of parts as they lie in their frames."""
        self.bodies = [_Body.of(solid) for solid in solids]

    def overlaps(self, placed: Placements) -> tuple[Overlap, ...]:
        """Every pair that overlaps, the largest share first; looked at are all pairs whose boxes meet."""
        found: list[Overlap] = []
        corners = [self._corners(part, motion) for part, motion in zip(placed.parts, placed.motions, strict=True)]
        for a, b in meeting_boxes(np.array([[x.min(axis=0), x.max(axis=0)] for x in corners])).tolist():
            one, other = placed.parts[a], placed.parts[b]
            volume = self.shared_mm3((one, placed.motions[a]), (other, placed.motions[b]))
            if volume > NOTHING_MM3:
                smaller = min(self.bodies[one].solid.volume, self.bodies[other].solid.volume)
                found.append(Overlap((placed.faces[a], placed.faces[b]), volume, volume / smaller))
        return tuple(sorted(found, key=lambda one: (-one.share, one.faces)))

    def shared_mm3(self, one: tuple[int, Floats], other: tuple[int, Floats]) -> float:
        """The volume that two parts share at their places (4, 4); 0 where that is rounding."""
        (a, at_a), (b, at_b) = one, other
        first, second = self.bodies[a], self.bodies[b]
        if _apart(first, at_a, self._corners(b, at_b)) or _apart(second, at_b, self._corners(a, at_a)):
            return 0.0
        return _shared_mm3(first, at_a, second, at_b)

    def _corners(self, part: int, motion: Floats) -> Floats:
        return self.bodies[part].corners @ motion[:3, :3].T + motion[:3, 3]


def overlapping(
    bodies: Bodies, placed: Placements, framework: HingeFramework, graph: PieceGraph, swing: float
) -> Overlapping:
    """Pairs that overlap at their places, and those that do so only when one piece turns about one of its hinges.

    `swing` is in degrees, both ways. A piece that turns is held against the one at its hinge and against those that it
    meets in an end of the hinge alone: its other neighbours it leaves, and they are not there yet.
    """
    rest = bodies.overlaps(placed)
    number = {face: piece for piece, face in enumerate(placed.faces)}
    met = {frozenset(number[face] for face in one.faces) for one in rest}
    swung: dict[frozenset[int], float] = {}
    for pieces, sides, frames in zip(graph.pieces.tolist(), graph.sides.tolist(), framework.frames, strict=True):
        for piece, side, frame, partner in zip(pieces, sides, frames, reversed(pieces), strict=True):
            others = {partner} | graph.touching(piece, side)
            pairs = {other: pair for other in sorted(others) if (pair := frozenset((piece, other))) not in met}
            for turn in (-swing, swing):
                turned = placed.parts[piece], placed.motions[piece] @ _turned(frame, turn)
                for other, pair in pairs.items():
                    volume = bodies.shared_mm3(turned, (placed.parts[other], placed.motions[other]))
                    if volume > NOTHING_MM3:
                        swung[pair] = max(volume, swung.get(pair, 0.0))
    worst = rest[0] if rest else None
    return Overlapping(
        pairs=len(rest),
        largest_mm3=worst.volume_mm3 if worst else 0.0,
        largest_percent=100 * worst.share if worst else 0.0,
        faces=worst.faces if worst else None,
        swing_degrees=swing,
        swung=len(swung),
        swung_mm3=max(swung.values(), default=0.0),
    )


def _turned(frame: Floats, degrees: float) -> Floats:
    """(4, 4): the turn about the x axis of a connector frame (4, 4), in the part's coordinates."""
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn = np.eye(4)
    turn[1:3, 1:3] = [[cosine, -sine], [sine, cosine]]
    return frame @ turn @ np.linalg.inv(frame)


def meeting_boxes(boxes: Floats) -> Ints:
    """(m, 2): the pairs, lower first, of boxes (n, 2, d), given by lowest and highest corner, that meet.

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
        levels = (normals @ mesh.vertices.T).max(axis=1)  # a sliver's own may lie inside: its normal is mostly rounding
        planes = np.column_stack([normals, levels])
        return cls(solid, hull, mesh.vertices, np.unique(np.round(planes, 9), axis=0))


def _apart(body: _Body, motion: Floats, points: Floats) -> bool:
    """Whether a plane of a placed part's hull has all `points` (n, 3) on its outer side."""
    local = (points - motion[:3, 3]) @ motion[:3, :3]
    return bool(((local @ body.planes[:, :3].T).min(axis=0) >= body.planes[:, 3] - 1e-9).any())


def _shared_mm3(one: _Body, at_one: Floats, other: _Body, at_other: Floats) -> float:
    relative = np.linalg.inv(at_one) @ at_other
    if (one.hull & other.hull.moved(relative)).volume <= NOTHING_MM3:
        return 0.0
    return (one.solid & other.solid.moved(relative)).volume
