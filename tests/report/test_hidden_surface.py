"""Painting order: what is nearer is painted later, also where no order of whole polygons is right."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from drkid.report.hidden_surface import painted


def square(x, y, z, half=1.0):
    return np.array(
        [[x - half, y - half, z], [x + half, y - half, z], [x + half, y + half, z], [x - half, y + half, z]]
    )


def bar(a, b, width, z_a, z_b):
    """A flat bar from point a to b in the plane, rising from z_a to z_b, seen from above."""
    a, b = np.array(a, float), np.array(b, float)
    side = np.array([-(b - a)[1], (b - a)[0]]) / np.linalg.norm(b - a) * width / 2
    return np.array([[*(a - side), z_a], [*(b - side), z_b], [*(b + side), z_b], [*(a + side), z_a]])


def colour_at(found, point):
    """The source of the last polygon painted over a point; -1 for none."""
    top = -1
    for polygon, source in zip(found.polygons, found.source, strict=True):
        flat, following = polygon[:, :2], np.roll(polygon[:, :2], -1, axis=0)
        turns = (following - flat)[:, 0] * (point[1] - flat[:, 1]) - (following - flat)[:, 1] * (point[0] - flat[:, 0])
        if (turns > 0).all():
            top = int(source)
    return top


@given(st.permutations(range(6)))
def test_a_pile_is_painted_from_below(order):
    found = painted([square(0.3 * z, 0.1 * z, z) for z in order], 200)
    assert [order[i] for i in found.source] == sorted(order)


def test_what_is_covered_wholly_is_left_out():
    found = painted([square(0, 0, 0, 0.5), square(0, 0, 1)], 200)
    assert found.source.tolist() == [1]


def test_three_bars_that_overlap_in_a_circle():
    angles = np.radians([90, 210, 330])
    tips = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    bars = []
    for i in range(3):
        a, b = tips[i], tips[(i + 1) % 3]
        bars.append(bar(a - 0.4 * (b - a), b + 0.4 * (b - a), 0.3, -1, 1))
    found = painted(bars, 300)
    assert len(found.polygons) > 3
    for i in range(3):  # at its end, high, each bar lies over the beginning of the next
        assert colour_at(found, tips[(i + 1) % 3]) == i
