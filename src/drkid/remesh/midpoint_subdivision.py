"""Midpoint subdivision: each face in four, which changes no point of the surface."""

import numpy as np

from drkid.mesh import TriMesh


def subdivided(mesh: TriMesh, least: int) -> TriMesh:
    """The same surface with at least `least` vertices: each side halved, as often as it takes."""
    while len(mesh.vertices) < least:
        middles = len(mesh.vertices) + mesh.face_edges
        a, b, c = mesh.faces.T
        ab, bc, ca = middles.T
        faces = np.concatenate([np.column_stack(t) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
        mesh = TriMesh(np.concatenate([mesh.vertices, mesh.vertices[mesh.edges].mean(axis=1)]), faces)
    return mesh
