"""K-means in the space of triangles.

The paper hands k-means the n × n matrix of mutual distances. Clustering the n points themselves minimises the
paper's own energy (equation 1) directly, in O(nk) memory, so that the matrix is not needed.
"""

import warnings

import numpy as np
from scipy.cluster.vq import kmeans2

from drkid.congruence.triangle_space import class_means, clustering_error
from drkid.mesh import Floats, Ints

LLOYD_ITERATIONS = 30  # k-means on a few hundred points has settled by then


def cluster(points: Floats, classes: int, rng: np.random.Generator, restarts: int = 1) -> tuple[Floats, Ints]:
    """Class means (k, 3) and class of each point (F,), the best of `restarts` k-means++ starts by energy.

    Where there are no more different points than classes each is a class of its own, and the others are empty.
    """
    different, label = np.unique(points, axis=0, return_inverse=True)
    if len(different) <= classes:
        return np.resize(different, (classes, 3)), label.ravel().astype(np.int64)
    starts = [_kmeans(points, classes, rng) for _ in range(restarts)]
    return min(starts, key=lambda start: clustering_error(points, start[1], start[0]).energy)


def _kmeans(points: Floats, classes: int, rng: np.random.Generator) -> tuple[Floats, Ints]:
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="One of the clusters is empty", category=UserWarning)
        seeds, label = kmeans2(points, classes, iter=LLOYD_ITERATIONS, minit="++", rng=rng)
    label = np.asarray(label, np.int64)
    means = class_means(points, label, classes)
    return np.where(np.isnan(means), np.asarray(seeds), means), label
