from threading import Thread

import igl
import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from quadratic_problem import pebble, small_ring

from drkid.closest_point import (
    CHUNK,
    LEAF,
    MORTON_BITS,
    closest_points,
    closest_slots,
    morton_order,
    morton_tree,
    projected,
    triangle_tree,
)
from drkid.mesh import TriMesh

SEEDS = st.integers(0, 2**32 - 1)


def soup(count, rng):
    """So many triangles that have nothing to do with one another."""
    return TriMesh(rng.normal(size=(3 * count, 3)), np.arange(3 * count).reshape(-1, 3))


def squared_to_segments(points, start, end):
    """(n, m): squared distances of points (n, 3) to segments (m, 3)."""
    along, away = end - start, points[:, None] - start
    square = (along**2).sum(axis=1)
    share = np.clip((away * along).sum(axis=2) / np.where(square > 0, square, 1), 0, 1)
    return ((away - share[:, :, None] * along) ** 2).sum(axis=2)


def squared_to_triangles(points, corners):
    """(n, m): squared distances of points to every triangle: to its plane inside it, else to a side."""
    a, b, c = np.moveaxis(corners, 1, 0)
    sides = np.min([squared_to_segments(points, p, q) for p, q in ((a, b), (b, c), (c, a))], axis=0)
    normal = np.cross(b - a, c - a)
    square = (normal**2).sum(axis=1)
    inside = np.tile(square > 0, (len(points), 1))
    for p, q in ((a, b), (b, c), (c, a)):
        inside &= (np.cross(q - p, points[:, None] - p) * normal).sum(axis=2) > 0
    height = ((points[:, None] - a) * normal).sum(axis=2) ** 2 / np.where(square > 0, square, 1)
    return np.where(inside, height, sides)


def assert_closest(mesh, points, found):
    """The distances are the least there are, and triangles and closest points are such as have them."""
    squared, face, closest = found
    scale = 1 + np.abs(points).max()
    every = squared_to_triangles(points, mesh.corners)
    np.testing.assert_allclose(np.sqrt(squared), np.sqrt(every.min(axis=1)), atol=1e-12 * scale)
    np.testing.assert_allclose(np.linalg.norm(points - closest, axis=1), np.sqrt(squared), atol=1e-12 * scale)
    own = np.sqrt(squared_to_triangles(closest, mesh.corners)[np.arange(len(points)), face])
    np.testing.assert_allclose(own, 0, atol=1e-12 * scale)


def places(mesh, rng):
    """Points far, outside, inside and near, and on corners, sides and faces."""
    near = 0.1 * mesh.mean_edge * rng.normal(size=mesh.vertices.shape)
    return {
        "far": 100 * mesh.diagonal * rng.normal(size=(50, 3)),
        "outside": 1.5 * mesh.vertices,
        "inside": 0.3 * mesh.vertices,
        "near": mesh.vertices + near,
        "corners": mesh.vertices.copy(),
        "sides": mesh.vertices[mesh.edges].mean(axis=1),
        "faces": mesh.corners.mean(axis=1),
    }


@pytest.mark.parametrize("make", [pebble, small_ring, lambda: pebble(subdivisions=2)], ids=["pebble", "ring", "fine"])
@pytest.mark.parametrize("place", ["far", "outside", "inside", "near", "corners", "sides", "faces"])
def test_distances_and_points_are_those_of_igl(make, place):
    mesh = make()
    points = places(mesh, np.random.default_rng(0))[place]
    squared, face, closest = closest_points(triangle_tree(mesh), points)
    expected, other, nearest = igl.point_mesh_squared_distance(points, mesh.vertices, mesh.faces)
    scale = 1 + np.abs(points).max()
    np.testing.assert_allclose(np.sqrt(squared), np.sqrt(expected), atol=1e-9 * scale)
    distance = np.sort(np.sqrt(squared_to_triangles(points, mesh.corners)), axis=1)
    clear = distance[:, 1] - distance[:, 0] > 1e-6 * scale
    np.testing.assert_array_equal(face[clear], other[clear])
    np.testing.assert_allclose(closest[clear], nearest[clear], atol=1e-7 * scale)
    assert_closest(mesh, points, (squared, face, closest))


