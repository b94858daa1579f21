"""Welding: vertices at one place become one vertex."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from drkid.mesh import Floats, Ints, TriMesh

WELD_DIAGONALS = 1e-9  # vertices closer than this times the bounding box's diagonal are one


def welded(vertices: Floats, faces: Ints) -> TriMesh:
    """The mesh with vertices (V, 3) merged by position, and without the faces and vertices that are then idle.

    Dropped are faces that name a vertex twice, faces of the same three vertices as an earlier one, and vertices of no
    face.
    """
    diagonal = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    places, index = np.unique(
        vertices, axis=0, return_inverse=True
    )  # exact first: the tree stays small on triangle soup
    close = cKDTree(places).query_pairs(WELD_DIAGONALS * diagonal, output_type="ndarray")
    graph = coo_array((np.ones(len(close)), (close[:, 0], close[:, 1])), shape=(len(places), len(places)))
    count, group = connected_components(graph, directed=False)
    merged = np.empty((count, 3))
    merged[group] = places
    corners = np.sort(named := group[index.ravel()][faces].astype(np.int64), axis=1)
    _, first = np.unique(corners, axis=0, return_index=True)
    keep = np.zeros(len(faces), np.bool_)
    keep[first] = True
    keep &= (corners[:, 0] != corners[:, 1]) & (corners[:, 1] != corners[:, 2])
    return TriMesh(merged, named).submesh(keep)
