import numpy as np
import pytest

from drkid.parts.dimensions import proposed
from drkid.parts.snap import snap_half
from drkid.solid import Solid
from drkid.spec import PROCESSES, KitSpec

TURNED_ROUND = np.diag([-1.0, -1.0, 1.0, 1.0])


def about_x(degrees: float) -> np.ndarray:
    angle, motion = np.radians(degrees), np.eye(4)
    motion[1:3, 1:3] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return motion


@pytest.mark.parametrize("process", PROCESSES)
def test_half_turns_freely_in_itself_turned_round(process) -> None:
    d = proposed(KitSpec(process=process, connector="snap"), 65.0)
    half = snap_half(d).solid
    for degrees in (-60, -30, 0, 30, 60):
        other = half.moved(about_x(degrees) @ TURNED_ROUND)
        assert (half & other).volume < 1e-9
        assert half.gap(other, 1.0) == pytest.approx(min(d.rod_clearance_mm, d.knuckle_gap_mm), abs=0.01)


def test_clip_holds_the_pin_and_gives_way_by_little() -> None:
    d = proposed(KitSpec(connector="snap"), 65.0)
    half = snap_half(d).solid
    other = half.moved(TURNED_ROUND)
    pulled = np.eye(4)
    pulled[1, 3] = -d.pin_diameter_mm / 2
    caught = half & other.moved(pulled)
    assert 0 < caught.volume < 0.05 * Solid.cylinder_along_x(d.pin_diameter_mm / 2, 0, 2 * d.knuckle_length_mm).volume
    assert half.mesh().is_closed_manifold
    assert half.mesh().component_count == 1
