"""Truncation: corners cut off where pieces that share no more than a vertex would meet."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property
from math import floor, radians, sin

import numpy as np

from drkid.class_triangle import LEFT_CORNERS
from drkid.mesh import Bools, Floats, Ints, TriMesh, read_only
from drkid.parts.bevel import bevel_groups
from drkid.parts.members import Members
from drkid.parts.prismoid import Prismoid
from drkid.parts.separating_plane import margins_apart
from drkid.rigid_fit import rigid_fit
from drkid.spec import KitSpec

STEP_MM = 0.1  # of a cut: rounded up
HALVINGS = 7  # of the room: to less than a step
AT_REST = sin(radians(0.25))
ROUNDING = 1e-9
Room = Callable[[int, int, int], float]
MIRROR = np.array([-1.0, 1.0, 1.0])


@dataclass(frozen=True, eq=False)
class Truncated:
    """Shapes with corners cut, `corners` of them, by up to `deepest_mm` measured from the corner that was there.

    `vertices` are those of M_f where pieces come nearer than was wanted all the same, for want of room.
    """

    shapes: tuple[Prismoid, ...]
    corners: int = 0
    deepest_mm: float = 0.0
    vertices: tuple[int, ...] = ()


def truncated(
    shapes: tuple[Prismoid, ...],
    triangles: Floats,
    members: Members,
    mesh_mm: TriMesh,
    spec: KitSpec,
    room_mm: Room,
) -> Truncated:
    """The classes' pieces, around `triangles` (k, 3, 2), with corners cut so that pieces of one vertex stay apart.

    Bevels keep neighbours apart; around a sharp or saddle-shaped vertex pieces that are no neighbours may still meet.
    Seen from the vertex each piece fills a cone. Two cones that a plane has on either side, both half of the swing away
    from it, stay apart even when one of them swings about a hinge, whose axis runs through the vertex. Where there is
    no such plane, corners of both pieces go back along the bisectors of their angles at the inner or the outer face,
    as little as makes one; at the hinge axis nothing is cut. Corners that a symmetric piece has twice are cut alike,
    and so are both faces of a flippable one. No cut lies more than `room_mm(class, face, corner)` behind its corner;
    where even that is not enough for a swing, no more is cut than for pieces at rest.
    """
    room_mm = cache(room_mm)
    shell, cuts = _Shell(shapes, triangles, members, mesh_mm), np.zeros((len(shapes), 2, 3))
    wanted = sin(radians(spec.swing_degrees / 2))
    near = np.flatnonzero(shell.margins(cuts, wanted) < wanted)
    if not len(near):
        return Truncated(shapes)
    alike, both = np.stack([_alike(t) for t in triangles]), spec.thickening == "flippable"
    for pair in near.tolist():
        if shell.margins(cuts, wanted, pair)[0] >= wanted:
            continue
        room = shell.room(pair, room_mm)
        most = shell.margins(_shared(room, alike, both_faces=both), wanted, pair)[0]
        enough = wanted if most >= wanted else AT_REST
        if most >= enough > shell.margins(cuts, enough, pair)[0]:
            cuts = np.maximum(cuts, _least(shell, pair, room, enough, lambda c: _shared(c, alike, both_faces=both)))
    cuts = np.ceil(cuts / STEP_MM - ROUNDING).clip(0.0) * STEP_MM
    made = (shape.truncated(own) if own.any() else shape for shape, own in zip(shapes, cuts, strict=True))
    still = shell.vertex[near[shell.margins(cuts, wanted, near) < wanted]]
    return Truncated(
        tuple(made), int((cuts > 0).any(axis=1).sum()), float(cuts.max()), tuple(np.unique(still).tolist())
    )


def _least(shell: "_Shell", pair: int, room: Floats, enough: float, shared: Callable[[Floats], Floats]) -> Floats:
    """Cuts (k, 2, 3) that are just enough for a pair: the same share of `room` for all, then each by itself less."""

    def smallest(high: Floats, low: Floats) -> Floats:
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            done = shell.margins(shared(middle), enough, pair)[0] >= enough
            low, high = (low, middle) if done else (middle, high)
        return high

    cuts = smallest(room, np.zeros_like(room))
    for own in zip(*np.nonzero(cuts), strict=True):
        without = cuts.copy()
        without[own] = 0.0
        cuts = without if shell.margins(shared(without), enough, pair)[0] >= enough else smallest(cuts, without)
    return shared(cuts)


def _alike(triangle: Floats) -> Bools:
    """(3, 3): which corners of a triangle (3, 2) lie between sides that share the same bevels."""
    group = bevel_groups(np.linalg.norm(np.roll(triangle, -1, axis=0) - triangle, axis=1))
    between = np.sort(np.stack([np.roll(group, 1), group], axis=1), axis=1)
    return (between[:, None] == between[None]).all(axis=2)


def _shared(cuts: Floats, alike: Bools, *, both_faces: bool) -> Floats:
    """Cuts (k, 2, 3) with the deepest of those corners that are alike (k, 3, 3)."""
    found = np.where(alike[:, None], cuts[:, :, None, :], 0.0).max(axis=3)
    return np.repeat(found.max(axis=1, keepdims=True), 2, axis=1) if both_faces else found


class _Shell:
    """All faces' pieces at their places, and the pairs that share no more than a vertex.

    `faces` (n, 2) are the pairs, `corner` (n, 2) the class's corner that lies at M_f's `vertex` (n,).
    """

    def __init__(self, shapes: tuple[Prismoid, ...], triangles: Floats, members: Members, mesh_mm: TriMesh) -> None:
        self.shapes, self.triangles = shapes, triangles
        self.face_class, self.left = members.face_class, members.left
        self.vertices = mesh_mm.vertices
        own = (np.where(members.left[:, None], LEFT_CORNERS, (0, 1, 2)) + members.turn[:, None]) % 3
        at = np.take_along_axis(mesh_mm.faces, own, 1)  # (F, 3): the vertex at each corner of the class
        flat = np.concatenate([triangles, np.zeros((*triangles.shape[:2], 1))], axis=2)[self.face_class]
        flat[self.left] *= MIRROR
        self.motions = rigid_fit(flat, mesh_mm.vertices[at])
        self.faces, self.corner, self.vertex = _across(at)

    @cached_property
    def rotations(self) -> Floats:
        """(F, 3, 3): from a class's frame, the mirror of left pieces included, to the world."""
        return np.where(self.left[:, None, None], self.motions[:, :3, :3] * MIRROR, self.motions[:, :3, :3])

    def room(self, pair: int, room_mm: Room) -> Floats:
        """(k, 2, 3): how far behind them the two corners of a pair may be cut, rounded down; 0 for all others."""
        found = np.zeros((len(self.shapes), 2, 3))
        for own, corner in zip(self.face_class[self.faces[pair]].tolist(), self.corner[pair].tolist(), strict=True):
            found[own, :, corner] = [STEP_MM * floor(room_mm(own, face, corner) / STEP_MM) for face in (0, 1)]
        return found

    def margins(self, cuts: Floats, wanted: float, pairs: Ints | int | slice = slice(None)) -> Floats:
        """(n,): the sine of the angle that the best plane leaves on either side of it, up to `wanted`."""
        pairs = np.atleast_1d(np.arange(len(self.vertex))[pairs])
        if not len(pairs):
            return np.empty(0)
        faces = self.faces[pairs]
        own, shape = np.unique(self.face_class[faces], return_inverse=True)
        points = np.stack([self.shapes[k].truncated(cuts[k]).points for k in own])
        placed = np.einsum("nsab,nspb->nspa", self.rotations[faces], points[shape.reshape(faces.shape)])
        away = placed + (self.motions[faces, :3, 3] - self.vertices[self.vertex[pairs]][:, None])[:, :, None]
        away[:, 1] *= -1
        away = away.reshape(len(away), -1, 3)
        length = np.linalg.norm(away, axis=2, keepdims=True)
        return margins_apart(away / np.maximum(length, ROUNDING), wanted + ROUNDING)


def _across(at: Ints) -> tuple[Ints, Ints, Ints]:
    """Pairs of faces that share one vertex alone: faces (n, 2), their corners there (n, 2) and the vertex (n,)."""
    around: dict[int, list[tuple[int, int]]] = {}
    for face, row in enumerate(at.tolist()):
        for corner, vertex in enumerate(row):
            around.setdefault(vertex, []).append((face, corner))
    sets = [frozenset(row) for row in at.tolist()]
    found = [
        (f, g, i, j, vertex)
        for vertex, fan in around.items()
        for n, (f, i) in enumerate(fan)
        for g, j in fan[n + 1 :]
        if len(sets[f] & sets[g]) == 1
    ]
    table = np.array(found, np.int64).reshape(-1, 5)
    return read_only(table[:, :2]), read_only(table[:, 2:4]), read_only(table[:, 4])
