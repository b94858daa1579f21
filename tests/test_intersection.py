from itertools import product

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from drkid.intersection import self_intersections
from drkid.mesh import TriMesh

small = st.integers(-3, 3)
triangle = st.lists(st.tuples(small, small, small), min_size=3, max_size=3, unique=True)


def cross(u, v):
    return (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])


def minus(u, v):
    return tuple(a - b for a, b in zip(u, v, strict=True))


def are_apart(first, second):
    """Separating axes in whole numbers: exact, and unlike the method under test."""
    sides = [[minus(t[(i + 1) % 3], t[i]) for i in range(3)] for t in (first, second)]
    normals = [cross(s[0], s[1]) for s in sides]
    axes = normals + [cross(u, v) for u, v in product(*sides)]
    axes += [cross(n, u) for n, own in zip(normals, sides, strict=True) for u in own]
    for axis in axes:
        one, two = ([sum(a * p for a, p in zip(axis, point, strict=True)) for point in t] for t in (first, second))
        if max(one) < min(two) or max(two) < min(one):
            return True
    return False


def pairs(vertices, faces):
    return self_intersections(TriMesh(np.array(vertices, float), np.array(faces))).tolist()


@given(triangle, triangle)
def test_triangles_of_whole_numbers_agree_with_separating_axes(first, second):
    for t in (first, second):
        assume(any(cross(minus(t[1], t[0]), minus(t[2], t[0]))))
    found = pairs([*first, *second], [[0, 1, 2], [3, 4, 5]])
    assert found == ([] if are_apart(first, second) else [[0, 1]])


@given(triangle, triangle, st.integers(0, 10), st.floats(1e-3, 1e3))
def test_order_and_scale_change_nothing(first, second, offset, scale):
    vertices = np.array([*first, *second], float)
    one = pairs(vertices, [[0, 1, 2], [3, 4, 5]])
    assert pairs(vertices, [[5, 3, 4], [1, 0, 2]]) == one
    power = 2.0 ** round(np.log2(scale))  # other factors round, and may part what touches
    assert pairs((vertices + offset) * power, [[0, 1, 2], [3, 4, 5]]) == one


def test_a_touch_at_the_last_bit_is_told_from_a_gap():
    above = np.nextafter(0.1 + 0.2, 1)
    base = [[0.1, 0.1, 0.1 + 0.2], [5, 0.1, 0.1 + 0.2], [0.1, 5, 0.1 + 0.2]]
    for height, meets in ((0.1 + 0.2, True), (above, False)):
        tip = [[1, 1, height], [1.1, 1, 3], [1, 1.1, 3]]
        assert (pairs(base + tip, [[0, 1, 2], [3, 4, 5]]) == [[0, 1]]) is meets


@pytest.mark.parametrize(
    ("last", "meets"),
    [((0.2, 0.2, 1), False), ((0.2, 0.2, 0), True), ((-1, -1, 0), True), ((2, 2, 0), False), ((2, 2, 0.1), False)],
)
def test_neighbours_at_an_edge_meet_only_when_folded_flat(last, meets):
    vertices = [(0, 0, 0), (1, 0, 0), (0, 1, 0), last]
    assert (pairs(vertices, [[0, 1, 2], [2, 1, 3]]) == [[0, 1]]) is meets


@pytest.mark.parametrize(
    ("fourth", "fifth", "meets"),
    [
        ((1, 1, -1), (1, 1, 1), True),  # through the middle
        ((-1, 0, -1), (-1, 0, 1), False),  # away from it
        ((1, 1, 1), (2, 1, 2), False),  # above it
        ((1, 2, 0), (2, 1, 0), True),  # in its plane, inside
        ((-1, -2, 0), (-2, -1, 0), False),  # in its plane, outside
        ((9, 9, 0), (9, 9, 5), True),  # along its middle
    ],
)
def test_neighbours_at_a_vertex_meet_when_they_share_more(fourth, fifth, meets):
    vertices = [(0, 0, 0), (4, 0, 0), (0, 4, 0), fourth, fifth]
    assert (pairs(vertices, [[0, 1, 2], [0, 3, 4]]) == [[0, 1]]) is meets


def test_a_face_given_twice_cuts_itself():
    assert pairs([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [[0, 1, 2], [1, 0, 2]]) == [[0, 1]]


def test_no_faces_no_pairs():
    assert len(self_intersections(TriMesh(np.empty((0, 3)), np.empty((0, 3), np.int64)))) == 0


def test_a_sound_surface_has_none_and_two_that_overlap_have_some(potato):
    assert len(self_intersections(potato)) == 0
    count = len(potato.vertices)
    both = TriMesh(
        np.concatenate([potato.vertices, potato.vertices + np.array([1.0, 0.1, 0.2])]),
        np.concatenate([potato.faces, potato.faces + count]),
    )
    found = self_intersections(both)
    assert len(found) > 10
    assert (found[:, 0] < len(potato.faces)).all()
    assert (found[:, 1] >= len(potato.faces)).all()


def test_a_vertex_pushed_through_the_other_side_is_found(potato):
    vertices = potato.vertices.copy()
    vertices[0] = vertices.mean(axis=0) * 2 - 1.5 * vertices[0]
    found = self_intersections(potato.moved(vertices))
    assert len(found)
    around = (potato.faces == 0).any(axis=1)
    assert around[found].any(axis=1).all()
