from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from plain_linearisation import plain_offsets

from drkid.congruence.target import Target, signed_offsets, smoothness
from drkid.mesh import TriMesh

RADIUS = 2.0


@pytest.fixture(scope="module")
def ball() -> Target:
    sphere = trimesh.creation.icosphere(subdivisions=4, radius=RADIUS)
    return Target(TriMesh(sphere.vertices, sphere.faces))


def points(seed: int, count: int = 500) -> np.ndarray:
    """Points at radii from 0.6 to 1.5 of the ball's."""
    rng = np.random.default_rng(seed)
    ray = rng.normal(size=(count, 3))
    return ray / np.linalg.norm(ray, axis=1, keepdims=True) * RADIUS * rng.uniform(0.6, 1.5, size=(count, 1))


def test_offsets_of_a_sphere_lie_within_its_sagitta(ball):
    at = points(0)
    offset, _ = ball.offsets(at)
    ideal = np.linalg.norm(at, axis=1) - RADIUS
    corners = ball.mesh.corners
    inner = np.einsum("ij,ij->i", corners[:, 0], ball.mesh.face_normals).min()  # radius of the ball inside
    assert (offset >= ideal - 1e-9).all()
    assert (offset <= ideal + RADIUS - inner + 1e-9).all()
    assert (offset[ideal < -0.01] < 0).all()
    assert (offset[ideal > 0.01] > 0).all()


def test_normals_of_a_sphere_are_unit_and_look_outwards(ball):
    at = points(1)
    _, normals = ball.offsets(at)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-12)
    cosine = np.einsum("ij,ij->i", normals, at) / np.linalg.norm(at, axis=1)
    assert cosine.min() > np.cos(np.radians(2))


def test_vertices_of_the_target_have_no_offset(potato):
    offset, _ = Target(potato).offsets(potato.vertices)
    np.testing.assert_allclose(offset, 0, atol=1e-7)


def test_normals_are_the_gradient_of_the_offsets(ball):
    at, step = points(2), 1e-5
    _, normals = ball.offsets(at)
    for axis in range(3):
        move = step * np.eye(3)[axis]
        slope = (ball.offsets(at + move)[0] - ball.offsets(at - move)[0]) / (2 * step)
        np.testing.assert_allclose(slope, normals[:, axis], atol=0.06)  # facets of 2°, normals averaged


@given(st.integers(0, 2**32 - 1), st.floats(0.1, 10))
def test_offsets_move_and_scale_with_the_surface(potato, seed, factor):
    rng = np.random.default_rng(seed)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    away = rng.normal(size=3)
    at = 1.2 * potato.vertices[::10] + 0.01 * rng.normal(size=(len(potato.vertices[::10]), 3))
    offset, normals = Target(potato).offsets(at)
    moved, turned = Target(potato.moved(factor * potato.vertices @ turn + away)).offsets(factor * at @ turn + away)
    np.testing.assert_allclose(moved, factor * offset, atol=1e-6 * factor)
    np.testing.assert_allclose(turned, normals @ turn, atol=1e-5)


@pytest.mark.parametrize("name", ["potato", "ring"])
@pytest.mark.parametrize("seed", range(3))
def test_offsets_and_normals_are_those_of_another_search(name, seed, request):
    """igl's closest points, and the same normals interpolated with weights from areas."""
    target, rng = Target(request.getfixturevalue(name)), np.random.default_rng(seed)
    at = target.mesh.vertices + 0.2 * rng.normal(size=target.mesh.vertices.shape)
    offset, normals = target.offsets(at)
    expected, others = plain_offsets(target, at)
    np.testing.assert_allclose(offset, expected, atol=1e-12)
    np.testing.assert_allclose(normals, others, atol=1e-10)


def test_guesses_of_the_nearest_triangle_do_not_matter(ball):
    at = points(3)
    slots = np.random.default_rng(0).integers(len(ball.mesh.faces), size=len(at))
    offset, normals = signed_offsets(ball.surface, at, slots)
    expected, others = ball.offsets(at)
    np.testing.assert_allclose(offset, expected, atol=1e-13)
    np.testing.assert_allclose(normals, others, atol=1e-12)


def test_threads_find_the_same(ball):
    places = [points(seed) for seed in range(12)]
    with ThreadPoolExecutor(4) as pool:
        for at, (offset, normals) in zip(places, pool.map(ball.offsets, places), strict=True):
            expected, others = ball.offsets(at)
            np.testing.assert_array_equal(offset, expected)
            np.testing.assert_array_equal(normals, others)


@pytest.mark.parametrize("name", ["potato", "ring"])
@pytest.mark.parametrize("beta", [0.0, 0.5, 1.0, 3.0])
def test_smoothness_is_symmetric_positive_definite_and_keeps_constants(name, beta, request):
    mesh = request.getfixturevalue(name)
    stiffness = smoothness(mesh, beta)
    np.testing.assert_allclose(stiffness, stiffness.T, atol=1e-14)
    values = np.linalg.eigvalsh(stiffness)
    assert values[0] == pytest.approx(1)  # that of a constant offset, which the umbrella does not see
    ones = np.ones(len(mesh.vertices))
    np.testing.assert_allclose(stiffness @ ones, ones, atol=1e-13)
    assert (values[-1] > 1 + beta**2) == (beta > 0)


def test_smoothness_charges_a_vertex_for_what_its_umbrella_does():
    """An icosahedron: a vertex lifted by h has h in its own umbrella, −h / 5 in those of its five neighbours."""
    solid = trimesh.creation.icosahedron()
    mesh = TriMesh(solid.vertices, solid.faces)
    lifted = np.zeros(len(mesh.vertices))
    lifted[3] = 2.0
    valence = mesh.valence[3]
    assert valence == 5
    expected = 4 + 0.5**2 * 4 * (1 + valence / 25)
    assert lifted @ smoothness(mesh, 0.5) @ lifted == pytest.approx(expected)