def test_points_on_the_surface_have_no_distance():
    mesh = pebble()
    for place in ("corners", "sides", "faces"):
        squared, _, _ = closest_points(triangle_tree(mesh), places(mesh, np.random.default_rng(0))[place])
        assert np.sqrt(squared).max() < 1e-14


@given(count=st.integers(1, 70), seed=SEEDS)
def test_any_number_of_triangles_does(count, seed):
    """Fewer than a leaf holds, and numbers that do not fill the leaves."""
    rng = np.random.default_rng(seed)
    mesh, points = soup(count, rng), 2 * rng.normal(size=(30, 3))
    assert_closest(mesh, points, closest_points(triangle_tree(mesh), points))


@given(shared=st.sampled_from([(0, 1), (1, 2), (2, 0), (0, 1, 2)]), seed=SEEDS)
def test_a_triangle_whose_corners_coincide_is_a_segment_or_a_point(shared, seed):
    rng = np.random.default_rng(seed)
    corners, points = rng.normal(size=(3, 3)), 2 * rng.normal(size=(30, 3))
    corners[list(shared)] = corners[shared[0]]
    mesh = TriMesh(corners, np.arange(3)[None])
    assert_closest(mesh, points, closest_points(triangle_tree(mesh), points))


@pytest.mark.parametrize("make", [triangle_tree, morton_tree])
@pytest.mark.parametrize("count", [1, LEAF - 1, LEAF, 2 * LEAF - 1, 2 * LEAF, 2 * LEAF + 1, 37, 320])
def test_the_tree_is_complete_and_its_boxes_hold_what_is_below(make, count):
    mesh = soup(count, np.random.default_rng(count))
    tree = make(mesh)
    leaves = len(tree.low) // 2
    size = len(tree.face) // leaves
    assert leaves * size == len(tree.face)
    assert leaves == 1 or LEAF <= size <= 2 * LEAF
    assert set(tree.face.tolist()) == set(range(count))
    np.testing.assert_array_equal(tree.corners, mesh.corners[tree.face])
    for slot, corners in enumerate(tree.corners):
        node = leaves + slot // size
        while node >= 1:
            assert (tree.low[node] <= corners).all()
            assert (corners <= tree.high[node]).all()
            node //= 2


@given(SEEDS)
def test_guesses_do_not_matter(seed):
    rng, mesh = np.random.default_rng(seed), pebble()
    tree, points = triangle_tree(mesh), 1.3 * mesh.vertices + 0.3 * rng.normal(size=mesh.vertices.shape)
    slots = rng.integers(len(tree.face), size=len(points))
    squared, weights = closest_slots(tree, points, slots)
    expected, _, nearest = closest_points(tree, points)
    np.testing.assert_allclose(squared, expected, rtol=1e-12)
    np.testing.assert_allclose(np.einsum("ij,ijk->ik", weights, tree.corners[slots]), nearest, atol=1e-12)


def test_the_slots_found_are_the_best_guesses():
    mesh = pebble()
    tree, points = triangle_tree(mesh), 1.2 * mesh.vertices
    slots = np.zeros(len(points), np.int64)
    squared, weights = closest_slots(tree, points, slots)
    found = slots.copy()
    again, same = closest_slots(tree, points, slots)
    np.testing.assert_array_equal(slots, found)
    np.testing.assert_array_equal(again, squared)
    np.testing.assert_array_equal(same, weights)


