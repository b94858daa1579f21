import numpy as np
import pytest

from drkid.assembly.insertion import BLOCKED_PERCENT, Placed, last_piece
from drkid.solid import Solid

THICK = 4.0


def frame_around(opening: float) -> Solid:
    """A slab with a square hole."""
    return Solid.box((-20, -20, -2), (20, 20, 2)) - Solid.box((-opening, -opening, -9), (opening, opening, 9))


def placed(around: Solid, halves: tuple[Solid, ...] = ()) -> Placed:
    lid = Solid.box((-5, -5, -2), (5, 5, 2))
    places = np.tile(np.eye(4), (2, 1, 1))
    return Placed([lid, around], [halves, ()], places, THICK)


def test_a_lid_goes_into_a_hole_that_is_as_large() -> None:
    found = last_piece(placed(frame_around(5.0)), [0])
    assert found.goes_in
    assert found.overlap_percent == pytest.approx(0, abs=1e-9)


def test_a_rim_over_the_hole_keeps_it_out() -> None:
    rim = frame_around(5.0) + (Solid.box((-20, -20, 2), (20, 20, 3)) - Solid.box((-4, -4, 0), (4, 4, 9)))
    found = last_piece(placed(rim), [0])
    assert not found.goes_in
    assert found.overlap_percent == pytest.approx(100 * (10 * 10 - 8 * 8) / 400, rel=0.01)


def test_a_rim_under_the_hole_does_not() -> None:
    rim = frame_around(5.0) + (Solid.box((-20, -20, -3), (20, 20, -2)) - Solid.box((-4, -4, -9), (4, 4, 0)))
    assert last_piece(placed(rim), [0]).goes_in


def test_a_connector_that_has_no_pocket_keeps_it_out() -> None:
    found = last_piece(placed(frame_around(5.0), (Solid.box((4, -1, -1), (6, 1, 1)),)), [0])
    assert not found.goes_in
    assert found.overlap_percent > BLOCKED_PERCENT


def test_the_next_candidate_is_tried_and_else_the_least_hindered_named() -> None:
    lid = Solid.box((-5, -5, -2), (5, 5, 2))
    rim = Solid.box((-20, -20, 2), (20, 20, 3)) - Solid.box((-4, -4, 0), (4, 4, 9))
    aside = np.eye(4)
    aside[0, 3] = 100.0
    turned = np.diag([1.0, -1.0, -1.0, 1.0])
    places = np.array([np.eye(4), turned, np.eye(4)])
    bodies = [lid, lid.moved(aside), frame_around(5.0) + rim]
    found = last_piece(Placed(bodies, [(), (), ()], places, THICK), [0, 1])
    assert (found.piece, found.candidates, found.goes_in) == (1, 2, True)
    worst = last_piece(Placed(bodies, [(), (), ()], places, THICK), [0])
    assert (worst.piece, worst.candidates, worst.goes_in) == (0, 1, False)


def test_there_must_be_a_candidate() -> None:
    with pytest.raises(ValueError, match="no piece"):
        last_piece(placed(frame_around(5.0)), [])
