"""The staircase of a mask and its removal, within one voxel."""

import numpy as np
import scipy.ndimage as ndi

from drkid.intersection import self_intersections
from drkid.mesh import Bools, Floats, TriMesh
from drkid.surface.marching_cubes import neighbour_mean, slid

SIGMA_VOXELS = 1.0
HAIR = 0.02  # how far, in voxels, a voxel stays on its side of the level
STEPS, SHRINK, GROW = 10, 0.5, -0.53
OFFSETS = 3  # Newton steps towards the volume: it is right to a ten-thousandth then
REACH_VOXELS = 0.95  # from the unsmoothed surface: leaves room to the promised voxel


def without_staircase(mesh: TriMesh, mask: Bools, spacing: Floats) -> tuple[Floats, float]:
    """(V, 3) in voxel indices: the surface without the staircase, and the largest displacement in voxels.

    First the vertices slide along their grid edges to the zero of a smoothed distance: no voxel changes sides, so
    none moves by more than half an edge. Then bounded fairing and the volume restored, both taken back where they made
    faces cut one another.
    """
    start = slid(mesh, np.where(mask, np.float32(1), np.float32(-1)))
    on_edges = slid(mesh, smoothed_distance(mask, spacing))
    vertices = with_volume_of(mesh, start, faired(mesh, on_edges, start, spacing), spacing)
    thin = TriMesh(mesh.vertices, mesh.faces[near_thin_places(mesh, mask)])
    vertices = uncrossed(thin, vertices, on_edges, spacing)
    return vertices, float(np.linalg.norm(vertices - start, axis=1).max())


def smoothed_distance(mask: Bools, spacing: Floats) -> Floats:
    """(x, y, z): signed distance, inside positive, smoothed, and positive exactly inside.

    2 G − G² of the signed distance, G a Gaussian of one voxel: the first-order shrinking of curved places by G, in
    proportion to their curvature, cancels (the unsharp filter; the idea of Taubin 1995 on a grid). The distance, not
    the mask, is smoothed because it knows how far a terrace of flat, anisotropic voxels reaches.
    """
    inside, outside = (ndi.distance_transform_edt(side, sampling=spacing) for side in (mask, ~mask))
    once = ndi.gaussian_filter(((inside - outside) / spacing.min()).astype(np.float32), SIGMA_VOXELS)
    field = 2 * once - ndi.gaussian_filter(once, SIGMA_VOXELS)
    return np.where(mask, np.maximum(field, HAIR), np.minimum(field, -HAIR))


def faired(mesh: TriMesh, vertices: Floats, start: Floats, spacing: Floats) -> Floats:
    """(V, 3): Taubin's λ|μ smoothing ("A signal processing approach to fair surface design", 1995), bounded.

    After every half-step a vertex is drawn back to within REACH_VOXELS of its place in `start`. Steps are taken in
    physical space; `vertices`, `start` and the result are voxel indices.
    """
    mean = neighbour_mean(mesh)
    for weight in (SHRINK, GROW) * STEPS:
        place = vertices * spacing
        vertices = _within_reach((place + weight * (mean @ place - place)) / spacing, start)
    return vertices


def with_volume_of(mesh: TriMesh, start: Floats, vertices: Floats, spacing: Floats) -> Floats:
    """(V, 3): the vertices, moved along their normals by a same distance, so that they enclose as much as `start` does.

    Faces are chords between slices: where voxels are long along one axis and the shape is a few of them wide, a surface
    whose vertices lie right still encloses some percent too little (the trapezoidal rule's error).
    """
    goal = mesh.moved(start * spacing).volume
    for _ in range(OFFSETS):
        surface = mesh.moved(vertices * spacing)
        distance = (goal - surface.volume) / surface.areas.sum()
        vertices = _within_reach(vertices + distance * surface.vertex_normals / spacing, start)
    return vertices


def _within_reach(vertices: Floats, start: Floats) -> Floats:
    move = vertices - start
    length = np.linalg.norm(move, axis=1, keepdims=True)
    return start + move * np.minimum(1.0, REACH_VOXELS / np.maximum(length, REACH_VOXELS))


def near_thin_places(mesh: TriMesh, mask: Bools) -> Bools:
    """(F,): faces at or near a wall, gap, spike or notch that holds no cube of three voxels.

    Only there are two sides so close that fairing can take them through one another.
    """
    solid = mask.astype(np.uint8)
    opened = ndi.maximum_filter(ndi.minimum_filter(solid, 3), 3)
    closed = ndi.minimum_filter(ndi.maximum_filter(solid, 3), 3)
    near = ndi.maximum_filter(closed - opened, 5)
    at_vertex = near[tuple(np.rint(mesh.vertices).astype(np.int64).T)] > 0
    return np.asarray(at_vertex[mesh.faces].any(axis=1))


def uncrossed(mesh: TriMesh, vertices: Floats, safe: Floats, spacing: Floats) -> Floats:
    """(V, 3): `vertices`, but `safe` at the corners of faces that cut others, until no such face has moved from there.

    In sheets of one to three voxels fairing can take two sides through one another; vertices on their own grid edges
    cannot meet.
    """
    vertices = vertices.copy()
    while True:
        cutting = np.unique(mesh.faces[self_intersections(mesh.moved(vertices * spacing))])
        back = cutting[(vertices[cutting] != safe[cutting]).any(axis=1)]
        if not back.size:
            return vertices
        vertices[back] = safe[back]
