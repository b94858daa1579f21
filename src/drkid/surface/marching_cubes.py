"""Marching cubes on a mask: its topology first, then where the vertices lie on their grid edges.

Lewiner et al., "Efficient implementation of marching cubes' cases with topological guarantees", JGT 8 (2003).
"""

import numpy as np
from scipy.sparse import coo_array, csr_array, diags_array
from skimage.measure import marching_cubes

from drkid.mesh import Bools, Floats, Ints, TriMesh
from drkid.surface.bodies import outermost
from drkid.surface.pinched_vertex import split_pinched

UNBIASED, JOINED = 0.0, 0.4
"""What a background voxel counts as, an object's being 1 and the level 0.5: ambiguous cubes are then decided by
Lewiner's tests alone, or for the object, which is 26-connected because the background is nearer to the level."""

LEAST_FRACTION = 0.02  # of a grid edge between a vertex and a voxel centre: no face can shrink to nothing


def grid_surface(mask: Bools) -> tuple[TriMesh, int]:
    """The mask's outermost surface in voxel indices, faces outwards, and how many other bodies were dropped.

    Lewiner's tests decide the ambiguous cubes without a bias. In noise his ties can leave a hole; then the cubes are
    decided for the object, which is always closed.

    Args:
        mask: (x, y, z), with background on every side.
    """
    mesh = marched(mask, UNBIASED)
    return outermost(mesh) if mesh.is_closed_manifold else joined_surface(mask)


def joined_surface(mask: Bools) -> tuple[TriMesh, int]:
    """The same with every ambiguous cube decided for the object: its topology is that of the 26-connected voxels."""
    return outermost(split_pinched(marched(mask, JOINED)))


def marched(mask: Bools, background: float) -> TriMesh:
    """Marching cubes at level 0.5, open where the mask reaches the array's end."""
    vertices, faces = marching(mask, background)
    return TriMesh(vertices, faces.astype(np.int64))


def marching(mask: Bools, background: float) -> tuple[Floats, Ints]:
    """The same as plain arrays of vertices and faces."""
    field = np.where(mask, np.float32(1), np.float32(background))
    vertices, faces, _, _ = marching_cubes(field, 0.5, gradient_direction="ascent")
    return vertices, faces


def slid(mesh: TriMesh, field: Floats) -> Floats:
    """(V, 3): each vertex at the field's zero on its own grid edge, by linear interpolation.

    The topology stays as it is, and nothing leaves its edge. A vertex inside a cube, which Lewiner's cases add, goes
    to the mean of its neighbours.

    Args:
        mesh: a surface from `grid_surface`.
        field: (x, y, z), positive exactly at the voxels inside.
    """
    low, high = np.floor(mesh.vertices).astype(np.int64), np.ceil(mesh.vertices).astype(np.int64)
    on_edge = (low != high).sum(axis=1) == 1
    below, above = field[tuple(low[on_edge].T)].astype(np.float64), field[tuple(high[on_edge].T)].astype(np.float64)
    along = np.clip(below / (below - above), LEAST_FRACTION, 1 - LEAST_FRACTION)
    vertices = np.array(mesh.vertices)
    vertices[on_edge] = low[on_edge] + (high - low)[on_edge] * along[:, None]
    if not on_edge.all():
        vertices[~on_edge] = (neighbour_mean(mesh) @ vertices)[~on_edge]
    return vertices


def neighbour_mean(mesh: TriMesh) -> csr_array:
    """(V, V): the matrix that takes values at the vertices to the mean over each vertex's neighbours."""
    a, b = mesh.edges.T
    ones = np.ones(2 * len(a))
    size = len(mesh.vertices)
    graph = coo_array((ones, (np.concatenate([a, b]), np.concatenate([b, a]))), shape=(size, size))
    return csr_array(diags_array(1.0 / mesh.valence) @ graph)
