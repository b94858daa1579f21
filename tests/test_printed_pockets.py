from dataclasses import replace

import numpy as np
import pytest
from exact_shapes import decomposed, sixths

from drkid.assembly.structure import Shape
from drkid.mesh import rounded
from drkid.parts import make_parts
from drkid.parts.pocket import pocket
from drkid.printed_pockets import PocketRoom, pocket_figures, wall_between_pockets_mm
from drkid.solid import Solid
from drkid.spec import KitSpec


def as_printed(solid: Solid) -> Solid:
    return Solid.of(rounded(solid.mesh()))


@pytest.fixture(scope="module")
def drafted():
    return make_parts(decomposed(sixths()), KitSpec(process="injection"))


@pytest.fixture(scope="module")
def room(drafted):
    d = drafted.dimensions
    return PocketRoom(d.clearance_mm, d.min_wall_mm, d.thickness_mm, d.draft_degrees)


def figures(shapes, drafted, room):
    names = [f"{part.name} {part.handedness}" for part in drafted.parts]
    return pocket_figures(shapes, names, [as_printed(one.solid) for one in drafted.connectors], room)


def shapes_of(drafted):
    return [Shape(part.corners, part.side_frames, as_printed(part.solid)) for part in drafted.parts]


def test_drafted_pockets_are_one_body_in_every_side(drafted, room) -> None:
    found = figures(shapes_of(drafted), drafted, room)
    assert (found.pockets, found.crowded) == (3 * len(drafted.parts), 0)
    assert max(found.volume_share, found.shape_share) < 1e-6
    assert found.clearance_mm == pytest.approx(room.clearance_mm, abs=1e-5)


def test_a_pocket_of_another_draft_is_named(drafted, room) -> None:
    """By a fifth of a degree: a sixtieth of a millimetre at the inner face."""
    shapes = shapes_of(drafted)
    steeper = pocket(replace(drafted.dimensions, draft_degrees=1.2)).moved(shapes[1].side_frames[2])
    shapes[1] = replace(shapes[1], solid=as_printed(shapes[1].solid - steeper))
    found = figures(shapes, drafted, room)
    assert found.volume_share > 1e-3
    assert f"{drafted.parts[1].name} {drafted.parts[1].handedness} side 3" in found.between


def test_the_wall_between_two_pockets_is_measured(drafted, room) -> None:
    """Between plain boxes as deep and as far apart as the connectors' spaces are."""
    shape, connectors = shapes_of(drafted)[0], [one.solid for one in drafted.connectors]
    assert wall_between_pockets_mm(shape, connectors, room) > room.wall_mm
    beside = shape.side_frames[[0, 0, 2]].copy()
    width = 2 * (max(float(np.abs(one.bounds[:, 0]).max()) for one in connectors) + room.clearance_mm)
    beside[1, :3, 3] += (width + room.wall_mm / 3) * beside[1, :3, 0]
    solid = shape.solid - pocket(drafted.dimensions).moved(beside[1])
    near = wall_between_pockets_mm(replace(shape, side_frames=beside, solid=solid), connectors, room)
    assert near == pytest.approx(room.wall_mm / 3, abs=1e-3)


def test_pockets_within_one_anothers_walls_are_counted_and_left_out(drafted, room) -> None:
    shapes = shapes_of(drafted)
    beside = shapes[0].side_frames[[0, 0, 2]].copy()
    beside[1, :3, 3] += 3 * beside[1, :3, 0]
    shapes[0] = replace(shapes[0], side_frames=beside)
    assert figures(shapes, drafted, room).crowded == 2
    alone = [replace(shape, side_frames=np.repeat(shape.side_frames[:1], 3, axis=0)) for shape in shapes]
    with pytest.raises(ValueError, match="another within its walls"):
        figures(alone, drafted, room)
