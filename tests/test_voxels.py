"""Counting, boxing and splitting voxels."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drkid import voxels
from drkid.kit import LabelVolume
from drkid.spec import KitSpec


@pytest.mark.parametrize("names", [[0, 1, 2, 3], [0, 7, 4_000_000_000, 5_000_000], [-3, 0, 2, 9]])
@pytest.mark.parametrize("order", ["C", "F"])
def test_counts_are_those_of_unique_however_cut_into_slabs(names, order, monkeypatch):
    monkeypatch.setattr(voxels, "SLAB_VOXELS", 100)
    index = np.random.default_rng(0).integers(0, 4, (9, 8, 7))
    values = np.asarray(np.array(names, np.int64)[index], order=order)
    label, count = np.unique(values[values > 0], return_counts=True)
    assert voxels.label_counts(values) == dict(zip(label.tolist(), count.tolist(), strict=True))


@pytest.mark.parametrize("order", ["C", "F"])
def test_slabs_cover_every_voxel_once(order, monkeypatch):
    monkeypatch.setattr(voxels, "SLAB_VOXELS", 30)
    values = np.asarray(np.arange(5 * 6 * 7).reshape(5, 6, 7), order=order)
    parts = list(voxels.slabs(values))
    assert len(parts) > 3
    np.testing.assert_array_equal(np.sort(np.concatenate([part.ravel() for part in parts])), np.arange(210))


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 1), (1, 2, 0)])
@pytest.mark.parametrize("names", [[0, 1, 2, 3], [0, 7, 4_000_000, 5_000_000]])
def test_boxes_of_labels_are_tight_in_every_layout(order, names):
    index = (np.random.default_rng(0).random((9, 8, 7)) < 0.02) * np.random.default_rng(1).integers(1, 4, (9, 8, 7))
    values = np.array(names, np.int64)[index].transpose(order)
    labels = np.unique(values[values > 0]).tolist()
    for label, box in zip(labels, voxels.label_boxes(values, labels), strict=True):
        assert box == voxels.bounding_box(values == label) == voxels.label_box(values, label)


@given(st.integers(0, 10_000))
def test_the_box_is_tight(seed):
    mask = np.random.default_rng(seed).random((6, 7, 8)) < 0.01
    box = voxels.bounding_box(mask)
    if box is None:
        assert not mask.any()
    else:
        inside = mask[box]
        assert inside.sum() == mask.sum()
        assert all(inside.take(end, axis).any() for axis in range(3) for end in (0, -1))


def test_components_join_across_corners_and_come_by_size():
    mask = np.zeros((10, 10, 10), bool)
    mask[0, 0, 0] = mask[1, 1, 1] = True
    mask[5:8, 5:8, 5:8] = True
    found = voxels.components(mask)
    assert found.voxels == (27, 2)
    assert found.boxes[0] == (slice(5, 8),) * 3


def test_an_object_knows_its_place_cavities_and_ends():
    values = np.zeros((12, 12, 12), np.uint8)
    values[0:5, 4:9, 7:12] = 1
    values[2, 6, 9] = 0
    volume = LabelVolume(values, (1, 1, 1), None, "mask", "a", "")
    inside = voxels.foreground(volume, KitSpec())
    found = voxels.voxel_object(inside, voxels.components(inside.mask), 0)
    assert found.border == ("x low", "z high")
    assert (found.cavities, found.voxels) == (1, 124)
    assert found.mask.sum() == 125
    where = np.argwhere(found.mask) + found.origin
    np.testing.assert_array_equal(where.min(0), (0, 4, 7))
    np.testing.assert_array_equal(where.max(0), (4, 8, 11))
