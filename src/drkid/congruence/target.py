"""The target surface: signed offsets and normals at the closest points, and the energy that holds a mesh to it."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numba import njit

from drkid.closest_point import TriangleTree, closest_slots, triangle_tree
from drkid.measure import smooth_normals
from drkid.mesh import Floats, Ints, TriMesh


class Surface(NamedTuple):
    """The target: its triangles in a tree, its `faces` (F, 3) and the unit normals (V, 3) at its vertices."""

    tree: TriangleTree
    faces: Ints
    normals: Floats


@njit(cache=True, nogil=True)
def signed_offsets(surface: Surface, points: Floats, slots: Ints) -> tuple[Floats, Floats]:
    """Signed distances (n,) of points (n, 3) along the target's normals (n, 3), positive outside.

    `slots` (n,) are first guesses of the nearest triangles, and then those found (see `closest_slots`).
    """
    squared, weights = closest_slots(surface.tree, points, slots)
    normals = np.zeros((len(points), 3))
    for i in range(len(points)):
        face, corners = surface.faces[surface.tree.face[slots[i]]], surface.tree.corners[slots[i]]
        away, size = 0.0, 0.0
        for r in range(3):
            closest = 0.0
            for c in range(3):
                normals[i, r] += weights[i, c] * surface.normals[face[c], r]
                closest += weights[i, c] * corners[c, r]
            away += (points[i, r] - closest) * normals[i, r]
            size += normals[i, r] ** 2
        squared[i] = np.copysign(np.sqrt(squared[i]), away)
        for r in range(3):
            normals[i, r] /= max(np.sqrt(size), 1e-300)
    return squared, normals


@dataclass(frozen=True, eq=False)
class Target:
    """A closed surface that vertices are to stay near."""

    mesh: TriMesh

    @cached_property
    def surface(self) -> Surface:
        """In arrays, for kernels."""
        return Surface(triangle_tree(self.mesh), np.array(self.mesh.faces), smooth_normals(self.mesh))

    def offsets(self, points: Floats) -> tuple[Floats, Floats]:
        """Signed distance (n,) of points (n, 3) along the target's normals (n, 3), positive outside."""
        return signed_offsets(self.surface, np.array(points, order="C"), np.zeros(len(points), np.int64))


def smoothness(mesh: TriMesh, beta: float) -> Floats:
    """K = I + β² ΛᵀΛ (V, V) with the umbrella Laplacian Λ: offsets are to be small, and smooth along the surface."""
    count = len(mesh.vertices)
    laplacian = np.eye(count)
    weight = -1.0 / mesh.valence
    for a, b in (mesh.edges.T, mesh.edges[:, ::-1].T):
        laplacian[a, b] = weight[a]
    return np.eye(count) + beta**2 * laplacian.T @ laplacian
