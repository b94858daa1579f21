"""The surface that the simplified mesh's vertices lie on: M_i, moved along its normals by what the mesh tells.

Vertices on a convex surface put faces inside it. M_s therefore has its vertices a sagitta outside; a solver that is to
move them about at that height needs the surface of that height, not M_i.
"""

import numpy as np

from drkid.measure import smooth_normals
from drkid.mesh import TriMesh
from drkid.remesh.closest_point import ClosestPoint


def offset_surface(closest: ClosestPoint, mesh: TriMesh) -> TriMesh:
    """M_i with each vertex moved by the signed height of the mesh's vertices above it, interpolated in their faces."""
    surface = closest.surface
    foot, normals = closest(mesh.vertices)
    apart = mesh.vertices - foot
    height = np.linalg.norm(apart, axis=1) * np.sign(np.einsum("ij,ij->i", apart, normals))
    _, face, weights = ClosestPoint(mesh).in_faces(surface.vertices)
    rise = np.einsum("ij,ij->i", weights, height[mesh.faces[face]])
    return surface.moved(surface.vertices + rise[:, None] * smooth_normals(surface))
