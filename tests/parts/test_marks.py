import numpy as np
import pytest
from exact_shapes import decomposed, potato, sixths

from drkid.parts import make_parts
from drkid.parts.engraving import engraving
from drkid.parts.marks import marks, side_ranks
from drkid.solid import Solid
from drkid.spec import KitSpec


@pytest.fixture(scope="module")
def kit():
    return make_parts(decomposed(sixths()), KitSpec(size_mm=260, marks=False))


@pytest.mark.parametrize("process", ["fdm", "sla", "injection"])
@pytest.mark.parametrize("connector", ["hinge", "box"])
def test_marks_keep_the_wall_to_pockets_and_bevels_at_the_smallest_size(connector, process) -> None:
    """A key's pockets lean inwards, and are deepest above the engraving; letters there fill the room that there is."""
    spec = KitSpec(marks=False, connector=connector, process=process)
    width, depth = spec.preset.engrave_width_mm, spec.preset.mark_depth_mm
    kit = make_parts(decomposed(potato(3), 4), spec)
    d = kit.dimensions
    nearest = np.inf
    high = d.thickness_mm / 2
    all_round = Solid.box((-100, -100, -high), (100, 100, high))
    for part in kit.parts:
        found = marks(part, d, width, depth)
        low = -d.thickness_mm / 2
        cut = engraving(np.concatenate([found.letter, found.ticks]), width, low, low + depth)
        assert not cut.is_empty
        assert (cut - part.solid).volume < 1e-9
        nearest = min(nearest, (all_round - part.solid).gap(cut, 5.0))
    assert d.min_wall_mm <= nearest < d.min_wall_mm + 0.1


def test_a_large_piece_has_room_for_all_its_marks(kit) -> None:
    for part in kit.parts:
        found = marks(part, kit.dimensions, 0.6, 0.4)
        assert found.missing == ()
        assert len(found.letter)


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
