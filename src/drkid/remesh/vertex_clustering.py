"""Vertex clustering: all vertices in one cube of a grid become one, and triangles that lose their area go.

Rossignac and Borrel, "Multi-resolution 3D approximations for rendering complex scenes" (1993).
"""

import numpy as np

from drkid.mesh import TriMesh


def clustered(mesh: TriMesh, count: int) -> TriMesh:
    """About `count` triangles or fewer that lie where the mesh's do; the mesh itself if it has no more.

    Good for integrals over the surface alone: the triangles need not be a manifold, and thin walls may meet. The cubes'
    side is that of the squares in a plane of the mesh's area, two triangles to a square.
    """
    if len(mesh.faces) <= count:
        return mesh
    centred = mesh.vertices - mesh.vertices.mean(axis=0)
    along = centred @ np.linalg.eigh(centred.T @ centred)[1]
    along *= np.where((along**3).sum(axis=0) < 0, -1, 1)  # so that the cubes go with the mesh when it turns
    side = np.sqrt(2 * mesh.areas.sum() / count)
    place = np.floor((along - along.min(axis=0)) / side).astype(np.int64)
    sizes = place.max(axis=0) + 1
    key = (place[:, 0] * sizes[1] + place[:, 1]) * sizes[2] + place[:, 2]
    _, cluster = np.unique(key, return_inverse=True)
    cluster = cluster.ravel()
    number = np.bincount(cluster)
    vertices = np.column_stack([np.bincount(cluster, mesh.vertices[:, d]) / number for d in range(3)])
    faces = cluster[mesh.faces]
    whole = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    return TriMesh(vertices, faces[whole])
