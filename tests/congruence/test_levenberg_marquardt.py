from itertools import pairwise

import numpy as np
import pytest
import trimesh
from quadratic_problem import pebble, rows, small_ring

from drkid.congruence.framework import Framework
from drkid.congruence.levenberg_marquardt import (
    changed_lengths,
    length_hessian,
    linearised,
    merit,
    offset_hessian,
    palette_columns,
    solve,
    transposed,
)
from drkid.congruence.rigidity import edge_vectors, rigidity_matrix
from drkid.congruence.target import Target
from drkid.mesh import TriMesh

FREEDOMS = ("all", "scale", "none")
LENGTHS = np.array([0.95, 1.06])


@pytest.fixture(scope="module")
def frame():
    mesh = pebble()
    return Framework(mesh, np.random.default_rng(1).integers(2, size=len(mesh.edges)), LENGTHS)


@pytest.fixture(scope="module")
def target():
    """A smooth ellipsoid that the pebble was roughly made on."""
    sphere = trimesh.creation.icosphere(subdivisions=4)
    size = pebble().extents / 2 / [1.3, 1.0, 0.9]
    return Target(TriMesh(sphere.vertices * [1.3, 1.0, 0.9] * size.mean(), sphere.faces))


def across(normals):
    """N (V, 3V)."""
    matrix = np.zeros((len(normals), len(normals), 3))
    matrix[np.arange(len(normals)), np.arange(len(normals))] = normals
    return matrix.reshape(len(normals), -1)


@pytest.mark.parametrize("columns", [None, 0, 1, 4])
def test_transposed_is_the_product_with_the_transpose(frame, columns):
    shape = (len(frame.labels),) if columns is None else (len(frame.labels), columns)
    values = np.random.default_rng(0).normal(size=shape)
    direction, _ = edge_vectors(frame.mesh.vertices, frame.mesh.edges)
    expected = rigidity_matrix(frame.mesh.vertices, frame.mesh.edges).T @ values
    found = transposed(direction, frame, values)
    assert found.shape == expected.shape
    np.testing.assert_allclose(found, expected, atol=1e-13)


def test_length_hessian_is_the_product_of_the_rigidity_matrix_with_itself(frame):
    direction, _ = edge_vectors(frame.mesh.vertices, frame.mesh.edges)
    jacobian, _ = rows(frame.mesh.vertices, frame.mesh.edges)
    np.testing.assert_allclose(length_hessian(frame, direction), jacobian.T @ jacobian, atol=1e-13)


def test_offset_hessian_is_the_stiffness_between_the_normals(frame, target):
    _, normals = target.offsets(frame.mesh.vertices)
    expected = across(normals).T @ frame.stiffness @ across(normals)
    np.testing.assert_allclose(offset_hessian(frame, normals), expected, atol=1e-13)


@pytest.mark.parametrize("freedom", FREEDOMS)
def test_palette_columns_are_the_derivative_of_the_wanted_lengths(frame, freedom):
    columns = palette_columns(frame, freedom)
    assert columns.shape == (len(frame.labels), {"all": 2, "scale": 1, "none": 0}[freedom])
    step = np.random.default_rng(2).normal(size=columns.shape[1]) / 10
    lengths = changed_lengths(frame, freedom, step)
    np.testing.assert_allclose(lengths[frame.labels], frame.wanted + columns @ step, rtol=1e-13)
    if freedom == "scale":
        assert lengths[1] / lengths[0] == pytest.approx(LENGTHS[1] / LENGTHS[0])


def test_merit_is_the_sum_that_the_module_states(frame, target):
    offset, _ = target.offsets(frame.mesh.vertices)
    lengths = sum((len_ - LENGTHS[i]) ** 2 for len_, i in zip(frame.mesh.edge_lengths, frame.labels, strict=True))
    assert merit(frame, offset, 0.0) == pytest.approx(lengths)
    assert merit(frame, offset, 0.3) == pytest.approx(lengths + 0.09 * offset @ frame.stiffness @ offset)


def slope(function, frame, way, step):
    ahead, behind = (function(frame.moved(frame.mesh.vertices + s * way, LENGTHS)) for s in (step, -step))
    return (ahead - behind) / (2 * step)


