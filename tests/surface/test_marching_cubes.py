"""The topology of the grid surface and the sliding of its vertices."""

import numpy as np
import scipy.ndimage as ndi
from hypothesis import given, settings
from hypothesis import strategies as st
from skimage.measure import euler_number
from voxel_shapes import ball, ring

from drkid.surface.marching_cubes import grid_surface, neighbour_mean, slid


def test_faces_look_outwards_and_bodies_are_counted():
    two = np.pad(ball(), ((0, 12), (0, 0), (0, 0)))
    two[30:35, 5:10, 5:10] = True
    mesh, dropped = grid_surface(two)
    assert dropped == 1
    assert 0.95 < mesh.volume / ball().sum() < 1
    assert mesh.vertices[:, 0].max() < 27


def test_an_inner_shell_is_dropped():
    mesh, dropped = grid_surface(ball() & ~ball(27, 4))
    assert dropped == 1
    assert mesh.component_count == 1
    assert mesh.volume > 0.95 * ball().sum()


def test_handles_are_those_of_digital_topology_where_no_cube_is_ambiguous():
    for mask in (ball(), ring()):
        assert grid_surface(mask)[0].genus == 1 - euler_number(mask, 3) == 1 - euler_number(mask, 1)


@settings(max_examples=30)
@given(st.integers(0, 10_000), st.floats(0.1, 0.7))
def test_raw_noise_is_closed(seed, share):
    noise = np.random.default_rng(seed).random((9, 8, 7)) < share
    noise[4, 4, 3] = True
    assert grid_surface(np.pad(noise, 1))[0].is_closed_manifold


@settings(max_examples=30)
@given(st.integers(0, 10_000))
def test_sliding_keeps_to_the_grid_edge_and_to_its_side(seed):
    rng = np.random.default_rng(seed)
    smooth = ndi.gaussian_filter(rng.random((12, 12, 12)), 1)
    mask = np.pad(smooth > np.median(smooth), 1)
    field = np.where(mask, 1, -1) * rng.uniform(1e-9, 1, mask.shape)
    mesh, _ = grid_surface(mask)
    moved = slid(mesh, field)
    on_edge = (mesh.vertices % 1 != 0).sum(axis=1) == 1
    assert np.abs(moved - mesh.vertices)[on_edge].max() < 0.5
    np.testing.assert_array_equal(np.floor(moved[on_edge]), np.floor(mesh.vertices[on_edge]))
    assert (moved[on_edge] % 1 != 0).sum() == on_edge.sum()


def test_sliding_finds_the_zero_of_a_linear_field():
    x = np.indices((9, 9, 9))[0]
    mask = np.pad((x[1:-1, 1:-1, 1:-1] <= 4), 1)
    mesh, _ = grid_surface(mask)
    moved = slid(mesh, np.where(mask, 1, -1) * np.abs(4.3 - x))
    cut = mesh.vertices[:, 0] == 4.5
    np.testing.assert_allclose(moved[cut, 0], 4.3)


def test_the_mean_of_the_neighbours_of_a_constant_is_the_constant():
    mesh, _ = grid_surface(ball())
    np.testing.assert_allclose(neighbour_mean(mesh) @ np.full(len(mesh.vertices), 3.0), 3.0)
