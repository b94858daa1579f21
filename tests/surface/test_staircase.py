"""Smoothing: bounded, unbiased, and true to every voxel's side."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from voxel_shapes import ball

from drkid.surface.marching_cubes import grid_surface
from drkid.surface.staircase import REACH_VOXELS, faired, smoothed_distance

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
