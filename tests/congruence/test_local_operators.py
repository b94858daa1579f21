import numpy as np
import pytest

from drkid.congruence.kmeans import cluster
from drkid.congruence.local_operators import (
    VALENCE_RANGE,
    collapse_towards_classes,
    flip_towards_classes,
    flip_towards_valence_six,
)
from drkid.congruence.triangle_space import ascending_lengths
from drkid.mesh import TriMesh


def energy(mesh: TriMesh, means: np.ndarray) -> float:
    points = ascending_lengths(mesh)
    return float(((points[:, None] - means) ** 2).sum(axis=2).min(axis=1).sum())


def roughened(mesh: TriMesh, seed: int = 0) -> TriMesh:
    """Vertices shaken, so that some edges want to be flipped or collapsed."""
    shake = 0.18 * mesh.mean_edge * np.random.default_rng(seed).normal(size=mesh.vertices.shape)
    return mesh.moved(mesh.vertices + shake)


@pytest.mark.parametrize("name", ["potato", "ring"])
@pytest.mark.parametrize("operator", [flip_towards_classes, collapse_towards_classes])
def test_operators_keep_a_closed_manifold_of_the_same_genus(name, operator, request):
    mesh = roughened(request.getfixturevalue(name))
    means, _ = cluster(ascending_lengths(mesh), 5, np.random.default_rng(0))
    changed, count = operator(mesh, means)
    assert count > 0
    assert changed.is_closed_manifold
    assert changed.genus == mesh.genus
    assert changed.volume > 0
    assert changed.valence.max() <= max(VALENCE_RANGE[1], mesh.valence.max())


def test_flips_towards_classes_lower_the_energy(potato):
    mesh = roughened(potato)
    means, _ = cluster(ascending_lengths(mesh), 5, np.random.default_rng(0))
    changed, flips = flip_towards_classes(mesh, means)
    assert flips > 0
    assert energy(changed, means) < energy(mesh, means)
    assert (changed.vertices == mesh.vertices).all()


def test_each_collapse_takes_one_vertex_and_two_faces(potato):
    mesh = roughened(potato)
    means, _ = cluster(ascending_lengths(mesh), 5, np.random.default_rng(0))
    changed, collapses = collapse_towards_classes(mesh, means)
    assert len(changed.vertices) == len(mesh.vertices) - collapses
    assert len(changed.faces) == len(mesh.faces) - 2 * collapses
    assert energy(changed, means) < energy(mesh, means)


def test_valence_flips_bring_valences_nearer_to_six(potato):
    shaken, _ = flip_towards_classes(roughened(potato, 3), np.array([[0.2, 0.3, 0.45]]))
    better, flips = flip_towards_valence_six(shaken)
    assert flips > 0
    assert ((better.valence - 6) ** 2).sum() < ((shaken.valence - 6) ** 2).sum()
    assert flip_towards_valence_six(better)[1] == 0
