from dataclasses import replace

import numpy as np
import pytest

from drkid.mesh import TriMesh
from drkid.parts.coupon import SIDE_GAP_MM, coupon, tried_mm, with_clearance
from drkid.parts.dimensions import proposed
from drkid.parts.hinge import hinge_half
from drkid.parts.pocket import pocket
from drkid.parts.seven_segment import FIGURE_MM, SEGMENTS, figures
from drkid.solid import Solid
from drkid.spec import PROCESSES, KitSpec

SHARPEST = 60.0


def bodies(solid: Solid) -> list[Solid]:
    mesh = solid.mesh()
    return [Solid.of(mesh.submesh(mesh.face_component == k)) for k in range(mesh.component_count)]


def test_clearances_tried_ascend_around_the_chosen_one():
    assert tried_mm(0.2) == (0.1, 0.15, 0.2, 0.25, 0.3)
    assert tried_mm(0.08) == (0.04, 0.06, 0.08, 0.1, 0.12)
    assert tried_mm(0.0) == (0.0, 0.02, 0.04, 0.06, 0.08)


@pytest.mark.parametrize("process", PROCESSES)
def test_two_half_pieces_and_five_pairs_of_halves_lie_on_the_bed(process):
    spec = KitSpec(process=process)
    dimensions = proposed(spec, SHARPEST)
    body = coupon(dimensions, spec)
    assert body.mesh().is_closed_manifold
    parts = sorted(bodies(body), key=lambda part: part.volume)
    assert len(parts) == 12
    assert all(part.bounds[0, 2] == pytest.approx(0) for part in parts)
    assert (np.ptp(body.bounds, axis=0) < [100, 100, 12]).all()
    bars, halves = parts[-2:], parts[:-2]
    assert bars[0].volume == pytest.approx(bars[1].volume)
    assert all(np.ptp(bar.bounds, axis=0)[2] == pytest.approx(dimensions.thickness_mm) for bar in bars)
    assert max(half.volume for half in halves) < bars[0].volume / 10


def test_every_pocket_gives_the_half_its_stated_clearance():
    spec = KitSpec()
    dimensions = proposed(spec, SHARPEST)
    half = hinge_half(dimensions).solid
    block = Solid.box((-20, SIDE_GAP_MM, -dimensions.thickness_mm / 2), (20, 20, dimensions.thickness_mm / 2))
    for value in tried_mm(dimensions.clearance_mm):
        piece = block - pocket(with_clearance(dimensions, value))
        assert piece.gap(half, 1.0) == pytest.approx(value, abs=1e-6)


def test_the_bars_of_the_coupon_take_a_half_in_the_chosen_pocket():
    spec = KitSpec()
    dimensions = proposed(spec, SHARPEST)
    bar = max(bodies(coupon(dimensions, spec)), key=lambda part: (round(part.volume, 3), -part.bounds[0, 1]))
    low, high = bar.bounds
    frame = np.diag([1.0, -1.0, -1.0, 1.0])  # outer face down
    frame[:3, 3] = (low[0] + high[0]) / 2, high[1] + SIDE_GAP_MM, dimensions.thickness_mm / 2
    half = hinge_half(dimensions).solid.moved(frame)
    assert bar.gap(half, 1.0) == pytest.approx(dimensions.clearance_mm, abs=1e-3)


def test_bores_differ_by_their_rod_clearance():
    spec = KitSpec()
    dimensions = proposed(spec, SHARPEST)
    wide = replace(dimensions, rod_clearance_mm=tried_mm(dimensions.rod_clearance_mm)[-1])
    volumes = sorted(round(part.volume, 4) for part in bodies(coupon(dimensions, spec)))[:10]
    assert volumes[::2] == volumes[1::2]  # pairs
    assert len(set(volumes)) == 5
    assert hinge_half(wide).solid.volume < hinge_half(dimensions).solid.volume


def test_a_key_is_tried_in_the_pockets_and_without_connectors_there_is_no_coupon():
    spec = KitSpec(connector="box")
    assert len(bodies(coupon(proposed(spec, SHARPEST), spec))) == 3
    plain = KitSpec(connector="none")
    assert coupon(proposed(plain, SHARPEST), plain) is None


@pytest.mark.parametrize("figure", SEGMENTS)
def test_figures_are_distinct_and_keep_to_their_box(figure):
    def drawn(text: str) -> Solid:
        first, *rest = figures(text, 0.6, 0.4)
        for stroke in rest:
            first += stroke
        return first

    low, high = drawn(figure).bounds
    assert (high[:2] - low[:2] <= np.array(FIGURE_MM) + 1e-9).all()
    assert low[2] == pytest.approx(-0.4)
    mesh: TriMesh = drawn(figure).mesh()
    assert mesh.is_closed_manifold
    difference = {o: (drawn(o) - drawn(figure)).volume + (drawn(figure) - drawn(o)).volume for o in SEGMENTS}
    same = [other for other, volume in difference.items() if volume < 0.01]
    assert same == [figure]
