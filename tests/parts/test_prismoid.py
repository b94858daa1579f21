import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drkid.class_triangle import laid_down
from drkid.parts.prismoid import bevelled, side_insets

insets = st.lists(st.floats(-1.5, 1.5), min_size=6, max_size=6).map(lambda x: np.reshape(x, (2, 3)))


@given(insets)
def test_bevelled_sides_stand_where_asked(wanted) -> None:
    triangle = laid_down(np.array([28.0, 30.0, 33.0]))
    piece = bevelled(triangle, wanted, 6.0)
    assert piece.insets(triangle) == pytest.approx(wanted, abs=1e-9)
    assert piece.outline(-3.0) == pytest.approx(piece.faces[0])
    assert piece.outline(0.0) == pytest.approx(piece.faces.mean(axis=0))


@given(insets)
def test_solid_has_the_volume_of_its_sections(wanted) -> None:
    triangle = laid_down(np.array([28.0, 30.0, 33.0]))
    piece = bevelled(triangle, wanted, 6.0)
    areas = [_area(piece.outline(z)) for z in (-3.0, 0.0, 3.0)]
    simpson = 6.0 * (areas[0] + 4 * areas[1] + areas[2]) / 6
    assert piece.solid.volume == pytest.approx(simpson)
    assert piece.solid.bounds[:, 2] == pytest.approx([-3, 3])


@given(st.lists(st.floats(0, 2), min_size=9, max_size=9))
def test_a_ridged_piece_is_bounded_by_both_planes_of_its_bevels(values) -> None:
    triangle = laid_down(np.array([28.0, 30.0, 33.0]))
    wanted = np.reshape(values, (3, 3))
    wanted[1] = np.minimum(wanted[1], wanted[[0, 2]].mean(axis=0))
    piece = bevelled(triangle, wanted, 6.0)
    assert piece.insets(triangle) == pytest.approx(wanted[[0, 2]], abs=1e-9)
    halves = [bevelled(triangle, wanted[i : i + 2], 3.0).solid.volume for i in (0, 1)]
    assert piece.solid.volume == pytest.approx(sum(halves))
    (low, middle, below), (again, high, above) = piece.bevels(triangle)
    assert (low, middle, again, high) == (-3.0, 0.0, 0.0, 3.0)
    assert below == pytest.approx((wanted[0] - wanted[1]) / 3)
    assert above == pytest.approx((wanted[1] - wanted[2]) / 3)
    for height, row in zip((-3.0, 0.0, 3.0), wanted, strict=True):
        assert side_insets(triangle, piece.outline(height)) == pytest.approx(row, abs=1e-9)


def _area(outline) -> float:
    (ax, ay), (bx, by) = outline[1] - outline[0], outline[2] - outline[0]
    return (ax * by - ay * bx) / 2