@given(SEEDS)
def test_weights_sum_to_one_and_make_the_point(seed):
    """Of a point in a triangle they are the weights that it was made with."""
    rng = np.random.default_rng(seed)
    for corners, given_weights in zip(rng.normal(size=(20, 3, 3)), rng.dirichlet(np.ones(3), size=20), strict=True):
        mesh = TriMesh(corners, np.arange(3)[None])
        point = given_weights @ corners
        _, weights = closest_slots(triangle_tree(mesh), point[None], np.zeros(1, np.int64))
        assert weights.sum() == pytest.approx(1, rel=1e-14)
        assert weights.min() > -1e-12
        np.testing.assert_allclose(weights[0], given_weights, atol=1e-11 / (2 * mesh.areas[0]) ** 2)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_point_that_is_no_number_ends_and_spoils_no_other(bad):
    mesh = TriMesh(*_ball())
    tree, points = triangle_tree(mesh), 1.3 * mesh.vertices
    expected, _, _ = closest_points(tree, points)
    points[[0, 7]] = bad
    points[9, 1] = bad
    answers = []
    search = Thread(target=lambda: answers.append(closest_points(tree, points)[0]), daemon=True)
    search.start()
    search.join(60)
    assert not search.is_alive()
    good = np.isfinite(points).all(axis=1)
    assert not np.isfinite(answers[0][~good]).any()
    np.testing.assert_array_equal(answers[0][good], expected[good])


@given(seed=SEEDS, factor=st.floats(0.01, 100))
def test_they_move_and_scale_with_the_mesh(seed, factor):
    rng, mesh = np.random.default_rng(seed), pebble()
    turn, away = np.linalg.qr(rng.normal(size=(3, 3)))[0], rng.normal(size=3)
    points = 1.5 * rng.normal(size=(40, 3))
    squared, _, closest = closest_points(triangle_tree(mesh), points)
    moved = mesh.moved(factor * mesh.vertices @ turn + away)
    other, _, there = closest_points(triangle_tree(moved), factor * points @ turn + away)
    np.testing.assert_allclose(np.sqrt(other), factor * np.sqrt(squared), atol=1e-12 * (1 + factor))
    np.testing.assert_allclose(there, factor * closest @ turn + away, atol=1e-11 * (1 + factor))


@given(count=st.integers(1, 70), seed=SEEDS)
def test_projections_are_the_closest_points(count, seed):
    rng = np.random.default_rng(seed)
    mesh, points = soup(count, rng), 2 * rng.normal(size=(30, 3))
    closest, face, weights = projected(morton_tree(mesh), points)
    assert_closest(mesh, points, (((points - closest) ** 2).sum(axis=1), face, closest))
    np.testing.assert_allclose(np.einsum("pc,pcd->pd", weights, mesh.corners[face]), closest, atol=1e-12)


def test_threads_change_no_bit_of_the_projections():
    mesh, rng = pebble(), np.random.default_rng(0)
    points = 2 * rng.normal(size=(3 * CHUNK + 5, 3))
    one, two, four = (projected(morton_tree(mesh), points, threads) for threads in (1, 2, 4))
    for other in (two, four):
        assert all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))


@given(SEEDS)
def test_mortons_curve_interleaves_the_bits(seed):
    points = np.random.default_rng(seed).integers(0, 2**MORTON_BITS, (20, 3))
    points[0], points[1] = 0, 2**MORTON_BITS - 1
    codes = [
        sum(((int(c) >> bit) & 1) << (3 * bit + axis) for axis, c in enumerate(p) for bit in range(MORTON_BITS))
        for p in points
    ]
    np.testing.assert_array_equal(morton_order(points.astype(float)), np.argsort(codes, kind="stable"))


def test_no_point_and_one_place_have_an_order():
    assert morton_order(np.empty((0, 3))).shape == (0,)
    np.testing.assert_array_equal(morton_order(np.ones((4, 3))), np.arange(4))


def _ball():
    sphere = trimesh.creation.icosphere(subdivisions=2)
    return np.asarray(sphere.vertices), np.asarray(sphere.faces)
