"""Outline: the polygon round faces that are merged, and the points within."""

from dataclasses import dataclass

import numpy as np

from drkid.mesh import Floats, Ints, TriMesh, read_only

WIDEST = np.radians(178.0)  # angle of an outline: a convex piece can be cut by the planes of its sides

SHARPEST_FOLD = np.radians(90.0)  # between two triangles of one piece


@dataclass(frozen=True, eq=False)
class Outlined:
    """Merged faces as a polygon: `vertices` (n,) of the mesh round it, counter-clockwise, then `inner` (m,) ones.

    `triangles` (f, 3) index vertices and inner ones in that order, `side_face` (n,) the triangles.
    """

    faces: tuple[int, ...]
    vertices: tuple[int, ...]
    inner: tuple[int, ...]
    triangles: Ints
    side_face: Ints

    def points(self, mesh: TriMesh) -> Floats:
        """(n + m, 3): where the corners and then the inner points lie."""
        return mesh.vertices[[*self.vertices, *self.inner]]

    def turned(self, by: int) -> "Outlined":
        """The same with corner `by` first."""
        n = len(self.vertices)
        triangles = np.where(self.triangles < n, (self.triangles - by) % n, self.triangles)
        return Outlined(
            self.faces,
            (*self.vertices[by:], *self.vertices[:by]),
            self.inner,
            read_only(triangles),
            read_only(np.roll(self.side_face, -by)),
        )

    def widest_angle(self, mesh: TriMesh) -> float:
        """The largest angle of the outline, measured along the triangles, in radians."""
        angles = corner_angles(mesh)[list(self.faces)]
        total = np.bincount(self.triangles.ravel(), weights=angles.ravel())
        return float(total[: len(self.vertices)].max())

    def sharpest_fold(self, mesh: TriMesh) -> float:
        """The sharpest bend between two of its triangles, in radians; 0 of a single one."""
        return sharpest_fold(self.points(mesh), self.triangles)

    def makes_a_piece(self, mesh: TriMesh) -> bool:
        """Whether the outline is convex, and no fold so sharp that the bevels of one triangle cut another's pockets."""
        return self.widest_angle(mesh) <= WIDEST and self.sharpest_fold(mesh) <= SHARPEST_FOLD

    @property
    def pattern(self) -> frozenset[tuple[int, ...]]:
        """The triangles as sets of numbers: what a relabelling has to keep."""
        return frozenset(tuple(sorted(row)) for row in self.triangles.tolist())


def outlined(mesh: TriMesh, faces: tuple[int, ...]) -> Outlined:
    """The outline of faces that form one disc.

    Raises:
        ValueError: their boundary is not one closed polygon.
    """
    corners = mesh.faces[list(faces)]
    sides = {(int(a), int(b)): i for i, row in enumerate(corners) for a, b in zip(row, np.roll(row, -1), strict=True)}
    follow = {a: b for a, b in sides if (b, a) not in sides}
    loop = [min(follow)]
    while len(loop) < len(follow) and follow[loop[-1]] != loop[0]:
        loop.append(follow[loop[-1]])
    if len(loop) != sum((b, a) not in sides for a, b in sides):
        message = f"faces {faces} are not one disc"
        raise ValueError(message)
    inner = tuple(sorted({int(v) for v in corners.ravel()} - set(loop)))
    number = {v: i for i, v in enumerate([*loop, *inner])}
    triangles = np.array([[number[int(v)] for v in row] for row in corners], np.int64)
    side_face = [sides[a, b] for a, b in zip(loop, [*loop[1:], loop[0]], strict=True)]
    return Outlined(faces, tuple(loop), inner, read_only(triangles), read_only(np.array(side_face, np.int64)))


def sharpest_fold(points: Floats, triangles: Ints) -> float:
    """The sharpest bend between two neighbours of triangles (f, 3) of points (n, 3), in radians; 0 where none are."""
    normals = TriMesh(points, triangles).face_normals
    owner = {(row[i], row[(i + 1) % 3]): face for face, row in enumerate(triangles.tolist()) for i in range(3)}
    pairs = [(face, owner[b, a]) for (a, b), face in owner.items() if (b, a) in owner]
    return max((float(np.arccos(np.clip(normals[f] @ normals[g], -1, 1))) for f, g in pairs), default=0.0)


def corner_angles(mesh: TriMesh) -> Floats:
    """(F, 3): the angle at each corner of each face (law of cosines)."""
    after, across, before = mesh.side_lengths, np.roll(mesh.side_lengths, -1, axis=1), np.roll(mesh.side_lengths, 1, 1)
    return np.arccos(np.clip((after**2 + before**2 - across**2) / (2 * after * before), -1, 1))
