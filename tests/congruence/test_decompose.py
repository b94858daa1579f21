import sys

import numpy as np
import pytest
import trimesh

from drkid.congruence import decompose
from drkid.congruence.decompose import _isosceles
from drkid.congruence.pressure import PressureSolver
from drkid.congruence.softest_mode import rigidity
from drkid.congruence.solver import run
from drkid.errors import SpecError
from drkid.intersection import self_intersections
from drkid.measure import distance_to_surface
from drkid.mesh import TriMesh
from drkid.spec import KitSpec

QUICK = KitSpec(method="pressure", classes=5, max_iterations=3000, tolerance_percent=0.1)


@pytest.fixture(scope="module")
def coarse() -> TriMesh:
    """80 faces, none of them alike."""
    sphere = trimesh.creation.icosphere(subdivisions=1)
    vertices = np.asarray(sphere.vertices) * [1.5, 1, 0.8] + 0.05 * np.sin(7 * np.asarray(sphere.vertices))
    return TriMesh(vertices, np.asarray(sphere.faces))


def test_an_icosphere_is_two_classes_at_once():
    sphere = trimesh.creation.icosphere(subdivisions=1)
    mesh = TriMesh(np.asarray(sphere.vertices), np.asarray(sphere.faces))
    found = decompose(mesh, KitSpec(method="pressure", classes=2))
    assert found.outcome.status == "converged"
    assert np.bincount(found.face_class).tolist() == [60, 20]
    assert found.face_errors.max() < 1e-12
    assert found.iterations == 0


def test_errors_fall_and_the_history_ends_with_what_is_returned(coarse):
    found = decompose(coarse, QUICK)
    first = found.convergence[0]
    percent = 100 * found.face_errors.max() / found.mesh.mean_edge
    assert percent < first.error_max_percent / 2
    assert min(c.error_max_percent for c in found.convergence) == pytest.approx(percent, rel=0.02)
    assert [c.iteration for c in found.convergence] == list(range(found.iterations + 1))


def test_the_result_is_a_sound_surface_near_the_given_one(coarse):
    found = decompose(coarse, QUICK)
    assert found.mesh.is_closed_manifold
    assert found.mesh.genus == 0
    assert len(self_intersections(found.mesh)) == 0
    assert distance_to_surface(coarse, found.mesh.vertices).max() <= QUICK.limit * coarse.mean_edge * (1 + 1e-9)


def test_class_lengths_are_the_members_means_in_ascending_order(coarse):
    found = decompose(coarse, QUICK)
    points = np.sort(found.mesh.side_lengths, axis=1)
    for index, lengths in enumerate(found.class_lengths):
        assert points[found.face_class == index].mean(axis=0) == pytest.approx(lengths, rel=1e-3)
    assert (np.diff(found.class_lengths, axis=1) >= 0).all()
    assert (np.diff(found.class_lengths[:, 0]) >= 0).all()
    assert found.face_errors == pytest.approx(np.linalg.norm(points - found.class_lengths[found.face_class], axis=1))


def test_a_seed_decides_everything(coarse):
    one, two = decompose(coarse, QUICK), decompose(coarse, QUICK)
    assert (one.mesh.vertices == two.mesh.vertices).all()
    other = decompose(coarse, QUICK.model_copy(update={"seed": 1}))
    assert not np.allclose(one.mesh.vertices[: len(other.mesh.vertices)], other.mesh.vertices[: len(one.mesh.vertices)])


def test_it_converges_when_the_tolerance_is_within_reach(coarse):
    found = decompose(coarse, KitSpec(method="pressure", classes=12, tolerance_percent=6, max_iterations=20000))
    assert found.outcome.status == "converged"
    assert 100 * found.face_errors.max() / found.mesh.mean_edge <= 6


def test_it_says_why_it_stalls(coarse):
    found = decompose(coarse, KitSpec(method="pressure", classes=2, tolerance_percent=0.01, max_iterations=500))
    assert found.outcome.status == "stalled"
    assert "the iterations are used up" in found.outcome.message
    assert found.iterations == 500


@pytest.mark.parametrize("method", ["palette", "pressure"])
def test_more_classes_than_faces_are_refused(coarse, method):
    with pytest.raises(SpecError, match="81 classes cannot be made of 80 faces"):
        decompose(coarse, KitSpec(method=method, classes=81))


def test_the_driver_tells_how_far_it_is(coarse):
    told: list[tuple[str, float]] = []
    unreachable = QUICK.model_copy(update={"tolerance_percent": 1e-9})
    run(PressureSolver(unreachable), coarse, lambda what, fraction: told.append((what, fraction)))
    fractions = [fraction for _, fraction in told]
    assert fractions == sorted(fractions)
    assert fractions[-1] == pytest.approx(1)
    assert told[0] == ("starting", 0.0)
    assert "largest error" in told[1][0]


def test_nearly_isosceles_classes_are_made_isosceles():
    lengths = np.array([[1.0, 1.0004, 1.2], [1.0, 1.1, 1.1008], [1.0, 1.0004, 1.0008], [1.0, 1.1, 1.2]])
    found = _isosceles(lengths, 1.1)
    assert found[0] == pytest.approx([1.0002, 1.0002, 1.2])
    assert found[1] == pytest.approx([1.0, 1.1004, 1.1004])
    assert found[2] == pytest.approx([1.0004] * 3)
    assert found[3].tolist() == [1.0, 1.1, 1.2]
    assert (np.sort(found, axis=1) == found).all()


def test_it_says_how_stiff_the_shell_is(coarse):
    found = decompose(coarse, QUICK)
    assert found.rigidity == rigidity(found.mesh)


def test_a_shell_whose_rigidity_cannot_be_measured_is_made_all_the_same(coarse, monkeypatch):
    def degenerate(_mesh):
        raise np.linalg.LinAlgError("an edge has no length")

    monkeypatch.setattr(sys.modules["drkid.congruence.decompose"], "rigidity", degenerate)
    assert decompose(coarse, QUICK).rigidity is None
