import numpy as np
import pytest

from drkid.congruence.kmeans import cluster
from drkid.congruence.triangle_space import clustering_error


def blobs(rng: np.random.Generator) -> np.ndarray:
    centres = np.array([[1, 1, 1], [1, 1, 2], [1, 2, 2], [3, 3, 3]], float)
    return (centres[:, None] + 0.01 * rng.normal(size=(4, 30, 3))).reshape(-1, 3)


def test_separate_blobs_become_the_classes():
    points = blobs(np.random.default_rng(0))
    means, label = cluster(points, 4, np.random.default_rng(1), restarts=8)
    for group in label.reshape(4, 30):
        assert len(set(group.tolist())) == 1
    assert np.sort(means[:, 2]) == pytest.approx([1, 2, 2, 3], abs=0.01)


def test_the_same_seed_gives_the_same_classes_and_more_starts_never_a_worse_energy():
    points = np.random.default_rng(3).random((200, 3))
    energies = []
    for restarts in (1, 8):
        means, label = cluster(points, 7, np.random.default_rng(5), restarts)
        again, _ = cluster(points, 7, np.random.default_rng(5), restarts)
        assert (means == again).all()
        energies.append(clustering_error(points, label, means).energy)
    assert energies[1] <= energies[0]


def test_fewer_different_points_than_classes_leave_classes_empty_without_nan():
    points = np.repeat(np.eye(3), 5, axis=0)
    means, label = cluster(points, 5, np.random.default_rng(0))
    assert np.isfinite(means).all()
    assert clustering_error(points, label, means).maximum < 1
