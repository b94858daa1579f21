import numpy as np
import pytest

from drkid.parts.dimensions import proposed
from drkid.parts.key import box_key, largest_bend_degrees
from drkid.parts.pocket import pocket
from drkid.spec import KitSpec


def test_key_is_symmetric_and_keeps_its_clearance() -> None:
    d = proposed(KitSpec(connector="box"), 40.0)
    key = box_key(d).solid
    assert (key & key.moved(np.diag([1.0, -1, 1, 1]))).volume == pytest.approx(key.volume)
    low, high = key.bounds
    pocket_high = pocket(d).bounds[1]
    assert pocket_high - high == pytest.approx([d.clearance_mm, 2 * d.clearance_mm, d.clearance_mm])
    assert low == pytest.approx(-high)
    assert min(high - low) >= d.min_wall_mm


def test_straight_key_follows_only_slight_bends() -> None:
    loose, tight = (proposed(KitSpec(connector="box", clearance_mm=c), 40.0) for c in (0.4, 0.1))
    assert 0 < largest_bend_degrees(tight) < largest_bend_degrees(loose) < 15
