from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np
import pytest
from labelled_shapes import PEBBLE_LENGTHS, ellipsoid, labelled_pebble
from plain_linearisation import plain_linearised
from quadratic_problem import pebble, small_ring

from drkid.congruence.framework import Framework
from drkid.congruence.levenberg_marquardt import (
    changed_lengths,
    first_damping,
    palette_basis,
    palette_columns,
    solve,
)
from drkid.congruence.rigidity import rigidity_matrix
from drkid.congruence.target import Target

FREEDOMS = ("all", "scale", "none")


@pytest.fixture(scope="module")
def frame():
    return labelled_pebble()


@pytest.fixture(scope="module")
def target():
    return ellipsoid()


@pytest.mark.parametrize("freedom", FREEDOMS)
def test_palette_columns_are_the_derivative_of_the_wanted_lengths(frame, freedom):
    columns = palette_columns(frame, freedom)
    assert columns.shape == (len(frame.labels), {"all": 2, "scale": 1, "none": 0}[freedom])
    step = np.random.default_rng(2).normal(size=columns.shape[1]) / 10
    lengths = changed_lengths(frame, freedom, step)
    np.testing.assert_allclose(lengths[frame.labels], frame.wanted + columns @ step, rtol=1e-13)
    if freedom == "scale":
        assert lengths[1] / lengths[0] == pytest.approx(PEBBLE_LENGTHS[1] / PEBBLE_LENGTHS[0])


@pytest.mark.parametrize("freedom", FREEDOMS)
def test_palette_basis_is_the_derivative_of_the_lengths(frame, freedom):
    basis = palette_basis(frame.lengths, freedom)
    step = np.random.default_rng(3).normal(size=len(basis)) / 10
    np.testing.assert_allclose(changed_lengths(frame, freedom, step), frame.lengths + step @ basis, rtol=1e-13)


@pytest.mark.parametrize("freedom", FREEDOMS)
def test_the_first_step_minimises_the_linear_problem(frame, target, freedom):
    """Against one dense least-squares problem in the vertices and the palette's unknowns together."""
    weight = 0.4
    damping = first_damping(weight)
    plain = plain_linearised(frame, target, weight)
    jacobian, columns = rigidity_matrix(frame.mesh.vertices, frame.mesh.edges), palette_columns(frame, freedom)
    root = weight * np.linalg.cholesky(frame.stiffness).T
    size, unknowns = jacobian.shape[1], columns.shape[1]
    system = np.vstack(
        [
            np.hstack([jacobian, -columns]),
            np.hstack([root @ plain.across, np.zeros((len(plain.offset), unknowns))]),
            np.hstack([np.sqrt(damping) * np.eye(size), np.zeros((size, unknowns))]),
        ]
    )
    known = -np.concatenate([frame.residual, root @ plain.offset, np.zeros(size)])
    step = np.linalg.lstsq(system, known)[0]
    found, value = solve(frame, target, weight, freedom, iterations=1)
    assert value < plain.merit  # the first trial was taken
    np.testing.assert_allclose((found.mesh.vertices - frame.mesh.vertices).ravel(), step[:size], atol=1e-5)
    np.testing.assert_allclose(found.lengths, changed_lengths(frame, freedom, step[size:]), atol=1e-6)


@pytest.mark.parametrize("freedom", FREEDOMS)
@pytest.mark.parametrize("weight", [1.0, 0.3, 0.03])
def test_the_merit_never_rises(frame, target, freedom, weight):
    values = [plain_linearised(frame, target, weight).merit]
    at = frame
    for _ in range(8):
        at, value = solve(at, target, weight, freedom, iterations=1)
        assert value == pytest.approx(plain_linearised(at, target, weight).merit)
        values.append(value)
    assert all(after <= before for before, after in pairwise(values))
    assert values[-1] < 0.9 * values[0]


