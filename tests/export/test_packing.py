import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drkid.export.packing import Place, Shape, Sheet, hull_outline, longest_side_degrees, pack, rotation

SHEET = Sheet(200.0, 150.0, 5.0, 2.0)
TRIANGLE = np.array([[-15.0, -8.0], [15.0, -8.0], [0.0, 16.0]])
ELL = (np.array([[0, 0], [40, 0], [40, 8], [0, 8.0]]), np.array([[0, 8], [8, 8], [8, 40], [0, 40.0]]))


def placed(shape: Shape, place: Place) -> list[np.ndarray]:
    return [o @ rotation(place.degrees).T + [place.x, place.y] for o in shape.outlines]


def distance(a: np.ndarray, b: np.ndarray) -> float:
    """Between convex polygons: corners to sides both ways, minus where they meet."""

    def separation(p, q):
        along = np.roll(p, -1, axis=0) - p
        outward = np.column_stack([along[:, 1], -along[:, 0]]) / np.linalg.norm(along, axis=1)[:, None]
        return np.einsum("sck,sk->sc", q[None] - p[:, None], outward).min(axis=1).max()

    def corner(p, q):
        along = np.roll(q, -1, axis=0) - q
        offset = p[:, None] - q[None]
        share = np.clip((offset * along).sum(-1) / (along**2).sum(-1), 0, 1)
        return np.linalg.norm(offset - share[..., None] * along, axis=-1).min()

    apart = max(separation(a, b), separation(b, a))
    return apart if apart < 0 else min(corner(a, b), corner(b, a))


def check(shapes, counts, sheet, places):
    assert [sum(p.shape == i for p in places) for i in range(len(shapes))] == list(counts)
    bodies = [(p.sheet, placed(shapes[p.shape], p)) for p in places]
    for _, outlines in bodies:
        points = np.vstack(outlines)
        assert (points > sheet.margin_mm - 1e-9).all()
        assert (points < np.array([sheet.width_mm, sheet.depth_mm]) - sheet.margin_mm + 1e-9).all()
    for i, (sheet_a, one) in enumerate(bodies):
        for sheet_b, other in bodies[:i]:
            if sheet_a == sheet_b:
                assert min(distance(a, b) for a in one for b in other) > sheet.spacing_mm - 1e-6


def test_triangles_stand_upright_and_upside_down_by_turns():
    shape = Shape((TRIANGLE,))
    places = pack([shape], [60], SHEET, 0.5)
    check([shape], [60], SHEET, places)
    first = [p for p in places if p.sheet == 0]
    assert len(first) * shape.area > 0.6 * (SHEET.width_mm - 10) * (SHEET.depth_mm - 10)


def test_shapes_that_are_not_convex_reach_into_one_another():
    shape = Shape(ELL)
    places = pack([shape, Shape((TRIANGLE,))], [6, 6], SHEET, 1.0)
    check([shape, Shape((TRIANGLE,))], [6, 6], SHEET, places)
    assert max(p.sheet for p in places) == 0


@settings(max_examples=12)
@given(st.lists(st.tuples(st.floats(8, 40), st.floats(8, 40)), min_size=1, max_size=2), st.integers(1, 6))
def test_everything_is_placed_inside_and_apart(sizes, count):
    shapes = [Shape((np.array([[0, 0], [w, 0], [w, d], [w / 3, d * 1.2]]),)) for w, d in sizes]
    sheet = Sheet(100.0, 90.0, 3.0, 2.0)
    check(shapes, [count] * len(shapes), sheet, pack(shapes, [count] * len(shapes), sheet, 1.0))


@pytest.mark.parametrize("off", [0.0, 1e-14, 1e-9])
def test_a_corner_that_stands_twice_changes_nothing(off):
    shape = Shape((np.vstack([TRIANGLE, TRIANGLE[2] - [off, 2 * off]]),))
    check([Shape((TRIANGLE,))], [12], SHEET, pack([shape], [12], SHEET, 0.5))


def test_what_is_larger_than_the_sheet_is_refused():
    with pytest.raises(ValueError, match="larger than the sheet"):
        pack([Shape((TRIANGLE * 10,))], [1], SHEET, 0.5)


def test_a_hull_is_counter_clockwise_and_its_longest_side_is_found():
    outline = hull_outline(np.vstack([TRIANGLE[::-1], [[0.0, 0.0]]]))
    assert len(outline) == 3
    assert Shape((outline,)).area == pytest.approx(360)
    assert longest_side_degrees(TRIANGLE @ rotation(30).T) == pytest.approx(30)
