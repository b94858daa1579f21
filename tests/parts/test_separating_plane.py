import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drkid.parts.separating_plane import margins_apart


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


@given(st.integers(0, 10**6), st.floats(0.05, 0.8))
def test_the_margin_is_that_of_the_best_plane(seed, height) -> None:
    """Directions on a circle of latitude, all around: the pole is the best normal, and its margin their height."""
    rng = np.random.default_rng(seed)
    angle = np.arange(12) * np.pi / 6 + rng.uniform(0, 1)
    ring = np.stack([np.cos(angle), np.sin(angle), np.full(12, height / np.sqrt(1 - height**2))], axis=1)
    turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    found = margins_apart(unit(ring @ turn)[None], 1.0)
    assert found[0] == pytest.approx(height, abs=1e-3)
    assert found[0] <= height + 1e-12
    assert margins_apart(unit(ring @ turn)[None], height / 2)[0] >= height / 2


@given(st.integers(0, 10**6))
def test_directions_all_around_leave_no_plane(seed) -> None:
    rng = np.random.default_rng(seed)
    ways = unit(rng.standard_normal((4, 3)))
    ways[3] = unit(-ways[:3].sum(axis=0))  # the four surround the origin
    assert margins_apart(ways[None], 1.0)[0] <= 1e-9
