"""Curved patches for every class, in the way that is asked for, and what they bring."""

from dataclasses import replace

import numpy as np

from drkid.curved_patch import CurvedPatch
from drkid.kit import CurvedFigures, Decomposition, Patches
from drkid.measure import bend_radians
from drkid.mesh import TriMesh
from drkid.patches.canonical_classes import canonical_classes
from drkid.patches.laid_faces import LaidFaces, laid_faces
from drkid.patches.published_patch import curvature_space, published_patches
from drkid.patches.smoothness import assembled, joints
from drkid.spec import KitSpec

SMOOTHNESS = 0.002  # weight of tangent breaks: the distance to the surface gives way a little for them
GAP_CLEARANCES = 2.0  # the gap at 95 of 100 joints in clearances: what two halves in their pockets give
MEAN_EDGE_CLEARANCES = 200.0  # mean edge of a print in clearances where no size is given: 40 mm by fdm
PERCENTILE = 95


def curved_patches(decomposition: Decomposition, surface: TriMesh, spec: KitSpec) -> Patches:
    """Curved patches of a decomposition of `surface`, both in the same unit; canonical or as published."""
    classes = spec.curved_classes_for(len(decomposition.class_lengths))
    if spec.curved == "published":
        rng = np.random.default_rng(spec.seed)
        classes = min(classes, len(decomposition.mesh.faces))
        found = published_patches(decomposition, classes, spec.subdivision_levels, rng)
        shapes, laid, divided = found.shapes, found.laid, found.decomposition
        threshold, allowance = found.threshold_percent, None
    else:
        allowance = most_gap(decomposition, spec)
        divided, laid, canonical = canonical_classes(decomposition, surface, classes, SMOOTHNESS, allowance)
        shapes = tuple(patch.surface for patch in canonical)
        threshold = _threshold_percent(laid, shapes, spec.subdivision_levels)
    figures = _figures(decomposition, laid, shapes, threshold, spec.subdivision_levels)
    return Patches(divided, shapes, figures, allowance=allowance)


def flattened_patches(patches: Patches, share: float, levels: int) -> Patches:
    """The patches with so much of their height, and what they then bring; nothing changes where all of it is left."""
    if share >= 1 or patches.figures is None:
        return patches
    laid, shapes = laid_faces(patches.decomposition), tuple(p.flattened(share) for p in patches.curved)
    found = joints(laid, shapes)
    figures = replace(
        patches.figures,
        gap=found.gap,
        break_mean=float(found.break_degrees.mean()),
        break_p95=float(np.percentile(found.break_degrees, PERCENTILE)),
        surface=assembled(laid, shapes, levels),
    )
    return replace(patches, curved=shapes, figures=figures)


def most_gap(decomposition: Decomposition, spec: KitSpec) -> float:
    """The gap that canonical patches may leave at their joints, in the mesh's unit."""
    clearance_mm = spec.preset.clearance_mm if spec.clearance_mm is None else spec.clearance_mm
    gap_mm = GAP_CLEARANCES * clearance_mm if spec.curved_gap_mm is None else spec.curved_gap_mm
    return gap_mm * units_per_mm(decomposition, spec)


def units_per_mm(decomposition: Decomposition, spec: KitSpec) -> float:
    """The mesh's unit in a millimetre of the print, or of a generously large one where its size is found later."""
    mesh = decomposition.mesh
    if decomposition.scale_mm_per_unit is not None:
        return 1 / decomposition.scale_mm_per_unit
    if spec.size_mm is not None:
        return float(mesh.extents.max()) / spec.size_mm
    if spec.mean_edge_mm is not None:
        return mesh.mean_edge / spec.mean_edge_mm
    return mesh.mean_edge / (MEAN_EDGE_CLEARANCES * spec.preset.clearance_mm)


def _threshold_percent(laid: LaidFaces, shapes: tuple[CurvedPatch, ...], levels: int) -> float:
    """T of patches that are made alike: what is left are the differences of their corners."""
    surface = assembled(laid, shapes, levels)
    patches = surface.vertices.reshape(len(laid.face_class), -1, 3)
    space = curvature_space(laid.mesh.vertices[laid.vertices], patches, levels)
    count = len(shapes)
    means = np.stack([space[laid.face_class == k].mean(axis=0) for k in range(count)])
    return 100 * float(np.linalg.norm(space - means[laid.face_class], axis=1).max())


def _figures(
    flat: Decomposition, laid: LaidFaces, shapes: tuple[CurvedPatch, ...], threshold: float, levels: int
) -> CurvedFigures:
    found = joints(laid, shapes)
    before = np.abs(np.degrees(bend_radians(flat.mesh)))
    return CurvedFigures(
        threshold_percent=threshold,
        gap=found.gap,
        flat_break_mean=float(before.mean()),
        flat_break_p95=float(np.percentile(before, PERCENTILE)),
        break_mean=float(found.break_degrees.mean()),
        break_p95=float(np.percentile(found.break_degrees, PERCENTILE)),
        surface=assembled(laid, shapes, levels),
    )
