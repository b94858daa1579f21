import numpy as np
from scipy.spatial import cKDTree

from drkid.measure import distance_to_surface, sample
from drkid.remesh.farthest_point import farthest_points


def test_points_lie_on_the_surface_and_apart(blob):
    points = farthest_points(blob, 100, np.random.default_rng(3))
    assert points.shape == (100, 3)
    assert distance_to_surface(blob, points).max() < 1e-12
    nearest = cKDTree(points).query(points, k=2)[0][:, 1]
    random = sample(blob, 100, np.random.default_rng(3))
    assert nearest.min() > 3 * cKDTree(random).query(random, k=2)[0][:, 1].min()


def test_the_seed_decides(blob):
    one, again, other = (farthest_points(blob, 20, np.random.default_rng(seed)) for seed in (0, 0, 1))
    assert np.array_equal(one, again)
    assert not np.array_equal(one, other)


def test_later_points_never_come_closer_than_they_had_to(blob):
    points = farthest_points(blob, 60, np.random.default_rng(0))
    gaps = [cKDTree(points[:k]).query(points[k])[0] for k in range(1, 60)]
    assert all(np.diff(gaps) <= 0)
