"""The closest point of a surface, for many queries against one tree."""

from dataclasses import dataclass
from functools import cached_property

import igl
import numpy as np

from drkid.mesh import Floats, Ints, TriMesh


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
        closest, face = self.located(points)
        return closest, self.surface.face_normals[face]

    def located(self, points: Floats) -> tuple[Floats, Ints]:
        """The closest point to each of `points` (n, 3), and the face that it lies on (n,)."""
        _, face, closest = self._tree.squared_distance(
            self.surface.vertices, self.surface.faces, np.ascontiguousarray(points)
        )
        return np.asarray(closest, np.float64), np.asarray(face, np.int64)


def barycentric(corners: Floats, points: Floats) -> Floats:
    """(P, 3): barycentric coordinates of points in triangles (Ericson, Real-Time Collision Detection, 3.4)."""
    a, b, c = np.moveaxis(corners, 1, 0)
    u, v, w = b - a, c - a, points - a
    uu, uv, vv = (np.einsum("ij,ij->i", p, q) for p, q in ((u, u), (u, v), (v, v)))
    wu, wv = (np.einsum("ij,ij->i", w, q) for q in (u, v))
    area = np.maximum(uu * vv - uv * uv, np.finfo(float).tiny)
    s, t = (vv * wu - uv * wv) / area, (uu * wv - uv * wu) / area
    return np.clip(np.column_stack([1 - s - t, s, t]), 0, 1)
