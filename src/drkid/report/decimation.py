"""Vertex clustering: a coarse copy of a surface to look at (Rossignac and Borrel 1993)."""

import numpy as np

from drkid.mesh import TriMesh


def clustered(mesh: TriMesh, faces: int) -> TriMesh:
    """The mesh with the vertices of each cell of a grid put at their mean: about `faces` faces; itself if it has less.

    For pictures alone: the result need not be manifold.
    """
    if len(mesh.faces) <= faces:
        return mesh
    cell = np.sqrt(2 * float(mesh.areas.sum()) / faces)
    keys = np.floor((mesh.vertices - mesh.vertices.min(axis=0)) / cell).astype(np.int64)
    _, index = np.unique(keys, axis=0, return_inverse=True)
    index = index.ravel()
    count = np.bincount(index)
    means = np.stack([np.bincount(index, weights=mesh.vertices[:, k]) / count for k in range(3)], axis=1)
    corners = index[mesh.faces]
    kept = corners[(corners != np.roll(corners, 1, axis=1)).all(axis=1)]
    turned = np.take_along_axis(kept, (np.arange(3) + kept.argmin(axis=1)[:, None]) % 3, 1)
    return TriMesh(means, np.unique(turned, axis=0))
