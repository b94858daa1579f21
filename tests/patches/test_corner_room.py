import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drkid.patches.agglomeration import agglomerated
from drkid.patches.corner_room import DEPTH, HALF_WIDTH, SIZES, corner_rooms, room
from drkid.patches.matching import paired
from drkid.patches.outline import outlined


def boxes_apart(first: float, second: float, angle: float) -> float:
    """The same distance by sampling both pockets finely; positive ones only."""
    x, y = np.meshgrid(np.linspace(-HALF_WIDTH, HALF_WIDTH, 21), np.linspace(0, DEPTH, 21))
    one = np.stack([first / 2 + x, y], axis=-1).reshape(-1, 2)
    along, inwards = np.array([np.cos(angle), np.sin(angle)]), np.array([np.sin(angle), -np.cos(angle)])
    other = ((second / 2 + x)[..., None] * along + y[..., None] * inwards).reshape(-1, 2)
    return float(np.linalg.norm(one[:, None] - other[None], axis=2).min())


@settings(max_examples=20)
@given(st.floats(0.8, 1.3), st.floats(0.8, 1.3), st.floats(0.7, 1.6))
def test_room_is_the_distance_of_the_two_pockets(first, second, angle) -> None:
    found = float(room(np.array([first]), np.array([second]), np.array([angle]), 1.0)[0])
    sampled = boxes_apart(first, second, angle)
    assert found == pytest.approx(sampled, abs=0.01) if found > 0 else sampled < 0.02


@given(st.floats(0.8, 1.3), st.floats(0.8, 1.3), st.floats(0.9, 1.3))
def test_a_wider_corner_and_longer_sides_have_more_room(first, second, angle) -> None:
    a, b, c = np.array([[first, first + 0.1, first], [second, second, second], [angle, angle, angle + 0.1]])
    least, longer, wider = room(a, b, c, 1.0)
    assert longer >= least - 1e-12
    assert wider >= least - 1e-12


def test_pieces_that_are_made_alike_keep_the_room_of_the_tightest_triangle(pebble) -> None:
    pieces = [outlined(pebble, pair) for pair in paired(pebble, 0.05)]
    rooms = corner_rooms(pebble, pieces)
    assert rooms.enough(pebble.vertices)
    found = agglomerated(pebble, pieces, 0.01, 0.05)
    assert (found.vertices != pebble.vertices).any()
    assert rooms.enough(found.vertices)
    ends = pebble.vertices[rooms.pairs]
    nearer = pebble.vertices.copy()
    nearer[rooms.pairs[0, 0]] = ends[0].mean(axis=0)
    assert not rooms.enough(nearer)
    assert rooms.missing(nearer).max() > 0


@pytest.mark.parametrize("size", SIZES)
def test_lengths_that_are_held_leave_room_for_pockets_of_every_size(pebble, size) -> None:
    """A corner is as wide as its inner edge asks for: as roomy as the tightest triangle's, or as it is now."""
    pieces = [outlined(pebble, group) for group in paired(pebble, 0.01)]
    rooms = corner_rooms(pebble, pieces)
    least = {tuple(pair): length for pair, length in zip(rooms.pairs.tolist(), rooms.least.tolist(), strict=True)}
    at, after, before = np.moveaxis(pebble.vertices[rooms.corners], 1, 0)
    first, second = np.linalg.norm(after - at, axis=1), np.linalg.norm(before - at, axis=1)
    now = np.linalg.norm(after - before, axis=1)
    held = np.array([least[tuple(sorted(corner[1:]))] for corner in rooms.corners.tolist()])
    angle = np.arccos((first**2 + second**2 - np.minimum(held, now) ** 2) / (2 * first * second))
    wanted = rooms.least_rooms[SIZES.index(size)]
    found = room(first, second, angle, size * pebble.mean_edge)
    assert (found >= wanted - 1e-9).all()
    assert (held < now).any()
