"""Simple points: voxels that may change sides without a change of topology.

Bertrand and Malandain, "A new characterization of three-dimensional simple points", Pattern Recognition Letters 15
(1994), for objects that are 26-connected and backgrounds that are 6-connected. Inner loops; they take plain arrays.
"""

from heapq import heappop, heappush
from itertools import product

import numpy as np
import scipy.ndimage as ndi
from numba import njit
from numpy.typing import NDArray

from drkid.mesh import Floats

_STEPS = np.array(list(product((-1, 0, 1), repeat=3)))  # the 27 places of a neighbourhood, the centre at 13
_CENTRE = 13
HALF = 13  # of 26 neighbours
TIE_VOXELS, TIE_WEIGHT = 1.0, 1e-3  # how far around a voxel looks, and how little that counts beside its own distance


def _bits(chosen: NDArray[np.bool_]) -> int:
    return int(sum(1 << int(place) for place in np.flatnonzero(chosen)))


_APART = np.abs(_STEPS[:, None] - _STEPS[None])
_NEAR_18 = np.abs(_STEPS).sum(axis=1) <= 2
_NEAR_18[_CENTRE] = False
_FACES = _bits(np.abs(_STEPS).sum(axis=1) == 1)
_WITHIN_18 = _bits(_NEAR_18)
_TOUCHING = np.array([_bits(row.max(axis=1) == 1) & ~(1 << _CENTRE) for row in _APART], np.int64)
_SIDE_BY_SIDE = np.array([_bits(row.sum(axis=1) == 1) & _WITHIN_18 for row in _APART], np.int64)


@njit(cache=True)
def _flooded(start: int, within: int, beside: NDArray[np.int64]) -> int:
    """The places of `within` that can be reached from those of `start`."""
    seen = start
    fresh = start
    while fresh:
        reached = 0
        for place in range(27):
            if (fresh >> place) & 1:
                reached |= beside[place]
        fresh = reached & within & ~seen
        seen |= fresh
    return seen


@njit(cache=True)
def _neighbourhood(inside: NDArray[np.uint8], x: int, y: int, z: int) -> int:
    """The 26 neighbours that are inside, as bits."""
    found = 0
    place = 0
    for i in range(x - 1, x + 2):
        for j in range(y - 1, y + 2):
            for k in range(z - 1, z + 2):
                if place != 13 and inside[i, j, k]:
                    found |= 1 << place
                place += 1
    return found


@njit(cache=True)
def is_simple(inside: NDArray[np.uint8], x: int, y: int, z: int) -> bool:
    """Whether the voxel, inside or outside, touches one piece of the object and one of the background around it."""
    near = _neighbourhood(inside, x, y, z)
    faces = _FACES & ~near
    if near == 0 or faces == 0:
        return False
    if _flooded(near & -near, near, _TOUCHING) != near:
        return False
    return (_flooded(faces & -faces, _WITHIN_18 & ~near, _SIDE_BY_SIDE) & faces) == faces


@njit(cache=True)
def _wanted(inside: NDArray[np.uint8], target: NDArray[np.uint8], x: int, y: int, z: int) -> bool:
    """Whether the voxel is on the wrong side, next to one of the other side, and off the array's ends."""
    if inside[x, y, z] == target[x, y, z]:
        return False
    if x == 0 or y == 0 or z == 0 or x == inside.shape[0] - 1 or y == inside.shape[1] - 1 or z == inside.shape[2] - 1:
        return False
    near = _neighbourhood(inside, x, y, z)
    return near != (1 << 27) - 1 - (1 << 13) if inside[x, y, z] else near != 0


@njit(cache=True)
def deform(inside: NDArray[np.uint8], target: NDArray[np.uint8], order: NDArray[np.float32]) -> None:
    """Move the object `inside`, in place, towards `target` by simple points alone, lowest `order` first.

    Its topology stays; where it differs from the target's, a sheet of voxels stays on the wrong side (Aktouf, Bertrand
    and Perroton, "A three-dimensional holes closing algorithm", Pattern Recognition Letters 23, 2002). The order is
    that of a front: it decides where the sheets come to lie.
    """
    nx, ny, nz = inside.shape
    queued = np.zeros(inside.shape, np.uint8)
    heap = [(np.float32(0), 0)]
    heap.pop()
    for x, y, z in np.ndindex((nx, ny, nz)):
        if _wanted(inside, target, x, y, z):
            queued[x, y, z] = 1
            heappush(heap, (np.float32(order[x, y, z]), (x * ny + y) * nz + z))
    while heap:
        _, at = heappop(heap)
        x, y, z = at // (ny * nz), (at // nz) % ny, at % nz
        queued[x, y, z] = 0
        if not is_simple(inside, x, y, z):
            continue
        inside[x, y, z] = target[x, y, z]
        for a, b, c in np.ndindex((3, 3, 3)):
            i, j, k = x + a - 1, y + b - 1, z + c - 1
            if not queued[i, j, k] and _wanted(inside, target, i, j, k):
                queued[i, j, k] = 1
                heappush(heap, (np.float32(order[i, j, k]), (i * ny + j) * nz + k))


@njit(cache=True)
def even_out(inside: NDArray[np.uint8], side: int, rounds: int) -> None:
    """Give to `side`, in place, simple points most of whose neighbours are on it already: a grid's curvature flow."""
    nx, ny, nz = inside.shape
    for _ in range(rounds):
        due = [0]
        due.pop()
        for i, j, k in np.ndindex((nx - 2, ny - 2, nz - 2)):
            x, y, z = i + 1, j + 1, k + 1
            if inside[x, y, z] != side and _on_side(inside, side, x, y, z) >= HALF:
                due.append((x * ny + y) * nz + z)
        changed = False
        for at in due:
            x, y, z = at // (ny * nz), (at // nz) % ny, at % nz
            if is_simple(inside, x, y, z):
                inside[x, y, z] = side
                changed = True
        if not changed:
            return


@njit(cache=True)
def _on_side(inside: NDArray[np.uint8], side: int, x: int, y: int, z: int) -> int:
    """How many of the 26 neighbours are on a side."""
    near = _neighbourhood(inside, x, y, z)
    count = 0
    while near:
        near &= near - 1
        count += 1
    return count if side else 26 - count


def order_of(distance: Floats) -> NDArray[np.float32]:
    """What is farthest comes first; of what is equally far, what has more that is far around it.

    Without the second, a front takes voxels of a sheet one deep in the order of the array, and the gap that it leaves
    lies anywhere; with it, the narrowest place is taken last and the gap is there.
    """
    around = ndi.gaussian_filter(distance, TIE_VOXELS)
    return np.ascontiguousarray(-(distance + TIE_WEIGHT * around), dtype=np.float32)
