"""Separating plane: the plane through a common vertex that has two pieces on either side, by the widest margin."""

import numpy as np
from numba import njit

from drkid.mesh import Floats

STEPS = 2000
NOWHERE = 1e-12


def margins_apart(directions: Floats, wanted: float) -> Floats:
    """(n,): for each set of unit vectors (n, m, 3) the largest of min normal·direction over all unit normals.

    The directions are those to the points of one piece and those away from the points of the other: the margin is
    positive where a plane has both on either side. Exact up to where it exceeds `wanted`, then at least that.
    """
    return _margins(np.ascontiguousarray(directions), wanted)


@njit(cache=True)
def _margins(directions: Floats, wanted: float) -> Floats:
    found = np.empty(len(directions))
    for n in range(len(directions)):
        found[n] = _margin(directions[n], wanted)
    return found


@njit(cache=True)
def _margin(directions: Floats, wanted: float) -> float:
    # The best normal points to the nearest point of the convex hull of the directions. Gilbert's algorithm (1966) walks
    # there: from where it stands straight towards the direction that is farthest behind.
    at, best = np.zeros(3), -1.0
    for one in directions:
        at += one / len(directions)
    for _ in range(STEPS):
        length = np.sqrt((at * at).sum())
        if length < NOWHERE:
            return best
        last, least = _farthest_behind(directions, at)
        best = max(best, least / length)
        way = directions[last] - at
        square = (way * way).sum()
        if best >= wanted or square < NOWHERE:
            return best
        at += min(max(-(at * way).sum() / square, 0.0), 1.0) * way
    return best


@njit(cache=True)
def _farthest_behind(directions: Floats, at: Floats) -> tuple[int, float]:
    last, least = 0, np.inf
    for m in range(len(directions)):
        ahead = directions[m, 0] * at[0] + directions[m, 1] * at[1] + directions[m, 2] * at[2]
        if ahead < least:
            last, least = m, ahead
    return last, least
