from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from labelled_shapes import PEBBLE_LENGTHS, ellipsoid, labelled_pebble
from plain_linearisation import plain_linearised, plain_merit, plain_offsets
from quadratic_problem import pebble, rows, small_ring

from drkid.congruence.framework import Framework
from drkid.congruence.levenberg_marquardt import springs_of
from drkid.congruence.linearisation import add_transposed, directions, slope_at, tried_at
from drkid.congruence.rigidity import edge_vectors, rigidity_matrix
from drkid.congruence.target import Target

WEIGHTS = (0.0, 0.03, 0.7)


@pytest.fixture(scope="module")
def frame():
    return labelled_pebble()


@pytest.fixture(scope="module")
def target():
    return ellipsoid()


def evaluated(frame, target, weight):
    """The compiled merit and slope at a framework."""
    springs, slots = springs_of(frame, target, weight, "none"), np.zeros(len(frame.mesh.vertices), np.int64)
    trial = tried_at(np.array(frame.mesh.vertices), frame.lengths.copy(), springs, slots)
    return trial, slope_at(trial, springs)


def central(function, frame, way, step):
    """The derivative of a function of frameworks along a way of the vertices, by central differences."""
    ahead, behind = (function(frame.moved(frame.mesh.vertices + s * way, PEBBLE_LENGTHS)) for s in (step, -step))
    return (ahead - behind) / (2 * step)


def shaken(frame, amount, seed):
    noise = amount * np.random.default_rng(seed).normal(size=frame.mesh.vertices.shape)
    return frame.moved(frame.mesh.vertices + noise, frame.lengths)


@pytest.mark.parametrize("weight", WEIGHTS)
@given(amount=st.sampled_from([0.0, 0.05, 0.5]), seed=st.integers(0, 2**32 - 1))
def test_everything_is_what_the_plain_evaluation_finds(frame, target, weight, amount, seed):
    at = shaken(frame, amount, seed)
    trial, slope = evaluated(at, target, weight)
    plain = plain_linearised(at, target, weight)
    assert trial.merit == pytest.approx(plain.merit, rel=1e-12)
    np.testing.assert_allclose(trial.residual, at.residual, atol=1e-13)
    np.testing.assert_allclose(trial.offset, plain.offset, atol=1e-12)
    np.testing.assert_allclose(slope.gradient, plain.gradient, atol=1e-10)
    np.testing.assert_allclose(slope.hessian, plain.hessian, atol=1e-10)
    np.testing.assert_allclose(slope.direction, edge_vectors(at.mesh.vertices, at.mesh.edges)[0], atol=1e-14)


def test_handles_make_no_difference():
    ring = small_ring()
    frame = Framework(ring, np.arange(len(ring.edges)) % 2, PEBBLE_LENGTHS)
    at, target = shaken(frame, 0.1, 0), Target(ring)
    trial, slope = evaluated(at, target, 0.5)
    plain = plain_linearised(at, target, 0.5)
    assert trial.merit == pytest.approx(plain.merit, rel=1e-12)
    np.testing.assert_allclose(slope.gradient, plain.gradient, atol=1e-10)
    np.testing.assert_allclose(slope.hessian, plain.hessian, atol=1e-10)


def test_merit_is_the_sum_that_the_module_states(frame, target):
    lengths = sum(
        (len_ - PEBBLE_LENGTHS[i]) ** 2 for len_, i in zip(frame.mesh.edge_lengths, frame.labels, strict=True)
    )
    offset, _ = plain_offsets(target, frame.mesh.vertices)
    assert evaluated(frame, target, 0.0)[0].merit == pytest.approx(lengths)
    assert evaluated(frame, target, 0.3)[0].merit == pytest.approx(lengths + 0.09 * offset @ frame.stiffness @ offset)


def test_a_trial_keeps_where_it_was_made(frame, target):
    springs, slots = springs_of(frame, target, 0.3, "none"), np.zeros(len(frame.mesh.vertices), np.int64)
    vertices, lengths = 1.1 * frame.mesh.vertices, 1.2 * PEBBLE_LENGTHS
    trial = tried_at(vertices, lengths, springs, slots)
    np.testing.assert_array_equal(trial.vertices, vertices)
    np.testing.assert_array_equal(trial.lengths, lengths)
    np.testing.assert_allclose(trial.residual, 1.1 * frame.mesh.edge_lengths - lengths[frame.labels], atol=1e-13)


def test_length_hessian_is_the_product_of_the_rigidity_matrix_with_itself(frame, target):
    jacobian, _ = rows(frame.mesh.vertices, frame.mesh.edges)
    np.testing.assert_allclose(evaluated(frame, target, 0.0)[1].hessian, jacobian.T @ jacobian, atol=1e-13)


def test_offset_hessian_is_the_stiffness_between_the_normals(frame, target):
    _, normals = plain_offsets(target, frame.mesh.vertices)
    with_shape, without = (evaluated(frame, target, weight)[1].hessian for weight in (2.0, 0.0))
    blocks = (with_shape - without).reshape(len(normals), 3, len(normals), 3)
    expected = 4 * np.einsum("ij,ir,js->irjs", frame.stiffness, normals, normals)
    np.testing.assert_allclose(blocks, expected, atol=1e-11)


