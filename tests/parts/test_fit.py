import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drkid.class_triangle import laid_down
from drkid.errors import FitError
from drkid.parts.dimensions import proposed
from drkid.parts.fit import convex_distance, inradius, margins, smallest_scale
from drkid.parts.pocket import pocket, side_frames
from drkid.parts.prismoid import bevelled
from drkid.solid import Solid
from drkid.spec import KitSpec

SQUARE = np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])
DIMENSIONS = proposed(KitSpec(retention="glue"), 40.0)  # a pocket without grooves: its outline is exact


@given(st.floats(-6, 6), st.floats(-6, 6), st.floats(0, 2 * np.pi))
def test_distance_of_polygons_is_that_of_their_points(x, y, angle) -> None:
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    other = SQUARE @ turn.T + [x, y]
    share = np.linspace(0, 1, 40)[:, None, None]
    one, two = ((p + share * (np.roll(p, -1, axis=0) - p)).reshape(-1, 2) for p in (SQUARE, other))
    sampled = np.linalg.norm(one[:, None] - two[None], axis=2).min()
    found = convex_distance(SQUARE, other)
    if found > 0:
        assert found <= sampled + 1e-12
        assert found == pytest.approx(sampled, abs=0.06)
    else:
        assert sampled < 0.06 or np.hypot(x, y) < 1
    assert convex_distance(other, SQUARE) == pytest.approx(found, abs=1e-9)


@given(st.floats(20, 60), st.floats(1, 1.25), st.floats(1, 1.25), st.floats(-1.5, 1.5))
def test_margins_are_the_walls_of_the_solid(edge, b, c, lean) -> None:
    triangle = laid_down(edge * np.sort([1.0, b, c]))
    piece = bevelled(triangle, np.array([[lean + 0.4] * 3, [0.4 - lean] * 3]), DIMENSIONS.thickness_mm)
    found = list(margins(triangle, piece, DIMENSIONS))
    pockets = [pocket(DIMENSIONS).moved(frame) for frame in side_frames(triangle)]
    inside = [p & piece.solid for p in pockets]
    gap = min(inside[i].gap(inside[i - 1], 60.0) for i in range(3))
    stated = min(m.available_mm for m in found if m.what == "wall between two pockets")
    assert max(stated, 0) == pytest.approx(gap, abs=1e-6)


@given(st.floats(26, 60), st.floats(-1.5, 1.5))
def test_bevel_wall_is_the_distance_to_what_is_outside(edge, lean) -> None:
    triangle = laid_down(np.full(3, edge))
    piece = bevelled(triangle, np.array([[lean + 0.4] * 3, [0.4 - lean] * 3]), DIMENSIONS.thickness_mm)
    stated = min(
        m.available_mm for m in margins(triangle, piece, DIMENSIONS) if m.what == "wall between pocket and bevel"
    )
    frames = side_frames(triangle)
    inner = pocket(DIMENSIONS).moved(frames[0]) & piece.solid
    slab = Solid.box((-100, -100, -DIMENSIONS.thickness_mm / 2), (100, 100, DIMENSIONS.thickness_mm / 2))
    # what lies beyond the bevels of the other two sides: the slab less the piece drawn out across side 0
    drawn = bevelled(triangle, np.array([[-200.0, lean + 0.4, lean + 0.4], [-200.0, 0.4 - lean, 0.4 - lean]]), 6.9)
    assert inner.gap(slab - drawn.solid, 60.0) == pytest.approx(max(stated, 0), abs=1e-6)


def test_crossed_insets_have_a_negative_radius() -> None:
    triangle = laid_down(np.full(3, 30.0))
    full = 30 / (2 * np.sqrt(3))
    radii = [inradius(triangle, bevelled(triangle, np.full((2, 3), d), 5.0).faces[0]) for d in (-1, 0, 5, 12)]
    assert radii == pytest.approx([full + 1, full, full - 5, full - 12])


@given(st.floats(1e-3, 1e3), st.floats(1e-2, 1e2))
def test_smallest_scale_is_found_from_either_side(root, guess) -> None:
    found = smallest_scale(lambda s: s - root, guess)
    assert found >= root
    assert found <= max(root * (1 + 2e-5), guess * 2e-5)


def test_what_never_fits_is_refused() -> None:
    with pytest.raises(FitError, match="at any size"):
        smallest_scale(lambda _: -1.0, 1.0)
