import numpy as np
import pytest

from drkid.parts.dimensions import proposed
from drkid.parts.key import box_key
from drkid.parts.pocket import pocket
from drkid.solid import Solid
from drkid.spec import KitSpec


def turned_about_x(degrees: float) -> np.ndarray:
    angle, motion = np.radians(degrees), np.eye(4)
    motion[1:3, 1:3] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return motion


def test_key_is_symmetric_and_keeps_its_clearance() -> None:
    d = proposed(KitSpec(connector="box"), 40.0)
    key = box_key(d).solid
    assert (key & key.moved(np.diag([1.0, -1, 1, 1]))).volume == pytest.approx(key.volume)
    low, high = key.bounds
    pocket_high = pocket(d).bounds[1]
    assert pocket_high - high == pytest.approx([d.clearance_mm, 2 * d.clearance_mm, d.clearance_mm])
    assert low == pytest.approx(-high)
    assert min(high - low) >= d.min_wall_mm


def test_one_key_finds_room_at_every_bend_up_to_that_of_the_kit() -> None:
    d = proposed(KitSpec(connector="box"), 60.0)
    arm = box_key(d).solid & Solid.box((-50, 0, -50), (50, 50, 50))
    assert d.key_bend_degrees == 60.0
    for bend in (60.0, 30.0, 0.0, -40.0):
        # in the frame of a leaning pocket the key lies lower by half of what the joint lacks of the sharpest bend
        held = arm.moved(turned_about_x(-(60.0 - bend) / 2))
        behind_the_side = held - pocket(d)
        assert behind_the_side.volume < 1e-9
    assert (arm.moved(turned_about_x(10.0)) - pocket(d)).volume > 0.1
