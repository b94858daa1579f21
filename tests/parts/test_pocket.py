import numpy as np
import pytest

from drkid.class_triangle import laid_down
from drkid.parts.dimensions import proposed
from drkid.parts.pocket import flare_mm, pocket, side_frames
from drkid.spec import KitSpec


def test_side_frames_are_proper_motions_onto_the_sides() -> None:
    triangle = laid_down(np.array([28.0, 31.0, 33.0]))
    frames = side_frames(triangle)
    for side, frame in enumerate(frames):
        half = np.linalg.norm(np.roll(triangle, -1, axis=0)[side] - triangle[side]) / 2
        ends = frame @ np.array([[-half, 0, 0, 1], [half, 0, 0, 1]]).T
        wanted = np.column_stack([triangle[side], triangle[(side + 1) % 3]])
        assert ends[:2] == pytest.approx(wanted)
        assert frame[:3, :3] @ frame[:3, :3].T == pytest.approx(np.eye(3), abs=1e-12)
        assert np.linalg.det(frame) == pytest.approx(1)
        assert frame[:2, 1] @ -frame[:2, 3] > 0
        assert frame[:3, 2].tolist() == [0, 0, 1]


def test_pocket_is_open_inwards_and_outwards_and_closed_elsewhere() -> None:
    d = proposed(KitSpec(retention="glue"), 40.0)
    low, high = pocket(d).bounds
    assert high == pytest.approx([d.pocket_width_mm / 2, d.pocket_depth_mm, d.pocket_height_mm / 2])
    assert low[0] == -high[0]
    assert low[2] < -d.thickness_mm / 2
    assert low[1] < -d.thickness_mm


def test_drafted_pocket_widens_from_its_roof_to_the_inner_face() -> None:
    d = proposed(KitSpec(process="injection", retention="glue"), 40.0)
    space = pocket(d)
    widths = [np.ptp(space.cross_section(z)[0][:, 0]) for z in (d.pocket_height_mm / 2 - 1e-6, -d.thickness_mm / 2)]
    assert widths[0] == pytest.approx(d.pocket_width_mm, abs=1e-5)
    assert widths[1] == pytest.approx(d.pocket_width_mm + 2 * flare_mm(d, -d.thickness_mm / 2))
    assert flare_mm(d, -d.thickness_mm / 2) == pytest.approx(
        (d.pocket_height_mm + d.thickness_mm) / 2 * 0.017455, rel=1e-3
    )
