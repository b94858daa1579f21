import numpy as np
import pytest

from drkid.patches.agglomeration import agglomerated, renumbered
from drkid.patches.distance_geometry import place
from drkid.patches.identity import misfits
from drkid.patches.matching import paired
from drkid.patches.outline import outlined


def pairs_of(mesh):
    return [outlined(mesh, pair) for pair in paired(mesh, 0.05)]


@pytest.fixture(scope="module")
def moved_and_not(pebble):
    return agglomerated(pebble, pairs_of(pebble), 0.01, 0.0), agglomerated(pebble, pairs_of(pebble), 0.01, 0.3)


def test_no_piece_is_beyond_the_tolerance_and_no_vertex_off_by_more_than_the_shift(pebble, moved_and_not) -> None:
    for found, shift in zip(moved_and_not, (0.0, 0.3), strict=True):
        assert found.misfit.max() <= 0.01
        assert place(pebble).moved(found.vertices).max() <= shift
        for piece, k, misfit in zip(found.pieces, found.shape.tolist(), found.misfit, strict=True):
            assert misfits(found.vertices[list(piece.vertices)], found.means[k]) == pytest.approx(misfit, abs=1e-6)


def test_moving_vertices_brings_fewer_shapes_than_leaving_them(moved_and_not) -> None:
    stayed, moved = (len(found.means) for found in moved_and_not)
    assert moved < stayed <= len(moved_and_not[0].pieces)


def test_every_face_stays_in_its_piece(pebble, moved_and_not) -> None:
    for found in moved_and_not:
        assert [p.faces for p in found.pieces] == [p.faces for p in pairs_of(pebble)]
        for piece in found.pieces:
            assert set(piece.vertices) == {int(v) for f in piece.faces for v in pebble.faces[f]}


def test_the_most_frequent_shape_is_first(moved_and_not) -> None:
    found = renumbered(moved_and_not[1])
    count = np.bincount(found.shape)
    assert (np.diff(count) <= 0).all()
    assert sorted(found.means) == list(range(len(count)))
