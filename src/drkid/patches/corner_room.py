"""Corner room: how short an inner edge of a merged piece may become before two pockets meet in the corner opposite.

Lengths alone are known here, no connector. A pocket as wide and as deep as in the smallest print that pockets allow
stands for it, and a smaller one for that in larger prints: no corner may become tighter to either than the tightest
corner of the unmerged triangles, at which every print has its walls.
"""

from dataclasses import dataclass

import numpy as np

from drkid.mesh import Floats, Ints, TriMesh
from drkid.patches.outline import Outlined, corner_angles

HALF_WIDTH, DEPTH = 0.11, 0.2  # of a pocket, in mean edges of the smallest print
SIZES = (1.0, 0.85)  # of the pockets
HALVINGS = 40
SPARE = 0.0015  # of the mean edge: how much more room is aimed at than is needed, since no length is met exactly
ROUNDING = 0.0002  # of the mean edge: less room than that is not missed
NARROWEST = 0.1  # radians: no corner that is looked for is narrower


@dataclass(frozen=True, eq=False)
class CornerRooms:
    """Corners of M_f at which two pockets of one piece meet, and what keeps them apart.

    `corners` (n, 3) are the vertices at a corner, after it and before it; `least_rooms` are what the tightest triangle
    has beside pockets of the `SIZES`. At `least` (m,) lengths of the inner edges `pairs` (m, 2) opposite, and sides as
    they are, corners have that and a little to spare, or as much as they have now.
    """

    mean_edge: float
    corners: Ints
    least_rooms: tuple[float, ...]
    pairs: Ints
    least: Floats

    def missing(self, vertices: Floats) -> Floats:
        """(m,): by how much each inner edge is too short, 0 where it is not."""
        length = np.linalg.norm(vertices[self.pairs[:, 0]] - vertices[self.pairs[:, 1]], axis=1)
        return np.maximum(self.least - length, 0.0)

    def enough(self, vertices: Floats) -> bool:
        """Whether every corner has its room."""
        if not len(self.corners):
            return True
        at, after, before = np.moveaxis(vertices[self.corners], 1, 0)
        first, second = np.linalg.norm(after - at, axis=1), np.linalg.norm(before - at, axis=1)
        cosine = np.einsum("nk,nk->n", after - at, before - at) / (first * second)
        angle = np.arccos(np.clip(cosine, -1, 1))
        return all(
            room(first, second, angle, size * self.mean_edge).min() >= least - ROUNDING * self.mean_edge
            for size, least in zip(SIZES, self.least_rooms, strict=True)
        )


def room(first: Floats, second: Floats, angle: Floats, size: float) -> Floats:
    """(n,): distance of the pockets amid sides of these lengths (n,) that meet at `angle` (n,); minus any overlap.

    Pockets are those of the smallest print whose mean edge is `size`.
    """
    half, depth = HALF_WIDTH * size, DEPTH * size
    x, y = np.array([-half, half, -half, half]), np.array([0.0, 0.0, depth, depth])
    cosine, sine = np.cos(angle)[:, None], np.sin(angle)[:, None]
    distance, separation = np.full(len(first), np.inf), np.full(len(first), -np.inf)
    for own, other in ((first, second), (second, first)):
        along, inwards = own[:, None] / 2 + x, y[None]
        across = along * cosine + inwards * sine - other[:, None] / 2, along * sine - inwards * cosine
        outside = np.abs(across[0]) - half, np.maximum(-across[1], across[1] - depth)
        distance = np.minimum(distance, np.hypot(*(np.maximum(o, 0.0) for o in outside)).min(axis=1))
        beside = np.maximum(across[0].min(axis=1), -across[0].max(axis=1)) - half
        separation = np.maximum(separation, np.maximum(beside, across[1].min(axis=1) - depth))
    return np.where(separation > 0, distance, separation)


def corner_rooms(mesh: TriMesh, pieces: list[Outlined]) -> CornerRooms:
    """Those of all triangles that have two of their sides on the outline of their piece, or all three."""
    angle, sides = corner_angles(mesh), mesh.side_lengths
    every = sides.ravel(), np.roll(sides, 1, axis=1).ravel(), angle.ravel()
    rooms = tuple(float(room(*every, size * mesh.mean_edge).min()) for size in SIZES)
    rows = np.array(
        [
            (piece.faces[face], mesh.faces[piece.faces[face]].tolist().index(piece.vertices[i]))
            for piece in pieces
            for i, face in enumerate(piece.side_face.tolist())
            if piece.side_face[i - 1] == face
        ],
        np.int64,
    ).reshape(-1, 2)
    face, corner = rows.T
    after, before = sides[face, corner], sides[face, corner - 1]
    low, high = np.full(len(rows), NARROWEST), angle[face, corner]
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        enough = np.all(
            [
                room(after, before, middle, size * mesh.mean_edge) >= least + SPARE * mesh.mean_edge
                for size, least in zip(SIZES, rooms, strict=True)
            ],
            axis=0,
        )
        low, high = np.where(enough, low, middle), np.where(enough, middle, high)
    shortest = np.sqrt(after**2 + before**2 - 2 * after * before * np.cos(high))
    own = mesh.faces[face]
    corners = np.stack([np.take_along_axis(own, (corner[:, None] + k) % 3, 1)[:, 0] for k in range(3)], axis=1)
    pairs, index = np.unique(np.sort(corners[:, 1:], axis=1), axis=0, return_inverse=True)
    longest = np.zeros(len(pairs))
    np.maximum.at(longest, index.ravel(), shortest)
    return CornerRooms(mesh.mean_edge, corners, rooms, pairs, longest)
