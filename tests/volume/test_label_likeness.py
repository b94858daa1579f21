"""What kind of numbers a volume holds."""

import numpy as np
import pytest
import scipy.ndimage as ndi

from drkid.volume.label_likeness import classified

BALL = np.linalg.norm(np.indices((24, 24, 24)) - 11.5, axis=0) < 8


def patches(count: int) -> np.ndarray:
    """Label-like: `count` cells of a Voronoi diagram."""
    seeds = np.random.default_rng(1).uniform(0, 24, (count, 3))
    grid = np.moveaxis(np.indices((24, 24, 24)), 0, -1)
    return np.linalg.norm(grid[:, :, :, None] - seeds, axis=-1).argmin(-1)


def micrograph(bits: int) -> np.ndarray:
    """Not label-like: a blurred ball with noise."""
    clean = ndi.gaussian_filter(BALL.astype(float), 2)
    noisy = clean + np.random.default_rng(2).normal(0, 0.03, clean.shape)
    return np.clip(noisy * (2**bits - 1) * 0.8, 0, 2**bits - 1)


@pytest.mark.parametrize("dtype", [np.bool_, np.uint8, np.int8, np.float32, np.uint64])
@pytest.mark.parametrize("value", [0, 1])
def test_one_positive_value_is_a_mask(dtype, value):
    values, kind = classified((BALL * value).astype(dtype))
    assert kind == "mask"
    assert values.dtype.kind in "iu"
    np.testing.assert_array_equal(values > 0, BALL * value > 0)


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.uint32, np.float32, np.float64])
@pytest.mark.parametrize("count", [3, 40, 200])
def test_coherent_integers_are_labels_in_any_type(dtype, count):
    values, kind = classified(patches(count).astype(dtype))
    assert kind == "labels"
    assert values.dtype.kind in "iu"


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_grey_values_are_a_density(dtype):
    values = micrograph(8 if dtype == np.uint8 else 12).astype(dtype)
    assert classified(values)[1] == "density"


def test_a_soft_edged_mask_is_a_density():
    assert classified((ndi.gaussian_filter(BALL.astype(float), 1.5) * 255).astype(np.uint8))[1] == "density"


def test_floats_stay_as_they_are():
    values = ndi.gaussian_filter(BALL.astype(np.float32), 1.0)
    same, kind = classified(values)
    assert same is values
    assert kind == "density"


def test_specks_without_neighbours_are_labels():
    values = np.zeros((9, 9, 9), np.uint16)
    values[::3, ::3, ::3] = np.arange(1, 28).reshape(3, 3, 3)
    assert classified(values)[1] == "labels"


def test_renaming_labels_does_not_change_the_kind():
    names = np.random.default_rng(3).permutation(10_000_000)[:41].astype(np.int64)
    assert classified(names[patches(40)])[1] == "labels"
