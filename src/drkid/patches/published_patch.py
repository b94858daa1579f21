"""Curved patches as the paper has them: Loop's surface, classified with the curvature as a fourth dimension.

The paper, "Sub-division and Smoothing" and "Curvature-aware patch classification".
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.cluster.vq import kmeans2

from drkid.class_triangle import laid_down
from drkid.curved_patch import CurvedPatch, barycentric_grid, fitted
from drkid.kit import Decomposition, Outcome
from drkid.mesh import Floats, Ints, TriMesh, read_only
from drkid.patches.laid_faces import LaidFaces, laid_faces
from drkid.patches.loop_subdivision import loop_patches
from drkid.rigid_fit import rigid_fit

RESTARTS = 16
DEGREE = 6  # of the polynomial that stands for a mean patch; 28 terms for the 45 points of three levels


@dataclass(frozen=True, eq=False)
class PublishedPatches:
    """The decomposition into the paper's classes, its mean patch per class, and T, in percent of the mean edge."""

    decomposition: Decomposition
    laid: LaidFaces
    shapes: tuple[CurvedPatch, ...]
    threshold_percent: float


def curvature_space(corners: Floats, patches: Floats, levels: int) -> Floats:
    """(F, 4): (w, x, y, z) of curved triangles (the paper, equation for d').

    x ≤ y ≤ z are the sides of the planar triangle of the corners (F, 3, 3); w is the squared distance of its centre
    to the centre of the central triangle of the subdivided patch (F, n, 3). All in the mean side length of the
    corners' triangles, which the paper leaves open: w is a square and would otherwise depend on the unit.
    """
    sides = np.sort(np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2), axis=1)
    unit = float(sides.mean())
    grid = barycentric_grid(levels)
    middle = patches[:, grid.faces[grid.central]].mean(axis=1)
    w = ((middle - corners.mean(axis=1)) ** 2).sum(axis=1)
    return np.column_stack([w / unit**2, sides / unit])


def published_patches(
    decomposition: Decomposition, classes: int, levels: int, rng: np.random.Generator
) -> PublishedPatches:
    """M_f smoothed by Loop subdivision, a patch for each face, in `classes` classes.

    The patches' corners move to where subdivision takes the vertices, so that the mesh of the corners is no longer
    the isometric one: what the paper accepts for its T of 7.5 % at k = 6 and 3.75 % at k = 10. T is the largest
    distance of a patch to its class in (w, x, y, z). A class's shape is the mean of its members, laid on one another
    by their corners.
    """
    patches = loop_patches(decomposition.mesh, levels)
    corner = [int(np.argmax(barycentric_grid(levels).points[:, i])) for i in range(3)]
    vertices = np.zeros_like(decomposition.mesh.vertices)
    vertices[decomposition.mesh.faces] = patches[:, corner]
    mesh = TriMesh(vertices, decomposition.mesh.faces)
    space = curvature_space(mesh.corners, patches, levels)
    label = _clustered(space, classes, rng)
    means = np.stack([space[label == k].mean(axis=0) for k in range(label.max() + 1)])
    lengths = np.sort(mesh.side_lengths, axis=1)
    class_lengths = np.stack([lengths[label == k].mean(axis=0) for k in range(label.max() + 1)])
    errors = np.linalg.norm(lengths - class_lengths[label], axis=1)
    percent = 100 * float(errors.max()) / mesh.mean_edge
    divided = replace(
        decomposition,
        mesh=mesh,
        face_class=read_only(label),
        class_lengths=read_only(class_lengths),
        face_errors=read_only(errors),
        outcome=Outcome("stalled", f"patches are classified, not made alike: error {percent:.2f} % of the mean edge"),
        scale_mm_per_unit=None,
        rigidity=None,
    )
    laid = laid_faces(divided)
    threshold = 100 * float(np.linalg.norm(space - means[label], axis=1).max())
    return PublishedPatches(divided, laid, _mean_shapes(laid, patches, levels), threshold)


def _clustered(space: Floats, classes: int, rng: np.random.Generator) -> Ints:
    """(F,): classes of the best of several k-means++ starts, in ascending order of their means, none empty."""
    best, label = np.inf, np.zeros(len(space), np.int64)
    for _ in range(RESTARTS):
        _, found = kmeans2(space, classes, minit="++", rng=rng, missing="raise")
        means = np.stack(
            [space[found == k].mean(axis=0) if (found == k).any() else np.zeros(4) for k in range(classes)]
        )
        energy = float(((space - means[found]) ** 2).sum())
        if energy < best:
            best, label = energy, found.astype(np.int64)
    used = np.unique(label)
    order = sorted(used, key=lambda k: tuple(space[label == k].mean(axis=0)[1:]))
    rank = {int(k): i for i, k in enumerate(order)}
    return np.array([rank[int(k)] for k in label], np.int64)


def _mean_shapes(laid: LaidFaces, patches: Floats, levels: int) -> tuple[CurvedPatch, ...]:
    grid = barycentric_grid(levels)
    local = _in_part_frames(laid, patches, levels)
    shapes: list[CurvedPatch] = []
    for index, lengths in enumerate(laid.class_lengths):
        mean = local[laid.face_class == index].mean(axis=0)
        flat = np.column_stack([laid_down(lengths), np.zeros(3)])
        corner = [int(np.argmax(grid.points[:, i])) for i in range(3)]
        mean += grid.points @ (flat - mean[corner])  # the mean of the corners is brought onto the class triangle's
        shapes.append(fitted(grid.points, mean, min(DEGREE, 2**levels)))
    return tuple(shapes)


def _in_part_frames(laid: LaidFaces, patches: Floats, levels: int) -> Floats:
    """(F, n, 3): patches in the order and frame of their classes, left-handed ones seen in a mirror."""
    grid = barycentric_grid(levels)
    number = {tuple(b): i for i, b in enumerate(np.rint(grid.points * 2**levels).astype(int).tolist())}
    faces = laid.mesh.faces
    turn = (laid.vertices[:, :, None] == faces[:, None, :]).argmax(axis=2)  # which own corner lies at class corner i
    lattice = np.rint(grid.points * 2**levels).astype(np.int64)
    out = np.empty_like(patches)
    for f, at in enumerate(turn):
        own = np.zeros_like(lattice)
        own[:, at] = lattice
        out[f] = patches[f, [number[tuple(b)] for b in own.tolist()]]
    flat = np.zeros((len(laid.class_lengths), 3, 3))
    flat[:, :, :2] = laid_down(laid.class_lengths)
    mirror = np.where(laid.left[:, None, None], np.array([-1.0, 1.0, 1.0]), 1.0)
    motion = rigid_fit(laid.mesh.vertices[laid.vertices], flat[laid.face_class] * mirror)
    placed = np.einsum("fij,fnj->fni", motion[:, :3, :3], out) + motion[:, None, :3, 3]
    return placed * mirror
