"""Loop subdivision: a smooth surface from triangles, every triangle of which is known by the one it came from.

Loop, "Smooth subdivision surfaces based on triangles" (1987); the weights at a vertex are his.
"""

import numpy as np
from scipy.sparse import coo_array, csr_array, diags_array

from drkid.curved_patch import barycentric_grid
from drkid.mesh import Floats, Ints, TriMesh, read_only

CORNERS = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])
"""The four triangles of a face whose corners are 0, 1, 2 and the points on whose sides 0, 1, 2 are 3, 4, 5."""


def subdivided(mesh: TriMesh) -> TriMesh:
    """One step on a closed mesh; faces 4f to 4f + 3 lie in face f: at its corners 0, 1, 2, then in the middle.

    A point on an edge is 3/8 of its ends and 1/8 of the corners opposite; a vertex of valence n keeps 1 − nβ of
    itself and takes β of each neighbour, β = (5/8 − (3/8 + cos(2π/n)/4)²)/n.

    Raises:
        ValueError: the mesh is not closed and manifold.
    """
    count, edges = len(mesh.vertices), mesh.edges
    opposite = mesh.faces[mesh.edge_faces].sum(axis=2) - edges.sum(axis=1, keepdims=True)
    odd = (3 * mesh.vertices[edges].sum(axis=1) + mesh.vertices[opposite].sum(axis=1)) / 8
    even = _vertex_mask(mesh) @ mesh.vertices
    local = np.concatenate([mesh.faces, count + mesh.face_edges], axis=1)
    return TriMesh(np.vstack([even, odd]), local[:, CORNERS].reshape(-1, 3))


def _vertex_mask(mesh: TriMesh) -> csr_array:
    n = np.maximum(mesh.valence, 1)
    beta = (5 / 8 - (3 / 8 + np.cos(2 * np.pi / n) / 4) ** 2) / n
    a, b = mesh.edges.T
    rows, columns = np.concatenate([a, b]), np.concatenate([b, a])
    ring = coo_array((beta[rows], (rows, columns)), shape=(len(n), len(n)))
    return csr_array(ring + diags_array(1 - n * beta))


def loop_patches(mesh: TriMesh, levels: int) -> Floats:
    """(F, n, 3): the patch of each face after `levels` steps, its points as in `barycentric_grid(levels)`.

    Patches of neighbouring faces have the very same points along the side that they share.
    """
    smooth = mesh
    for _ in range(levels):
        smooth = subdivided(smooth)
    own = smooth.faces.reshape(len(mesh.faces), -1)
    patches = np.empty((len(mesh.faces), len(barycentric_grid(levels).points), 3))
    patches[:, _grid_index(levels)] = smooth.vertices[own]
    return read_only(patches)


def _grid_index(levels: int) -> Ints:
    """(3·4^levels,): the point of the grid at each corner of the triangles into which one face is subdivided."""
    corners = np.eye(3)[None]
    for _ in range(levels):
        middles = (corners + np.roll(corners, -1, axis=1)) / 2
        corners = np.concatenate([corners, middles], axis=1)[:, CORNERS].reshape(-1, 3, 3)
    n = 2**levels
    _, i, j = np.moveaxis(np.rint(corners.reshape(-1, 3) * n).astype(np.int64), 1, 0)
    return j * (n + 1) - j * (j - 1) // 2 + i
