from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np
import pytest
from exact_shapes import tetrahedron
from quadratic_problem import pebble, small_ring

from drkid.congruence import newton
from drkid.congruence.framework import Framework
from drkid.congruence.levenberg_marquardt import changed_lengths, palette_columns
from drkid.congruence.newton import LONGEST_STEP, PALETTE_SHARE, _step
from drkid.congruence.rigidity import rigidity_matrix
from drkid.mesh import TriMesh

FREEDOMS = ("all", "scale", "none")


def own_lengths(mesh):
    """A framework whose palette is the mesh's own lengths: exact as it stands."""
    return Framework(mesh, np.arange(len(mesh.edges)), mesh.edge_lengths.copy())


def shaken(frame, amount, seed=0):
    noise = amount * np.random.default_rng(seed).normal(size=frame.mesh.vertices.shape)
    return frame.moved(frame.mesh.vertices + noise, frame.lengths)


def spokes(length):
    """A tetrahedron that wants a base of side 1 and three spokes: possible from 1 / √3 upwards only."""
    base = np.array([[0, 0, 0], [1, 0, 0], [0.5, np.sqrt(0.75), 0], [0.5, 0.28, 0.3]])
    mesh = TriMesh(base, tetrahedron().faces)
    return Framework(mesh, (mesh.edges[:, 1] == 3).astype(np.int64), np.array([1.0, length]))


@pytest.mark.parametrize("freedom", FREEDOMS)
@pytest.mark.parametrize("seed", [0, 2, 4])
def test_errors_square_from_step_to_step(freedom, seed, monkeypatch):
    monkeypatch.setattr(newton, "ITERATIONS", 1)
    frame = shaken(own_lengths(pebble(seed)), 0.003, seed)
    errors = [frame.worst]
    for _ in range(5):
        frame = newton.exact(frame, freedom)
        errors.append(frame.worst)
    assert errors[0] > 5e-3
    assert errors[-1] < 1e-14
    assert all(after < 5 * before**2 + 1e-14 for before, after in pairwise(errors))


@pytest.mark.parametrize("freedom", FREEDOMS)
def test_the_solution_is_exact_and_nearby(freedom):
    start = shaken(own_lengths(pebble()), 0.01)
    found = newton.exact(start, freedom)
    assert found.worst < 1e-12
    assert np.abs(found.mesh.edge_lengths - found.wanted).max() < 1e-12
    assert np.abs(found.mesh.vertices - start.mesh.vertices).max() < 0.15
    np.testing.assert_array_equal(found.labels, start.labels)


def test_freedom_tells_what_of_the_palette_may_change():
    start = shaken(own_lengths(pebble()), 0.01)
    none, scale, free = (newton.exact(start, freedom).lengths / start.lengths for freedom in ("none", "scale", "all"))
    np.testing.assert_array_equal(none, 1)
    assert np.ptp(scale) < 1e-12
    assert abs(scale[0] - 1) > 1e-6
    assert np.ptp(free) > 1e-4


def test_the_first_step_is_the_smallest_that_solves_the_linear_equations(monkeypatch):
    monkeypatch.setattr(newton, "ITERATIONS", 1)
    start = shaken(own_lengths(pebble()), 0.001)
    shift = newton.exact(start, "none").mesh.vertices - start.mesh.vertices
    jacobian = rigidity_matrix(start.mesh.vertices, start.mesh.edges)
    expected = np.linalg.lstsq(jacobian, -start.residual, rcond=1e-10)[0]
    np.testing.assert_allclose(shift.ravel(), expected, atol=1e-7 * np.abs(expected).max())


def test_an_exact_mesh_stays_where_it_is():
    start = own_lengths(pebble())
    assert newton.exact(start, "none") is start


def test_few_lengths_of_a_square_system_are_met_exactly():
    """Two lengths given at random near the mean: as many equations as freedoms."""
    mesh = pebble(roughness=0.0)
    labels = (mesh.edge_lengths > np.median(mesh.edge_lengths)).astype(np.int64)
    halves = [mesh.edge_lengths[labels == i].mean() for i in (0, 1)]
    near = Framework(mesh, np.arange(len(labels)), 0.98 * mesh.edge_lengths + 0.02 * np.array(halves)[labels])
    found = newton.exact(near, "none")
    assert near.worst > 1e-3
    assert found.worst < 1e-12


@pytest.mark.parametrize("freedom", FREEDOMS)
@pytest.mark.parametrize("lengths", [(1.0, 50.0), (1.0, 0.01), (3.0, 4.0), (1.0, 1.0)])
def test_no_coordinate_moves_more_than_half_a_mean_length_in_a_step(freedom, lengths):
    mesh = pebble()
    start = Framework(mesh, (np.arange(len(mesh.edges)) % 7 == 0).astype(np.int64), np.array(lengths))
    shift = np.abs(_step(start, freedom).mesh.vertices - mesh.vertices).max()
    assert 0 < shift <= LONGEST_STEP * start.wanted.mean() * (1 + 1e-12)


