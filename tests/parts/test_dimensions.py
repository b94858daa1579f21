import numpy as np
import pytest

from drkid.errors import FitError
from drkid.parts.dimensions import deepest_bevel_mm, half_width_mm, proposals, proposed, reach_mm
from drkid.spec import PROCESSES, KitSpec

# published smallest thickness per process, mm
THICKNESS = {"fdm": 6.9, "sla": 5.1, "polyjet": 5.1, "injection": 5.3}


@pytest.mark.parametrize("process", PROCESSES)
def test_hinge_dimensions_follow_the_process(process) -> None:
    preset = PROCESSES[process]
    d = proposed(KitSpec(process=process), 60.0)
    assert d.rod_diameter_mm in preset.rods_mm
    assert d.rod_diameter_mm + 2 * d.rod_clearance_mm >= preset.min_hole_mm
    assert d.barrel_diameter_mm == pytest.approx(d.rod_diameter_mm + 2 * (d.rod_clearance_mm + d.knuckle_wall_mm))
    assert d.pocket_height_mm == pytest.approx(d.barrel_diameter_mm + 2 * d.clearance_mm)
    grip = max(d.barrel_diameter_mm, 3.0)
    assert d.pocket_depth_mm == pytest.approx(d.barrel_diameter_mm / 2 + 2 * d.clearance_mm + grip)
    assert d.rod_length_mm == pytest.approx(d.pocket_width_mm - 2 * d.clearance_mm)
    assert 0 <= d.thickness_mm - (d.pocket_height_mm + 2 * d.min_wall_mm) < 0.1
    assert d.thickness_mm == pytest.approx(THICKNESS[process])


def test_what_the_user_gives_is_kept() -> None:
    given = {
        "clearance_mm": 0.3,
        "rod_clearance_mm": 0.12,
        "rod_diameter_mm": 2.5,
        "min_wall_mm": 1.4,
        "knuckle_wall_mm": 1.1,
        "thickness_mm": 9.0,
        "knuckles": 4,
    }
    d = proposed(KitSpec(**given), 40.0)
    assert {name: getattr(d, name) for name in given} == given
    assert d.rod_length_mm == pytest.approx(4 * d.knuckle_length_mm + 3 * d.knuckle_gap_mm)


@pytest.mark.parametrize("connector", ["hinge", "box"])
def test_too_thin_is_refused_with_both_thicknesses(connector) -> None:
    needed = proposed(KitSpec(connector=connector), 40.0)
    with pytest.raises(FitError) as caught:
        proposed(KitSpec(connector=connector, thickness_mm=3.0), 40.0)
    leaning = np.cos(np.radians(needed.key_bend_degrees / 2))
    least = needed.pocket_height_mm / leaning + 2 * needed.min_wall_mm
    assert f"{least:.2f}" in caught.value.wanted
    assert caught.value.found == "3"
    assert "rod" in caught.value.remedy


def test_without_connector_there_is_no_pocket() -> None:
    d = proposed(KitSpec(connector="none"), 40.0)
    assert d.pocket_width_mm == d.pocket_depth_mm == d.pocket_height_mm == d.rod_diameter_mm == d.rod_length_mm == 0
    assert d.thickness_mm >= 2 * d.min_wall_mm
    assert deepest_bevel_mm(d) == float("inf")
    assert proposed(KitSpec(connector="none", thickness_mm=1.0), 40.0).thickness_mm == 1.0


@pytest.mark.parametrize("connector", ["hinge", "box"])
def test_bevels_leave_the_connector_some_hold(connector) -> None:
    d = proposed(KitSpec(connector=connector), 40.0)
    assert d.barrel_diameter_mm / 2 < deepest_bevel_mm(d) < reach_mm(d) - 0.5
    assert half_width_mm(d) == pytest.approx(d.pocket_width_mm / 2 - d.clearance_mm)


def test_sharp_joints_get_a_longer_grip_only_when_they_need_it() -> None:
    depth = [proposed(KitSpec(), bend).pocket_depth_mm for bend in (0.0, 90.0, 110.0, 140.0, 170.0)]
    assert depth[0] == depth[1] == depth[2] < depth[3]
    assert depth[3] == depth[4]


def test_a_hinge_is_proposed_for_every_rod_and_number_of_knuckles() -> None:
    found = proposals(KitSpec(), 40.0)
    assert {(d.rod_diameter_mm, d.knuckles) for d in found} == {(r, n) for r in (1.75, 2.0, 3.0) for n in (2, 4, 6, 8)}
    assert found[0] == proposed(KitSpec(), 40.0)
    thin = proposals(KitSpec(thickness_mm=7.2), 40.0)
    assert {d.rod_diameter_mm for d in thin} == {1.75, 2.0}


def test_a_snap_has_a_pin_and_no_rod() -> None:
    d = proposed(KitSpec(connector="snap"), 40.0)
    assert d.rod_diameter_mm == d.rod_length_mm == 0
    assert d.barrel_diameter_mm == pytest.approx(d.pin_diameter_mm + 2 * (d.rod_clearance_mm + d.min_wall_mm))
