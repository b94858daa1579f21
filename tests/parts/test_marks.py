import numpy as np
import pytest
from exact_shapes import decomposed, sixths

from drkid.parts import make_parts
from drkid.parts.marks import _engraving, marks, side_ranks
from drkid.parts.pocket import pocket
from drkid.spec import KitSpec


@pytest.fixture(scope="module")
def kit():
    return make_parts(decomposed(sixths()), KitSpec(size_mm=260, marks=False))


@pytest.mark.parametrize("connector", ["hinge", "box"])
def test_marks_keep_the_wall_to_every_pocket(kit, connector) -> None:
    if connector == "box":  # its pockets lean inwards, and are deepest above the engraving
        kit = make_parts(decomposed(sixths()), KitSpec(marks=False, connector="box"))
    d = kit.dimensions
    for part in kit.parts:
        found = marks(part, d, 0.6, 0.4)
        assert connector == "box" or found.missing == ()
        assert len(found.letter)
        low = -d.thickness_mm / 2
        cut = _engraving(np.concatenate([found.letter, found.ticks]), 0.6, low, low + 0.4)
        assert (cut - part.solid).volume < 1e-9
        for frame in part.side_frames:
            assert pocket(d).moved(frame).gap(cut, 5.0) >= d.min_wall_mm


def test_ticks_count_the_sides_by_length(kit) -> None:
    for part in kit.parts:
        ranks = side_ranks(part)
        lengths = np.linalg.norm(np.roll(part.corners, -1, axis=0) - part.corners, axis=1)
        assert sorted(ranks.tolist()) == [1, 2, 3]
        assert (np.argsort(lengths) == np.argsort(ranks)).all()
        assert len(marks(part, kit.dimensions, 0.6, 0.4).ticks) == 6


def test_letter_reads_the_same_on_left_and_right(kit) -> None:
    letters = [marks(part, kit.dimensions, 0.6, 0.4).letter for part in kit.parts]
    one, other = (x - x.mean(axis=(0, 1)) for x in letters)
    assert one == pytest.approx(other)
