import numpy as np
import pytest

from drkid.remesh.midpoint_subdivision import subdivided


def test_the_surface_stays_the_same(box):
    fine = subdivided(box, 300)
    assert len(fine.vertices) >= 300
    assert fine.is_closed_manifold
    assert fine.genus == box.genus
    assert fine.volume == pytest.approx(box.volume)
    assert fine.areas.sum() == pytest.approx(box.areas.sum())
    assert fine.areas.max() == pytest.approx(fine.areas.min() * box.areas.max() / box.areas.min())


def test_enough_vertices_are_left_alone(blob):
    assert subdivided(blob, 10) is blob
    assert np.array_equal(subdivided(blob, len(blob.vertices) + 1).vertices[: len(blob.vertices)], blob.vertices)
