"""Pinched vertices: vertices whose faces form more than one fan."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from drkid.mesh import TriMesh


def split_pinched(mesh: TriMesh) -> TriMesh:
    """The same faces with one copy of a vertex for each of its fans; the mesh itself where nothing is pinched.

    Guéziec et al., "Cutting and stitching", IEEE TVCG 7 (2001): corners that share an edge share their end vertices.
    An edge of two faces joins their corners; every other edge is a border.
    """
    if not mesh.pinched_vertices:
        return mesh
    corner = np.arange(3 * len(mesh.faces)).reshape(-1, 3)
    following = np.roll(corner, -1, axis=1).ravel()
    edge = mesh.face_edges.ravel()
    order = np.argsort(edge, kind="stable")
    faces_at = np.bincount(edge)
    pairs = order[(faces_at == 2)[edge[order]]].reshape(-1, 2)
    one, two = pairs.T
    opposed = mesh.half_edges[one, 0] == mesh.half_edges[two, 1]
    first = np.concatenate([one, following[one]])
    second = np.concatenate([np.where(opposed, following[two], two), np.where(opposed, two, following[two])])
    graph = coo_array((np.ones(len(first)), (first, second)), shape=(corner.size, corner.size))
    count, fan = connected_components(graph, directed=False)
    vertices = np.empty((count, 3))
    vertices[fan] = mesh.vertices[mesh.faces.ravel()]
    return TriMesh(vertices, fan.reshape(-1, 3).astype(np.int64))
