"""The target surface: signed offsets and normals at the closest points, and the energy that holds a mesh to it."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import igl
import numpy as np

from drkid.mesh import Floats, TriMesh

NORMAL_SMOOTHING = 5  # rounds of averaging of the target's vertex normals: voxels leave ripples in them


@dataclass(frozen=True, eq=False)
class Target:
    """A closed surface that vertices are to stay near."""

    mesh: TriMesh

    @cached_property
    def _tree(self) -> Any:
        tree = igl.AABB()
        tree.init(np.array(self.mesh.vertices), np.array(self.mesh.faces))
        return tree

    @cached_property
    def _normals(self) -> Floats:
        """(V, 3): vertex normals, averaged with their neighbours a few times."""
        normals, edges = self.mesh.vertex_normals.copy(), self.mesh.edges
        for _ in range(NORMAL_SMOOTHING):
            total = normals.copy()
            np.add.at(total, edges[:, 0], normals[edges[:, 1]])
            np.add.at(total, edges[:, 1], normals[edges[:, 0]])
            normals = total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-300)
        return normals

    def offsets(self, points: Floats) -> tuple[Floats, Floats]:
        """Signed distance (n,) of points (n, 3) along the target's normals (n, 3), positive outside."""
        squared, face, closest = self._tree.squared_distance(self.mesh.vertices, self.mesh.faces, points)
        corners = self.mesh.faces[face]
        weights = _barycentric(closest, self.mesh.vertices[corners])
        normals = np.einsum("ij,ijk->ik", weights, self._normals[corners])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
        away = np.einsum("ij,ij->i", points - closest, normals)
        return np.copysign(np.sqrt(squared), away), normals


def _barycentric(points: Floats, corners: Floats) -> Floats:
    """(n, 3): barycentric coordinates of points in the planes of their triangles (Ericson 2005, section 3.4)."""
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    w = points - corners[:, 0]
    uu, uv, vv = (np.einsum("ij,ij->i", a, b) for a, b in ((u, u), (u, v), (v, v)))
    wu, wv = np.einsum("ij,ij->i", w, u), np.einsum("ij,ij->i", w, v)
    area = np.maximum(uu * vv - uv * uv, 1e-300)
    second, third = (vv * wu - uv * wv) / area, (uu * wv - uv * wu) / area
    return np.stack([1 - second - third, second, third], axis=1)


def smoothness(mesh: TriMesh, beta: float) -> Floats:
    """K = I + β² ΛᵀΛ (V, V) with the umbrella Laplacian Λ: offsets are to be small, and smooth along the surface."""
    count = len(mesh.vertices)
    laplacian = np.eye(count)
    weight = -1.0 / mesh.valence
    for a, b in (mesh.edges.T, mesh.edges[:, ::-1].T):
        laplacian[a, b] = weight[a]
    return np.eye(count) + beta**2 * laplacian.T @ laplacian
