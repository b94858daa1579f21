"""The figures of a kit, from its three surfaces and its classes."""

import numpy as np

from drkid.kit import CurvedMetrics, Decomposition, Distance, MergedMetrics, Metrics, PartSet, Patches, piece_of_face
from drkid.measure import dihedral, hausdorff
from drkid.mesh import TriMesh

SAMPLING_SEED = 20_240  # of the points at which distances are taken; no kit depends on it


def surface_distances(surface: TriMesh, simplified: TriMesh, assembled: TriMesh) -> tuple[Distance, Distance, Distance]:
    """d_H(M_i, M_s), d_H(M_s, M_f) and d_H(M_i, M_f), in percent of M_i's bounding-box diagonal."""
    percent = 100 / surface.diagonal
    rng = np.random.default_rng(SAMPLING_SEED)
    pairs = ((surface, simplified), (simplified, assembled), (surface, assembled))
    found = [hausdorff(a, b, rng) for a, b in pairs]
    first, second, third = (Distance(d.mean * percent, d.max * percent) for d in found)
    return first, second, third


def measure_kit(
    surface: TriMesh,
    simplified: TriMesh,
    decomposition: Decomposition,
    part_set: PartSet,
    seconds: dict[str, float],
    patches: Patches | None = None,
    triangle_classes: int = 0,
) -> Metrics:
    """All metrics of a kit whose three surfaces and class lengths are in millimetres of the printed object.

    `patches` are in the source's unit; `triangle_classes` is the number of classes before triangles were merged.
    """
    mesh, errors = decomposition.mesh, decomposition.face_errors
    outer = None
    if part_set.merged:
        errors = errors[[piece.faces[0] for piece in part_set.merged]]
        owner = piece_of_face(part_set.merged, len(mesh.faces))
        outer = owner[mesh.edge_faces[:, 0]] != owner[mesh.edge_faces[:, 1]]
    percent = 100 / mesh.mean_edge
    angles = dihedral(mesh, outer)
    distances = surface_distances(surface, simplified, mesh)
    return Metrics(
        pieces=len(errors),
        classes=len(decomposition.class_lengths),
        unique_piece_parts=len(part_set.parts),
        mean_edge=mesh.mean_edge,
        error_max=float(errors.max()),
        error_max_percent=float(errors.max()) * percent,
        error_mean=float(errors.mean()),
        error_mean_percent=float(errors.mean()) * percent,
        surface_simplified=distances[0],
        simplified_assembled=distances[1],
        surface_assembled=distances[2],
        dihedral_mean_degrees=angles.mean_degrees,
        dihedral_p95_degrees=angles.p95_degrees,
        concave_percent=angles.concave_percent,
        groove_mean_mm=float(part_set.groove_mm.mean()),
        groove_max_mm=float(part_set.groove_mm.max()),
        genus=mesh.genus,
        iterations=decomposition.iterations,
        rigidity=decomposition.rigidity,
        seconds=seconds,
        unique_connector_parts=len(part_set.connectors),
        groove_choices=part_set.groove_choices,
        curved=_curved(surface, patches, part_set.scale_mm_per_unit),
        merged=_merged(patches, part_set, triangle_classes),
        cut_corners=part_set.cut_corners,
        deepest_cut_mm=part_set.deepest_cut_mm,
    )


def _curved(surface: TriMesh, patches: Patches | None, scale: float) -> CurvedMetrics | None:
    if patches is None or patches.figures is None:
        return None
    found = patches.figures
    apart = hausdorff(surface, found.surface.scaled(scale), np.random.default_rng(SAMPLING_SEED))
    percent = 100 / surface.diagonal
    return CurvedMetrics(
        threshold_percent=found.threshold_percent,
        gap_mean_mm=float(found.gap.mean()) * scale,
        gap_p95_mm=float(np.percentile(found.gap, 95)) * scale,
        flat_break_mean_degrees=found.flat_break_mean,
        flat_break_p95_degrees=found.flat_break_p95,
        break_mean_degrees=found.break_mean,
        break_p95_degrees=found.break_p95,
        surface_curved=Distance(apart.mean * percent, apart.max * percent),
    )


def _merged(patches: Patches | None, part_set: PartSet, triangle_classes: int) -> MergedMetrics | None:
    if patches is None or patches.misfit is None:
        return None
    return MergedMetrics(
        triangles=len(patches.decomposition.mesh.faces),
        triangle_classes=triangle_classes,
        single_triangles=sum(len(piece.faces) == 1 for piece in patches.pieces),
        misfit_mean_mm=float(patches.misfit.mean()) * part_set.scale_mm_per_unit,
        misfit_max_mm=float(patches.misfit.max()) * part_set.scale_mm_per_unit,
    )
