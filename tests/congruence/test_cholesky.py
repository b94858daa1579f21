from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drkid.congruence.cholesky import cholesky_solve

SEEDS = st.integers(0, 2**32 - 1)


def definite(size, rng, condition=1e3):
    """A symmetric positive definite matrix of this condition."""
    turn = np.linalg.qr(rng.normal(size=(size, size)))[0]
    matrix = turn * np.geomspace(1, condition, size) @ turn.T
    return (matrix + matrix.T) / 2


@given(size=st.integers(1, 40), rows=st.integers(1, 5), seed=SEEDS)
def test_every_row_is_solved_as_numpy_solves_it(size, rows, seed):
    rng = np.random.default_rng(seed)
    matrix, columns = definite(size, rng), rng.normal(size=(rows, size))
    found = columns.copy()
    cholesky_solve(matrix, found)
    expected = np.linalg.solve(matrix, columns.T).T
    np.testing.assert_allclose(found, expected, atol=1e-11 * np.abs(expected).max())


def test_an_ill_conditioned_system_leaves_a_small_residual():
    rng = np.random.default_rng(0)
    matrix, columns = definite(60, rng, 1e12), rng.normal(size=(3, 60))
    found = columns.copy()
    cholesky_solve(matrix, found)
    size = np.linalg.norm(matrix, 2) * np.linalg.norm(found, axis=1)
    assert (np.linalg.norm(found @ matrix - columns, axis=1) < 1e-14 * size).all()


def test_the_matrix_is_left_as_it_was_and_its_upper_half_is_not_looked_at():
    rng = np.random.default_rng(1)
    matrix, columns = definite(9, rng), rng.normal(size=(2, 9))
    kept, found, other = matrix.copy(), columns.copy(), columns.copy()
    cholesky_solve(matrix, found)
    np.testing.assert_array_equal(matrix, kept)
    matrix[np.triu_indices(9, 1)] = 7.0
    cholesky_solve(matrix, other)
    np.testing.assert_array_equal(other, found)


@pytest.mark.parametrize("shape", [(0, 0), (1, 0), (3, 0)])
def test_a_system_without_unknowns_is_solved(shape):
    columns = np.zeros(shape)
    cholesky_solve(np.zeros((0, 0)), columns)
    assert columns.shape == shape


def test_no_right_hand_side_is_no_work():
    columns = np.zeros((0, 4))
    cholesky_solve(np.eye(4), columns)
    assert columns.shape == (0, 4)


@pytest.mark.parametrize(
    "matrix",
    [np.zeros((2, 2)), np.diag([1.0, -1.0]), np.array([[1.0, 2.0], [2.0, 1.0]])],
    ids=["zero", "negative", "indefinite"],
)
def test_a_matrix_that_is_not_positive_definite_is_told(matrix):
    with pytest.raises(np.linalg.LinAlgError):
        cholesky_solve(matrix, np.ones((1, 2)))


def test_what_is_no_number_is_not_answered_with_one():
    matrix = np.eye(5)
    matrix[3, 1] = matrix[1, 3] = np.nan
    found = np.ones((2, 5))
    cholesky_solve(matrix, found)
    assert np.isnan(found[:, 1:4]).any(axis=1).all()


def test_threads_find_the_same():
    rng = np.random.default_rng(2)
    systems = [(definite(80, rng), rng.normal(size=(3, 80))) for _ in range(12)]

    def solved(system):
        matrix, columns = system
        found = columns.copy()
        cholesky_solve(matrix, found)
        return found

    with ThreadPoolExecutor(4) as pool:
        for system, found in zip(systems, pool.map(solved, systems), strict=True):
            np.testing.assert_array_equal(found, solved(system))
