import numpy as np
import pytest

from drkid.parts.detent import bump, groove
from drkid.parts.dimensions import proposed, reach_mm
from drkid.parts.hinge import hinge_half
from drkid.parts.pocket import pocket
from drkid.solid import Solid
from drkid.spec import PROCESSES, KitSpec


@pytest.mark.parametrize("process", PROCESSES)
def test_bump_springs_past_and_sits_with_the_clearance(process) -> None:
    d = proposed(KitSpec(process=process), 60.0)
    ridge, space = bump(d), pocket(d)
    assert ridge is not None
    assert d.clearance_mm < ridge.height == d.detent_mm
    block = Solid.box((-20, 0, -d.thickness_mm / 2), (20, 20, d.thickness_mm / 2)) - space
    half = hinge_half(d).solid
    assert (half & block).volume < 1e-9
    assert half.gap(block, 1.0) == pytest.approx(d.clearance_mm, abs=1e-3)
    pulled = np.eye(4)
    pulled[2, 3] = -2 * ridge.half_base
    caught = (half.moved(pulled) & block).volume
    assert 0 < caught < 1.0
    assert ridge.end < reach_mm(d)


def test_glue_needs_no_bump() -> None:
    d = proposed(KitSpec(retention="glue"), 60.0)
    assert d.detent_mm == 0
    assert bump(d) is None
    assert groove(d) is None