@pytest.mark.parametrize("seed", range(3))
def test_gradient_of_the_lengths_is_exact(frame, target, seed):
    way = np.random.default_rng(seed).normal(size=frame.mesh.vertices.shape)
    found = 2 * linearised(frame, target, 0.0).gradient @ way.ravel()
    numeric = slope(lambda f: float(f.residual @ f.residual), frame, way, 1e-5)
    assert found == pytest.approx(numeric, rel=1e-7, abs=1e-8)


@pytest.mark.parametrize("seed", range(3))
def test_gradient_of_the_offsets_is_exact_while_the_normals_are_held(frame, target, seed):
    way = np.random.default_rng(seed).normal(size=frame.mesh.vertices.shape)
    offset, normals = target.offsets(frame.mesh.vertices)
    weight = 0.7

    def held(moved):
        change = np.einsum("ij,ij->i", normals, moved.mesh.vertices - frame.mesh.vertices)
        return merit(moved, offset + change, weight)

    found = 2 * linearised(frame, target, weight).gradient @ way.ravel()
    assert found == pytest.approx(slope(held, frame, way, 1e-5), rel=1e-7, abs=1e-8)


@pytest.mark.parametrize("seed", range(3))
def test_gradient_is_that_of_the_true_merit_up_to_the_facets_of_the_target(frame, target, seed):
    way = np.random.default_rng(seed).normal(size=frame.mesh.vertices.shape)
    at = linearised(frame, target, 1.0)
    numeric = slope(lambda f: merit(f, target.offsets(f.mesh.vertices)[0], 1.0), frame, way, 1e-4)
    size = 2 * np.linalg.norm(at.gradient) * np.linalg.norm(way)
    assert abs(2 * at.gradient @ way.ravel() - numeric) < 0.02 * size


@pytest.mark.parametrize("freedom", FREEDOMS)
def test_the_first_step_minimises_the_linear_problem(frame, target, freedom):
    """Against one dense least-squares problem in the vertices and the palette's unknowns together."""
    weight, damping = 0.4, 1e-6
    offset, normals = target.offsets(frame.mesh.vertices)
    jacobian, columns = rigidity_matrix(frame.mesh.vertices, frame.mesh.edges), palette_columns(frame, freedom)
    root = weight * np.linalg.cholesky(frame.stiffness).T
    size, unknowns = jacobian.shape[1], columns.shape[1]
    system = np.vstack(
        [
            np.hstack([jacobian, -columns]),
            np.hstack([root @ across(normals), np.zeros((len(offset), unknowns))]),
            np.hstack([np.sqrt(damping) * np.eye(size), np.zeros((size, unknowns))]),
        ]
    )
    known = -np.concatenate([frame.residual, root @ offset, np.zeros(size)])
    step = np.linalg.lstsq(system, known)[0]
    found, value = solve(frame, target, weight, freedom, iterations=1)
    assert value < linearised(frame, target, weight).merit  # the first trial was taken: damping 1e-6
    np.testing.assert_allclose((found.mesh.vertices - frame.mesh.vertices).ravel(), step[:size], atol=1e-5)
    np.testing.assert_allclose(found.lengths, changed_lengths(frame, freedom, step[size:]), atol=1e-6)


@pytest.mark.parametrize("freedom", FREEDOMS)
@pytest.mark.parametrize("weight", [1.0, 0.3, 0.03])
def test_the_merit_never_rises(frame, target, freedom, weight):
    values = [linearised(frame, target, weight).merit]
    at = frame
    for _ in range(8):
        at, value = solve(at, target, weight, freedom, iterations=1)
        offset, _ = target.offsets(at.mesh.vertices)
        assert value == pytest.approx(merit(at, offset, weight))
        values.append(value)
    assert all(after <= before for before, after in pairwise(values))
    assert values[-1] < 0.9 * values[0]


@pytest.mark.parametrize("seed", range(4))
def test_wild_starts_do_not_raise_it_either(frame, target, seed):
    """Far from the solution full steps overshoot, and damping has to grow."""
    noise = 0.8 * np.random.default_rng(seed).normal(size=frame.mesh.vertices.shape)
    start = frame.moved(frame.mesh.vertices + noise, LENGTHS)
    found, value = solve(start, target, 0.1, "all")
    assert value < linearised(start, target, 0.1).merit
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
