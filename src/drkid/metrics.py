"""The figures of a kit, from its three surfaces and its classes."""

import numpy as np

from drkid.kit import Decomposition, Distance, Metrics, PartSet
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
    surface: TriMesh, simplified: TriMesh, decomposition: Decomposition, part_set: PartSet, seconds: dict[str, float]
) -> Metrics:
    """All metrics of a kit whose three surfaces and class lengths are in millimetres of the printed object."""
    mesh, errors = decomposition.mesh, decomposition.face_errors
    percent = 100 / mesh.mean_edge
    angles = dihedral(mesh)
    distances = surface_distances(surface, simplified, mesh)
    return Metrics(
        pieces=len(mesh.faces),
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
    )