@pytest.mark.parametrize("seed", range(4))
def test_wild_starts_do_not_raise_it_either(frame, target, seed):
    """Far from the solution full steps overshoot, and damping has to grow."""
    noise = 0.8 * np.random.default_rng(seed).normal(size=frame.mesh.vertices.shape)
    start = frame.moved(frame.mesh.vertices + noise, PEBBLE_LENGTHS)
    found, value = solve(start, target, 0.1, "all")
    assert value < plain_linearised(start, target, 0.1).merit
    assert np.isfinite(found.mesh.vertices).all()


@pytest.mark.parametrize("freedom", FREEDOMS)
def test_it_finds_the_solution_that_is_known(freedom):
    """A mesh that lies on the target with its own lengths, shaken: the merit falls to nothing at the mesh itself."""
    mesh = pebble()
    start = Framework(mesh, np.arange(len(mesh.edges)), mesh.edge_lengths.copy())
    noise = 0.03 * np.random.default_rng(0).normal(size=mesh.vertices.shape)
    found, value = solve(start.moved(mesh.vertices + noise, start.lengths), Target(mesh), 0.3, freedom, 60)
    assert value < 1e-9
    assert found.worst < 1e-4


@pytest.mark.parametrize("freedom", ["scale", "all"])
def test_a_wrong_scale_of_the_palette_is_mended_where_it_is_free(freedom):
    mesh = pebble()
    wrong = Framework(mesh, np.arange(len(mesh.edges)), 1.05 * mesh.edge_lengths)
    found, _ = solve(wrong, Target(mesh), 1.0, freedom, 10)
    np.testing.assert_allclose(found.lengths, mesh.edge_lengths, rtol=1e-3)
    held, value = solve(wrong, Target(mesh), 1.0, "none", 10)
    np.testing.assert_array_equal(held.lengths, wrong.lengths)
    assert value > 1e-3


def test_a_solution_is_left_where_it_is():
    ring = small_ring()
    at = Framework(ring, np.arange(len(ring.edges)), ring.edge_lengths.copy())
    found, value = solve(at, Target(ring), 1.0, "none")
    np.testing.assert_allclose(found.mesh.vertices, ring.vertices, atol=1e-9)
    assert value < 1e-20


def test_a_mesh_with_an_edge_without_length_is_refused(frame, target):
    vertices = frame.mesh.vertices.copy()
    vertices[frame.mesh.edges[5, 1]] = vertices[frame.mesh.edges[5, 0]]
    with pytest.raises(np.linalg.LinAlgError, match="no length"):
        solve(frame.moved(vertices, PEBBLE_LENGTHS), target, 0.3)


@pytest.mark.parametrize("weight", [0.0, 0.3])
def test_a_start_that_is_not_finite_is_refused(frame, target, weight):
    vertices = frame.mesh.vertices.copy()
    vertices[3] = np.nan
    with pytest.raises(np.linalg.LinAlgError, match="not finite"):
        solve(frame.moved(vertices, PEBBLE_LENGTHS), target, weight)


@pytest.mark.parametrize("freedom", FREEDOMS)
def test_the_start_is_left_as_it_was(frame, target, freedom):
    vertices, lengths = frame.mesh.vertices.copy(), frame.lengths.copy()
    found, _ = solve(frame, target, 0.3, freedom)
    np.testing.assert_array_equal(frame.mesh.vertices, vertices)
    np.testing.assert_array_equal(frame.lengths, lengths)
    assert not np.shares_memory(found.lengths, frame.lengths)


def test_threads_find_the_same(frame, target):
    def solved(seed):
        noise = 0.1 * np.random.default_rng(seed).normal(size=frame.mesh.vertices.shape)
        return solve(frame.moved(frame.mesh.vertices + noise, PEBBLE_LENGTHS), target, 0.2, "all")

    with ThreadPoolExecutor(4) as pool:
        for seed, (found, value) in enumerate(pool.map(solved, range(12))):
            expected, other = solved(seed)
            np.testing.assert_array_equal(found.mesh.vertices, expected.mesh.vertices)
            np.testing.assert_array_equal(found.lengths, expected.lengths)
            assert value == other
