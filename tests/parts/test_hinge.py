import numpy as np
import pytest

from drkid.parts.dimensions import half_width_mm, proposed, reach_mm
from drkid.parts.hinge import hinge_half
from drkid.solid import Solid
from drkid.spec import PROCESSES, KitSpec

TURNED_ROUND = np.diag([-1.0, -1.0, 1.0, 1.0])


def about_x(degrees: float) -> np.ndarray:
    angle, motion = np.radians(degrees), np.eye(4)
    motion[1:3, 1:3] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return motion


@pytest.mark.parametrize("process", PROCESSES)
@pytest.mark.parametrize("knuckles", [2, 4])
@pytest.mark.parametrize("bend", [0, 60, 109, 135])
def test_half_mates_with_itself_turned_round(process, knuckles, bend) -> None:
    d = proposed(KitSpec(process=process, knuckles=knuckles), bend + 5.5)
    half = hinge_half(d).solid
    for degrees in (bend - 5, bend, bend + 5, -bend - 5):
        other = half.moved(about_x(degrees) @ TURNED_ROUND)
        assert (half & other).volume < 1e-9
        assert half.gap(other, 1.0) > 0.05


@pytest.mark.parametrize("process", PROCESSES)
def test_bore_wall_and_outline_are_as_stated(process) -> None:
    d = proposed(KitSpec(process=process), 60.0)
    half = hinge_half(d).solid
    bore = d.rod_diameter_mm / 2 + d.rod_clearance_mm
    rod = Solid.cylinder_along_x(d.rod_diameter_mm / 2, -30, 30)
    assert half.gap(rod, 1.0) == pytest.approx(d.rod_clearance_mm, abs=0.01)
    barrel = Solid.cylinder_along_x(d.barrel_diameter_mm / 2 + 1e-4, -30, 30)
    assert bore + d.knuckle_wall_mm == pytest.approx(d.barrel_diameter_mm / 2)
    assert (half - barrel).bounds[0, 1] > 0
    x, reach = half_width_mm(d), reach_mm(d)
    radius, wide = d.barrel_diameter_mm / 2, x + d.detent_mm
    assert half.bounds == pytest.approx(np.array([[-wide, -radius, -radius], [wide, reach, radius]]))
    assert half.mesh().is_closed_manifold
    assert half.mesh().component_count == 1


def test_both_halves_fill_every_knuckle_place_once() -> None:
    d = proposed(KitSpec(knuckles=4), 40.0)
    half = hinge_half(d).solid
    probe = Solid.box((-50, -1, -5), (50, 1, 5))
    pitch = d.knuckle_length_mm + d.knuckle_gap_mm
    both = (half + half.moved(TURNED_ROUND)) & probe
    places = [-half_width_mm(d) + k * pitch for k in range(4)]
    for start in places:
        place = Solid.box((start, -9, -9), (start + d.knuckle_length_mm, 9, 9))
        assert (both & place).volume == pytest.approx(both.volume / 4)
