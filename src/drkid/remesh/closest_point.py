"""The closest point of a surface, for many queries against one tree."""

from dataclasses import dataclass
from functools import cached_property

import igl
import numpy as np

from drkid.mesh import Floats, TriMesh


@dataclass(frozen=True, eq=False)
class ClosestPoint:
    """A surface with its tree of bounding boxes (libigl's AABB), which is built once."""

    surface: TriMesh

    @cached_property
    def _tree(self) -> igl.AABB:
        tree = igl.AABB()
        tree.init(self.surface.vertices, self.surface.faces)
        return tree

    def __call__(self, points: Floats) -> tuple[Floats, Floats]:
        """The closest point to each of `points` (n, 3), and the unit normal of the face that it lies on (n, 3)."""
        _, face, closest = self._tree.squared_distance(
            self.surface.vertices, self.surface.faces, np.ascontiguousarray(points)
        )
        return np.asarray(closest, np.float64), self.surface.face_normals[np.asarray(face)]
