import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drkid.report.unfolding import flattened, hinged, overlapping

TRIANGLE = np.array([[0.0, 0.0], [3.0, 0.0], [1.0, 2.0]])


def sides(outline: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.roll(outline, -1, axis=0) - outline, axis=1)


@settings(max_examples=40)
@given(st.integers(3, 7), st.floats(0, 0.3), st.integers(0, 1000))
def test_flat_outlines_have_the_sides_they_had_in_space(count, bend, seed):
    angle = np.arange(count) * 2 * np.pi / count
    rng = np.random.default_rng(seed)
    heights = bend * rng.uniform(-1, 1, count)
    space = np.column_stack([np.cos(angle), np.sin(angle), heights])
    flat = flattened(space)
    assert sides(flat) == pytest.approx(sides(space), rel=1e-9)
    x, y = flat.T
    assert (x * np.roll(y, -1) > y * np.roll(x, -1)).all()  # counter-clockwise


def test_a_planar_outline_keeps_its_shape_seen_from_outside():
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    flat = flattened(np.column_stack([TRIANGLE, np.zeros(3)]) @ turn.T + 5)
    assert sides(flat) == pytest.approx(sides(TRIANGLE))
    assert np.linalg.det([flat[1] - flat[0], flat[2] - flat[0]]) == pytest.approx(6)


def test_a_hinged_outline_lies_on_the_other_side():
    child = hinged(TRIANGLE, 1, TRIANGLE, 0)
    assert (child[1] + child[2]) / 2 == pytest.approx([1.5, 0])
    assert child[0, 1] < 0
    assert sides(child) == pytest.approx(sides(TRIANGLE))


def test_overlap_is_told_from_touching():
    shifts = np.array([[3.0, 0], [2.5, 0], [0, -2.0], [0, 0]])
    others = TRIANGLE + shifts[:, None]
    assert overlapping(TRIANGLE[None], others, 1e-6).tolist() == [False, True, False, True]
