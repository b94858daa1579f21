import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from quadratic_problem import pebble

from drkid.congruence.framework import BETA, Framework, framework_of
from drkid.congruence.target import smoothness

LENGTHS = np.array([0.9, 1.1])


@pytest.fixture
def frame():
    mesh = pebble()
    return Framework(mesh, np.random.default_rng(0).integers(2, size=len(mesh.edges)), LENGTHS)


def test_wanted_and_residual_are_the_palettes_lengths_and_what_is_amiss(frame):
    for edge, label in enumerate(frame.labels):
        assert frame.wanted[edge] == LENGTHS[label]
    np.testing.assert_allclose(frame.residual + frame.wanted, frame.mesh.edge_lengths)


def test_worst_is_the_largest_error_of_the_mean_wanted_length(frame):
    mesh = frame.mesh
    exact = Framework(mesh, np.arange(len(mesh.edges)), mesh.edge_lengths.copy())
    assert exact.worst == 0
    amiss = mesh.edge_lengths.copy()
    amiss[[3, 8]] += [-0.02, 0.01]
    assert Framework(mesh, exact.labels, amiss).worst == pytest.approx(0.02 / amiss.mean())


@pytest.mark.parametrize("factor", [0.01, 30.0])
def test_worst_does_not_depend_on_the_unit(frame, factor):
    assert frame.moved(factor * frame.mesh.vertices, factor * frame.lengths).worst == pytest.approx(frame.worst)


def test_stiffness_is_the_smoothness_of_the_mesh(frame):
    np.testing.assert_array_equal(frame.stiffness, smoothness(frame.mesh, BETA))


CONNECTIVITY_ONLY = ("edges", "face_edges", "edge_faces", "valence", "half_edges")


def test_moved_keeps_what_depends_on_the_connectivity_alone(frame):
    before = {name: getattr(frame.mesh, name) for name in CONNECTIVITY_ONLY}
    stiffness = frame.stiffness
    moved = frame.moved(2 * frame.mesh.vertices, LENGTHS)
    assert all(getattr(moved.mesh, name) is before[name] for name in CONNECTIVITY_ONLY)
    assert moved.stiffness is stiffness
    assert moved.labels is frame.labels


def test_moved_works_out_anew_what_depends_on_the_positions(frame):
    was = frame.residual, frame.mesh.edge_lengths, frame.mesh.corners, frame.mesh.areas, frame.mesh.vertex_normals
    assert all(len(array) for array in was)  # worked out and kept
    vertices = frame.mesh.vertices * [1.0, 1.2, 0.7]
    moved, fresh = frame.moved(vertices, 1.1 * LENGTHS), frame.mesh.moved(vertices)
    np.testing.assert_array_equal(moved.lengths, 1.1 * LENGTHS)
    for name in ("edge_lengths", "corners", "areas", "vertex_normals", "volume", "extents"):
        np.testing.assert_array_equal(getattr(moved.mesh, name), getattr(fresh, name))
    np.testing.assert_allclose(moved.residual, fresh.edge_lengths - 1.1 * LENGTHS[frame.labels])


def test_moved_works_out_what_was_not_worked_out_before():
    mesh = pebble()
    lazy = Framework(mesh, np.zeros(len(mesh.edges), np.int64), LENGTHS).moved(mesh.vertices, LENGTHS)
    np.testing.assert_array_equal(lazy.mesh.edges, pebble().edges)
    assert lazy.stiffness.shape == (42, 42)


@given(st.integers(0, 2**32 - 1))
def test_labels_follow_their_edges_however_those_stand(seed):
    mesh, rng = pebble(), np.random.default_rng(seed)
    labels = rng.integers(2, size=len(mesh.edges))
    order = rng.permutation(len(labels))
    edges = mesh.edges[order]
    turned = rng.random(len(edges)) < 0.5
    edges[turned] = edges[turned][:, ::-1]
    found = framework_of(mesh.vertices, mesh.faces, edges, labels[order], LENGTHS)
    np.testing.assert_array_equal(found.labels, labels)
    np.testing.assert_array_equal(found.mesh.faces, mesh.faces)
    by_ends = {frozenset(ends): label for ends, label in zip(edges.tolist(), labels[order], strict=True)}
    assert all(
        by_ends[frozenset(ends)] == label for ends, label in zip(found.mesh.edges.tolist(), found.labels, strict=True)
    )
