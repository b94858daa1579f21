import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drkid.congruence.framework import Framework
from drkid.congruence.penalty import NEAR, SHARE_OF_SQUARES, Penalty, largest_error, within_tolerance
from drkid.congruence.sparse_solve import sparse_exact, sparse_smoothness, sparse_solve
from drkid.congruence.target import Target

WEIGHT, BETA = 0.03, 3.0


@pytest.fixture(scope="module")
def target(potato) -> Target:
    return Target(potato.scaled(1 / potato.mean_edge))


@pytest.fixture(scope="module")
def frame(target) -> Framework:
    """The potato in units of its mean edge, labelled by the nearer of two lengths, as near as squares bring it."""
    lengths = np.array([0.92, 1.08])
    labels = np.abs(target.mesh.edge_lengths[:, None] - lengths).argmin(axis=1)
    return sparse_solve(Framework(target.mesh, labels, lengths), target, WEIGHT, "all", 12, beta=BETA)[0]


def face_errors(frame: Framework) -> np.ndarray:
    return np.linalg.norm(frame.residual[frame.mesh.face_edges], axis=1)


def stretched(frame: Framework, added: np.ndarray) -> Framework:
    """A framework whose residuals are larger by `added`: a length of its own for each edge, shortened by it."""
    return Framework(frame.mesh, np.arange(len(added)), frame.wanted - added)


@given(power=st.integers(2, 8), size=st.floats(0.3, 3.0), seed=st.integers(0, 100))
def test_the_slope_is_half_the_derivative_of_the_value(frame, power, size, seed):
    """Along a random direction, by central differences."""
    penalty = Penalty(size * float(face_errors(frame).max()), power)
    along = np.random.default_rng(seed).normal(size=len(frame.labels))
    step = 1e-5 * float(face_errors(frame).mean())
    more, less = stretched(frame, step * along), stretched(frame, -step * along)
    force, response = penalty.slope(frame)
    assert 2 * force @ along == pytest.approx((penalty.value(more) - penalty.value(less)) / (2 * step), rel=1e-4)
    bent = (penalty.slope(more)[0] - penalty.slope(less)[0]) / (2 * step)
    scale = np.abs(response @ along).max()
    np.testing.assert_allclose(response @ along, bent, atol=1e-4 * scale)


@given(power=st.integers(2, 8))
def test_the_half_hessian_is_symmetric_and_convex(frame, power):
    _, response = Penalty(0.5 * float(face_errors(frame).max()), power).slope(frame)
    dense = response.toarray()
    np.testing.assert_allclose(dense, dense.T, atol=1e-12 * np.abs(dense).max())
    assert np.linalg.eigvalsh(dense).min() >= SHARE_OF_SQUARES * 0.99


def test_a_face_at_the_tolerance_costs_its_square_and_one_beyond_costs_far_more(frame):
    """The residuals of one face alone, scaled to the tolerance and to twice it."""
    inside = np.isin(np.arange(len(frame.labels)), frame.mesh.face_edges[0])
    neighbours = 3  # faces that share one of its edges: they see one residual each
    error = 0.01
    values = []
    for times in (1.0, 2.0):
        residual = np.where(inside, times * error / np.sqrt(3), 0.0)
        one = stretched(frame, residual - frame.residual)
        values.append(Penalty(error, 8).value(one) / error**2)
    third = SHARE_OF_SQUARES / 3 + 3.0**-8
    assert values[0] == pytest.approx(SHARE_OF_SQUARES + 1 + neighbours * third, rel=1e-9)
    assert values[1] > 4**7 * values[0]


@pytest.fixture(scope="module")
def stuck(frame, target) -> Framework:
    """Labels so bad that no positions are exact."""
    labels = np.random.default_rng(0).integers(0, 2, len(frame.labels))
    labels = np.where(np.random.default_rng(1).random(len(labels)) < 0.25, labels, frame.labels)
    begun = Framework(frame.mesh, labels, np.array([0.92, 1.08]))
    found = sparse_solve(begun, target, WEIGHT, "scale", 12, beta=BETA)[0]
    assert sparse_exact(found, "scale").worst > 1e-3
    return found


def test_the_largest_error_falls_to_about_the_tolerance_and_never_far_below(stuck, target):
    largest = float(face_errors(stuck).max())
    for share in (0.4, 0.6):
        tolerance = share * largest
        found = within_tolerance(stuck, target, WEIGHT, "scale", tolerance / float(stuck.wanted.mean()), beta=BETA)
        assert 0.8 * tolerance < largest_error(found) <= NEAR * tolerance
        assert largest_error(found) == pytest.approx(face_errors(found).max())
        np.testing.assert_array_equal(found.labels, stuck.labels)


def test_the_palette_is_held_where_it_is_not_free(stuck, target):
    found = within_tolerance(stuck, target, WEIGHT, "none", 0.02, beta=BETA)
    np.testing.assert_array_equal(found.lengths, stuck.lengths)


def test_more_tolerance_leaves_a_closer_and_smoother_mesh(stuck, target):
    """The whole merit without the errors: w² oᵀ K o with the β of the solve."""

    def roughness(tolerance: float) -> float:
        found = within_tolerance(stuck, target, WEIGHT, "scale", tolerance, beta=BETA)
        offset, _ = target.offsets(found.mesh.vertices)
        return float(offset @ (sparse_smoothness(found.mesh, BETA) @ offset))

    assert roughness(0.06) < roughness(0.03)