def test_a_step_that_is_too_long_is_cut_to_the_limit_and_not_turned():
    mesh = pebble()
    whole = Framework(mesh, np.arange(len(mesh.edges)), 1.1 * mesh.edge_lengths)
    far = Framework(mesh, whole.labels, 40 * mesh.edge_lengths)
    one, other = (_step(frame, "none").mesh.vertices - mesh.vertices for frame in (whole, far))
    assert np.abs(one).max() < LONGEST_STEP * whole.wanted.mean()
    assert np.abs(other).max() == pytest.approx(LONGEST_STEP * far.wanted.mean())
    np.testing.assert_allclose(other / np.abs(other).max(), one / np.abs(one).max(), atol=1e-6)


def test_a_mesh_with_coinciding_vertices_is_refused():
    start = spokes(1.0)
    vertices = start.mesh.vertices.copy()
    vertices[3] = vertices[0]
    with pytest.raises(np.linalg.LinAlgError):
        newton.exact(start.moved(vertices, start.lengths), "none")


@pytest.mark.parametrize("length", [0.6, 0.8, 1.0, 3.0])
def test_spokes_that_reach_are_met(length):
    assert newton.exact(spokes(length), "none").worst < 1e-11


@pytest.mark.parametrize("length", [0.57, 0.5, 0.3])
def test_it_stalls_at_a_fold_and_returns_the_best_on_the_way(length):
    """Spokes shorter than the circumradius: no tetrahedron has these lengths."""
    start = spokes(length)
    found = newton.exact(start, "none")
    least = (1 / np.sqrt(3) - length) / (1 + length) / 2  # each face lacks so much, shared by base and spokes
    assert least < found.worst < start.worst


def test_more_equations_than_freedoms_end_without_a_solution():
    ring = small_ring()
    noise = 1 + 0.02 * np.random.default_rng(0).normal(size=len(ring.edges))
    start = Framework(ring, np.arange(len(ring.edges)), ring.edge_lengths * noise)
    found = newton.exact(start, "none")
    assert 1e-6 < found.worst <= start.worst


def test_a_palette_that_is_free_lets_even_those_be_met():
    ring = small_ring()
    noise = 1 + 0.02 * np.random.default_rng(0).normal(size=len(ring.edges))
    assert newton.exact(Framework(ring, np.arange(len(ring.edges)), ring.edge_lengths * noise), "all").worst < 1e-12


@pytest.mark.parametrize("freedom", FREEDOMS)
def test_the_solution_turns_and_scales_with_the_start(freedom):
    start = shaken(own_lengths(pebble()), 0.01)
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    turned = start.moved(start.mesh.vertices @ turn + 5, start.lengths)
    found, again = newton.exact(start, freedom), newton.exact(turned, freedom)
    np.testing.assert_allclose(again.mesh.vertices, found.mesh.vertices @ turn + 5, atol=1e-9)


@pytest.mark.parametrize("freedom", FREEDOMS)
@pytest.mark.parametrize("make", [pebble, small_ring])
def test_a_step_is_that_of_plain_dense_algebra(make, freedom):
    """(J Jᵀ + s P Pᵀ + ε I) t = residual; the vertices go along −Jᵀ t, the palette's unknowns along s Pᵀ t."""
    mesh = make()
    start = shaken(Framework(mesh, np.arange(len(mesh.edges)) % 5, mesh.edge_lengths[:5].copy()), 0.02)
    jacobian = rigidity_matrix(start.mesh.vertices, start.mesh.edges)
    columns = palette_columns(start, freedom)
    normal = jacobian @ jacobian.T + PALETTE_SHARE * columns @ columns.T
    tension = np.linalg.solve(normal + 1e-9 * np.eye(len(normal)), start.residual)
    shift = -(jacobian.T @ tension).reshape(-1, 3)
    share = min(1.0, LONGEST_STEP * start.wanted.mean() / np.abs(shift).max())
    found = _step(start, freedom)
    assert start.worst > 1e-3
    np.testing.assert_allclose(found.mesh.vertices - start.mesh.vertices, share * shift, atol=1e-6)
    lengths = changed_lengths(start, freedom, share * PALETTE_SHARE * columns.T @ tension)
    np.testing.assert_allclose(found.lengths, lengths, atol=1e-6)


def test_threads_find_the_same():
    starts = [shaken(own_lengths(pebble()), 0.01, seed) for seed in range(8)]
    with ThreadPoolExecutor(4) as pool:
        for start, found in zip(starts, pool.map(newton.exact, starts), strict=True):
            expected = newton.exact(start)
            np.testing.assert_array_equal(found.mesh.vertices, expected.mesh.vertices)
            np.testing.assert_array_equal(found.lengths, expected.lengths)
