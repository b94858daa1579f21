"""Hidden surfaces in line drawings: flat polygons in an order in which each may be painted over those before it.

The order comes from depth at sampled points (Catmull's z-buffer, all layers kept), not from the depth of whole
polygons: of two polygons that overlap in the picture, the nearer one there is painted later. Polygons that overlap
one another in a circle are halved until they do not (Newell, Newell and Sancha 1972).
"""

import heapq
from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from drkid.mesh import Bools, Floats, Ints

MOST_HALVINGS = 6
TOUCHING = 1e-6  # of the picture's size: layers that are nearer to one another touch, and either may be painted first


@dataclass(frozen=True, eq=False)
class Painted:
    """Polygons (n, 3) in view coordinates, from back to front, the number each had before, and its share in view.

    `seen` counts samples at which nothing covers a polygon; polygons without any are left out.
    """

    polygons: tuple[Floats, ...]
    source: Ints
    seen: Ints


def painted(polygons: list[Floats], samples: int) -> Painted:
    """Convex polygons (n, 3) that look at the viewer (x right, y up, z to the eye), in painting order.

    Depth is compared on a grid with `samples` points along the picture's longer side.
    """
    source = np.arange(len(polygons))
    behind, front, seen = _overlaps(polygons, samples)
    for _ in range(MOST_HALVINGS):
        circular = _in_circles(len(polygons), behind, front)
        if not circular.any():
            break
        parts = [_halved(p) if split else [p] for p, split in zip(polygons, circular, strict=True)]
        source = np.repeat(source, [len(part) for part in parts])
        polygons = [half for part in parts for half in part]
        behind, front, seen = _overlaps(polygons, samples)
    order = [i for i in _sorted(polygons, behind, front) if seen[i]]
    return Painted(tuple(polygons[i] for i in order), source[order], seen[order])


def _halved(polygon: Floats) -> list[Floats]:
    """Two halves, cut across from the middle of the longest side."""
    count = len(polygon)
    longest = int(np.linalg.norm(np.roll(polygon, -1, axis=0) - polygon, axis=1).argmax())
    ring = np.roll(polygon, -longest, axis=0)
    middle = (ring[0] + ring[1]) / 2
    if count == 3:
        return [np.stack([middle, ring[1], ring[2]]), np.stack([middle, ring[2], ring[0]])]
    opposite = 1 + count // 2
    return [np.stack([middle, *ring[1 : opposite + 1]]), np.stack([middle, *ring[opposite:], ring[0]])]


def _overlaps(polygons: list[Floats], samples: int) -> tuple[Ints, Ints, Ints]:
    """Pairs (behind, in front) that follow one another at a sample, each once; and samples at which each is seen."""
    points = np.concatenate(polygons)
    low, size = points.min(axis=0), max(float(np.ptp(points[:, :2], axis=0).max()), 1e-9)
    corners, owner = triangulated(polygons)
    pairs, seen = _layers((corners - low) * (samples / size), owner, samples + 1, len(polygons), TOUCHING * samples)
    keys = np.unique(pairs)
    return keys // len(polygons), keys % len(polygons), seen


def triangulated(polygons: list[Floats]) -> tuple[Floats, Ints]:
    """(n, 3, 3): convex polygons as fans of triangles, and the polygon (n,) that each is of."""
    sizes = np.array([len(p) for p in polygons])
    first = np.repeat(np.cumsum(sizes) - sizes, sizes - 2)
    owner = np.repeat(np.arange(len(polygons)), sizes - 2)
    fan = np.arange(len(owner)) - np.repeat(np.cumsum(sizes - 2) - (sizes - 2), sizes - 2) + 1
    return np.concatenate(polygons)[np.stack([first, first + fan, first + fan + 1], axis=1)], owner


@njit(cache=True)
def _layers(corners: Floats, owner: Ints, side: int, count: int, touching: float) -> tuple[Ints, Ints]:
    # All layers at every sample, sorted by depth: pairs that follow one another, as behind * count + front, and how
    # often each of `count` polygons is the nearest. A pair that was met just before is not told again.
    start = np.zeros(side * side + 1, np.int64)
    which, depth = np.empty(0, np.int64), np.empty(0)
    for writing in range(2):
        filled = start[:-1].copy()
        for f in range(len(corners)):
            a, b, c = corners[f, 0], corners[f, 1], corners[f, 2]
            area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
            if area <= 0:
                continue
            x0, x1 = int(min(a[0], b[0], c[0])), min(side - 1, int(max(a[0], b[0], c[0])) + 1)
            y0, y1 = int(min(a[1], b[1], c[1])), min(side - 1, int(max(a[1], b[1], c[1])) + 1)
            for row in range(y0, y1 + 1):
                for column in range(x0, x1 + 1):
                    x, y = column + 0.5, row + 0.5
                    u = ((b[0] - x) * (c[1] - y) - (b[1] - y) * (c[0] - x)) / area
                    v = ((c[0] - x) * (a[1] - y) - (c[1] - y) * (a[0] - x)) / area
                    if u < 0 or v < 0 or u + v > 1:
                        continue
                    cell = row * side + column
                    if not writing:
                        start[cell + 1] += 1
                        continue
                    z, at = u * a[2] + v * b[2] + (1 - u - v) * c[2], filled[cell]
                    while at > start[cell] and depth[at - 1] > z:
                        depth[at], which[at] = depth[at - 1], which[at - 1]
                        at -= 1
                    depth[at], which[at] = z, owner[f]
                    filled[cell] += 1
        if not writing:
            start = np.cumsum(start)
            which, depth = np.empty(start[-1], np.int64), np.empty(start[-1])
    pairs, told = np.empty(len(which), np.int64), 0
    last, seen = np.full(count, -1), np.zeros(count, np.int64)
    for cell in range(side * side):
        for at in range(start[cell], start[cell + 1] - 1):
            a, b = which[at], which[at + 1]
            if a != b and depth[at + 1] - depth[at] > touching and last[a] != b:
                last[a] = b
                pairs[told] = a * count + b
                told += 1
        if start[cell + 1] > start[cell]:
            seen[which[start[cell + 1] - 1]] += 1
    return pairs[:told], seen


def _in_circles(count: int, behind: Ints, front: Ints) -> Bools:
    """Mask (count,): polygons that are, over others, in front of themselves."""
    graph = coo_array((np.ones(len(behind)), (behind, front)), shape=(count, count))
    label = connected_components(graph, directed=True, connection="strong")[1]
    return np.bincount(label)[label] > 1


def _sorted(polygons: list[Floats], behind: Ints, front: Ints) -> list[int]:
    """Kahn's topological order, the farthest first where there is a choice; what is left of circles comes by depth."""
    depth = [float(p[:, 2].mean()) for p in polygons]
    above: list[list[int]] = [[] for _ in polygons]
    for a, b in zip(behind.tolist(), front.tolist(), strict=True):
        above[a].append(b)
    waits = np.bincount(front, minlength=len(polygons)).tolist()
    ready = [(depth[i], i) for i, n in enumerate(waits) if n == 0]
    heapq.heapify(ready)
    left = dict.fromkeys(sorted(range(len(polygons)), key=depth.__getitem__))
    order: list[int] = []
    while left:
        i = heapq.heappop(ready)[1] if ready else next(iter(left))
        if i not in left:
            continue
        del left[i]
        order.append(i)
        for j in above[i]:
            waits[j] -= 1
            if waits[j] == 0:
                heapq.heappush(ready, (depth[j], j))
    return order
