"""The closest point of a surface, for many queries against one tree."""

from dataclasses import dataclass
from functools import cached_property

from drkid.closest_point import TriangleTree, morton_tree, projected
from drkid.mesh import Floats, Ints, TriMesh


@dataclass(frozen=True, eq=False)
class ClosestPoint:
    """A surface with its tree of bounding boxes, which is built once."""

    surface: TriMesh

    @cached_property
    def _tree(self) -> TriangleTree:
        return morton_tree(self.surface)

    def __call__(self, points: Floats) -> tuple[Floats, Floats]:
        """The closest point to each of `points` (n, 3), and the unit normal of the face that it lies on (n, 3)."""
        closest, face, _ = projected(self._tree, points)
        return closest, self.surface.face_normals[face]

    def in_faces(self, points: Floats) -> tuple[Floats, Ints, Floats]:
        """The closest point (n, 3), the face that it lies on (n,) and its barycentric coordinates there (n, 3)."""
        return projected(self._tree, points)
