"""Farthest-point sampling of a surface.

Gonzalez, "Clustering to minimize the maximum intercluster distance" (1985); Moenning and Dodgson, "Fast marching
farthest point sampling" (2003), with straight distances here.
"""

import numpy as np
from numba import njit

from drkid.measure import sample
from drkid.mesh import Floats, Ints, TriMesh
from drkid.remesh.sizing_field import SizingField

CANDIDATES = 10  # random points a seed, among which the farthest is taken


@njit(cache=True)
def _farthest(points: Floats, stretch: Floats, count: int, first: int) -> Ints:
    chosen = np.empty(count, np.int64)
    squared = np.full(len(points), np.inf)
    latest = first
    for k in range(count):
        chosen[k] = latest
        x, y, z = points[latest]
        most, farthest = -1.0, 0
        for i in range(len(points)):
            apart = (points[i, 0] - x) ** 2 + (points[i, 1] - y) ** 2 + (points[i, 2] - z) ** 2
            squared[i] = min(squared[i], apart)
            if stretch[i] * squared[i] > most:
                most, farthest = stretch[i] * squared[i], i
        latest = farthest
    return chosen


def farthest_points(
    surface: TriMesh, count: int, rng: np.random.Generator, sizing: SizingField | None = None
) -> Floats:
    """(count, 3): points on the surface, each the farthest of random ones from all before it.

    With a sizing field, distances count in the lengths that edges are to have there.
    """
    weight = None if sizing is None else sizing(surface.corners.mean(axis=1)) ** -2
    points = sample(surface, CANDIDATES * count, rng, weight)
    stretch = np.ones(len(points)) if sizing is None else sizing(points) ** -2
    chosen: Ints = _farthest(points, stretch, count, int(rng.integers(len(points))))
    return points[chosen]