@pytest.mark.parametrize("factor", [1.0, -0.4])
def test_transposed_is_added_to_what_is_there(frame, factor):
    rng = np.random.default_rng(0)
    vertices, edges = np.array(frame.mesh.vertices), np.array(frame.mesh.edges)
    force, begun = rng.normal(size=len(edges)), rng.normal(size=vertices.size)
    found = begun.copy()
    add_transposed(directions(vertices, edges), edges, force, factor, found)
    np.testing.assert_allclose(found, begun + factor * rigidity_matrix(vertices, edges).T @ force, atol=1e-13)


@pytest.mark.parametrize("seed", range(3))
def test_gradient_of_the_lengths_is_exact(frame, target, seed):
    way = np.random.default_rng(seed).normal(size=frame.mesh.vertices.shape)
    found = 2 * evaluated(frame, target, 0.0)[1].gradient @ way.ravel()
    numeric = central(lambda f: float(f.residual @ f.residual), frame, way, 1e-5)
    assert found == pytest.approx(numeric, rel=1e-7, abs=1e-8)


@pytest.mark.parametrize("seed", range(3))
def test_gradient_of_the_offsets_is_exact_while_the_normals_are_held(frame, target, seed):
    way = np.random.default_rng(seed).normal(size=frame.mesh.vertices.shape)
    offset, normals = plain_offsets(target, frame.mesh.vertices)
    weight = 0.7

    def held(moved):
        change = np.einsum("ij,ij->i", normals, moved.mesh.vertices - frame.mesh.vertices)
        return plain_merit(moved, offset + change, weight)

    found = 2 * evaluated(frame, target, weight)[1].gradient @ way.ravel()
    assert found == pytest.approx(central(held, frame, way, 1e-5), rel=1e-7, abs=1e-8)


@pytest.mark.parametrize("seed", range(3))
def test_gradient_is_that_of_the_true_merit_up_to_the_facets_of_the_target(frame, target, seed):
    way = np.random.default_rng(seed).normal(size=frame.mesh.vertices.shape)
    gradient = evaluated(frame, target, 1.0)[1].gradient
    numeric = central(lambda f: evaluated(f, target, 1.0)[0].merit, frame, way, 1e-4)
    size = 2 * np.linalg.norm(gradient) * np.linalg.norm(way)
    assert abs(2 * gradient @ way.ravel() - numeric) < 0.02 * size


@pytest.mark.parametrize("seed", range(3))
def test_hessian_is_the_slope_of_the_gradient_where_nothing_is_amiss(seed):
    """Gauss–Newton leaves out what the residuals carry: nothing, if the mesh has its lengths and no weight is on it."""
    mesh = pebble(seed)
    exact = Framework(mesh, np.arange(len(mesh.edges)), mesh.edge_lengths.copy())
    target, way = Target(mesh), np.random.default_rng(seed).normal(size=mesh.vertices.shape)
    ahead, behind = (
        evaluated(exact.moved(mesh.vertices + s * way, exact.lengths), target, 0.0)[1].gradient for s in (1e-5, -1e-5)
    )
    found = evaluated(exact, target, 0.0)[1].hessian @ way.ravel()
    np.testing.assert_allclose(found, (ahead - behind) / 2e-5, atol=1e-7)


def test_the_guesses_of_an_earlier_trial_do_not_matter(frame, target):
    springs, slots = springs_of(frame, target, 0.4, "none"), np.zeros(len(frame.mesh.vertices), np.int64)
    for seed in range(5):
        at = shaken(frame, 0.2, seed)
        trial = tried_at(np.array(at.mesh.vertices), PEBBLE_LENGTHS, springs, slots)
        assert trial.merit == pytest.approx(evaluated(at, target, 0.4)[0].merit, rel=1e-12)


@pytest.mark.parametrize("place", ["together", "nan"])
def test_an_edge_without_length_is_told(frame, target, place):
    vertices, edges = np.array(frame.mesh.vertices), np.array(frame.mesh.edges)
    vertices[edges[7, 0]] = vertices[edges[7, 1]] if place == "together" else np.nan
    with pytest.raises(np.linalg.LinAlgError, match="no length"):
        directions(vertices, edges)
    with pytest.raises(np.linalg.LinAlgError, match="no length"):
        evaluated(frame.moved(vertices, PEBBLE_LENGTHS), target, 0.3)


def test_threads_find_the_same(frame, target):
    frames = [shaken(frame, 0.1, seed) for seed in range(12)]
    with ThreadPoolExecutor(4) as pool:
        for at, (trial, slope) in zip(frames, pool.map(lambda f: evaluated(f, target, 0.3), frames), strict=True):
            expected, other = evaluated(at, target, 0.3)
            assert trial.merit == expected.merit
            np.testing.assert_array_equal(slope.gradient, other.gradient)
            np.testing.assert_array_equal(slope.hessian, other.hessian)
