import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from drkid.rigid_fit import rigid_fit


@given(st.integers(0, 10_000))
def test_a_motion_is_found_again(seed) -> None:
    rng = np.random.default_rng(seed)
    source = rng.standard_normal((4, 3, 3)) * [1, 1, 0]  # triangles lie in a plane: no help from a third dimension
    rotation, shift = Rotation.random(4, rng=rng).as_matrix(), rng.standard_normal((4, 3))
    motion = rigid_fit(source, source @ np.swapaxes(rotation, 1, 2) + shift[:, None])
    assert motion[:, :3, :3] == pytest.approx(rotation, abs=1e-6)
    assert motion[:, :3, 3] == pytest.approx(shift, abs=1e-6)


@given(st.integers(0, 10_000))
def test_any_fit_is_a_proper_motion_that_no_other_betters(seed) -> None:
    rng = np.random.default_rng(seed)
    source, target = rng.standard_normal((2, 3, 3))
    motion = rigid_fit(source, target)
    rotation = motion[:3, :3]
    assert np.abs(rotation @ rotation.T - np.eye(3)).max() < 1e-12
    assert abs(np.linalg.det(rotation) - 1) < 1e-12
    assert motion[3].tolist() == [0, 0, 0, 1]

    def misfit(turn) -> float:
        return float((((source - source.mean(axis=0)) @ turn.T - (target - target.mean(axis=0))) ** 2).sum())

    for nudge in Rotation.from_rotvec(0.05 * rng.standard_normal((20, 3))).as_matrix():
        assert misfit(rotation) <= misfit(nudge @ rotation) + 1e-12
