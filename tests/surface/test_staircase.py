"""Smoothing: bounded, unbiased, and true to every voxel's side."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from voxel_shapes import ball, ellipsoid, volume_of

from drkid.intersection import self_intersections
from drkid.spec import KitSpec
from drkid.surface import extract_surface
from drkid.surface.marching_cubes import grid_surface
from drkid.surface.staircase import REACH_VOXELS, faired, near_thin_places, smoothed_distance, uncrossed

ONES = np.ones(3)


@given(st.integers(0, 10_000), st.tuples(*[st.floats(0.1, 5)] * 3))
def test_no_voxel_changes_sides(seed, spacing):
    mask = np.pad(np.random.default_rng(seed).random((7, 7, 7)) < 0.4, 3)
    mask[6, 6, 6] = True
    field = smoothed_distance(mask, np.array(spacing))
    np.testing.assert_array_equal(field > 0, mask)


@pytest.mark.parametrize("steps", [4, 12])
def test_fairing_never_leaves_its_reach(steps):
    mesh, _ = grid_surface(ball())
    spikes = mesh.vertices + np.random.default_rng(0).normal(0, 3, mesh.vertices.shape)
    start, vertices = np.array(mesh.vertices), spikes
    for _ in range(steps):
        vertices = faired(mesh, vertices, start, ONES)
    assert np.linalg.norm(vertices - start, axis=1).max() <= REACH_VOXELS * (1 + 1e-12)


def test_fairing_keeps_the_volume_and_lessens_the_bend():
    mesh, _ = grid_surface(ball())
    smooth = mesh.moved(faired(mesh, np.array(mesh.vertices), np.array(mesh.vertices), ONES))
    assert smooth.volume == pytest.approx(mesh.volume, rel=0.01)
    assert smooth.areas.sum() < 0.97 * mesh.areas.sum()


@pytest.mark.parametrize("height", [1.0, 2.5, 7.0, 10.0])
def test_long_voxels_lose_no_volume(height):
    spacing = np.array((1.0, 1.0, height))
    shape = (44, 44, int(44 / height) + 6)
    mask = ellipsoid(shape, (np.array(shape) - 1) / 2 * spacing + (0.2, -0.1, 0.3 * height), (18, 15, 20), spacing)
    surface = extract_surface(volume_of(mask, tuple(spacing)), KitSpec())
    assert surface.mesh.volume == pytest.approx(mask.sum() * spacing.prod(), rel=0.012)
    assert surface.max_displacement_voxels < 1


def test_faces_that_cut_others_go_back_and_the_rest_stays():
    mesh, _ = grid_surface(ball())
    safe, pushed = np.array(mesh.vertices), np.array(mesh.vertices)
    through = int(pushed[:, 0].argmax())
    pushed[through, 0] -= 30
    assert len(self_intersections(mesh.moved(pushed)))
    vertices = uncrossed(mesh, pushed, safe, ONES)
    assert not len(self_intersections(mesh.moved(vertices)))
    np.testing.assert_array_equal(vertices, safe)
    gentle = faired(mesh, safe, safe, ONES)
    np.testing.assert_array_equal(uncrossed(mesh, gentle, safe, ONES), gentle)


def test_thin_sheets_do_not_cross_themselves():
    sheet = np.zeros((20, 20, 20), bool)
    height = np.rint(9 + 2 * np.sin(np.indices((14, 14)).sum(axis=0) / 1.5)).astype(int)
    for (x, y), z in np.ndenumerate(height):
        sheet[x + 3, y + 3, z : z + 1 + (x * y) % 2] = True
    surface = extract_surface(volume_of(sheet), KitSpec())
    assert not len(self_intersections(surface.mesh))


def test_thin_places_are_walls_gaps_and_spikes_and_nothing_else():
    mask = np.zeros((40, 20, 20), bool)
    mask[4:16, 4:16, 4:16] = mask[18:30, 4:16, 4:16] = True  # a gap of two voxels
    mask[16:18, 4:7, 4:7] = True  # bridged
    mesh, _ = grid_surface(mask)
    thin = near_thin_places(mesh, mask)
    x, y, _ = mesh.corners.mean(axis=1).T
    walls = np.isin(x, (15.5, 17.5)) & (y > 8)
    assert walls.sum() > 100
    assert thin[walls].all()
    assert not thin[(x < 10) | (x > 24)].any()
