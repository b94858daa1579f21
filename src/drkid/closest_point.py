"""Closest points on a triangle mesh, compiled and without the interpreter's lock.

A bounding volume hierarchy over the triangles, halved at the median along the longest axis, or along Morton's curve,
which is made in a fraction of the time; a query starts from a triangle that is near already and visits only boxes that
are nearer (Ericson 2005, sections 5.1.5 and 6.2).
"""

import os
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
from numba import njit

from drkid.mesh import Floats, Ints, TriMesh

LEAF = 4  # least number of triangles in a leaf
MORTON_BITS = 15  # of each coordinate
CHUNK = 2048  # points that one thread looks for at a time, along Morton's curve
DEEPEST = 64  # levels of any tree, and more than its stack ever holds


class TriangleTree(NamedTuple):
    """A complete binary tree: node i has the children 2 i and 2 i + 1, the root is node 1, the last half are leaves.

    `low`, `high` (2 L, 3) bound the nodes; the slots of leaf number n are [n m, (n + 1) m) of `corners` (L m, 3, 3) and
    `face` (L m,), the triangles' numbers in the mesh. A few triangles stand in two slots to fill the leaves.
    """

    low: Floats
    high: Floats
    corners: Floats
    face: Ints


@njit(cache=True, _nrt=False)
def _select(values: Floats, order: Ints, first: int, last: int, middle: int) -> None:
    """Sort `order` between `first` and `last` so far that `middle` parts smaller values from larger (Hoare 1961)."""
    while last - first > 1:
        pivot = values[order[(first + last) // 2]]
        i, j = first, last - 1
        while i <= j:
            while values[order[i]] < pivot:
                i += 1
            while values[order[j]] > pivot:
                j -= 1
            if i <= j:
                order[i], order[j] = order[j], order[i]
                i += 1
                j -= 1
        if middle <= j:
            last = j + 1
        elif middle >= i:
            first = i
        else:
            break


@njit(cache=True, nogil=True)
def _halved(centroids: Floats, order: Ints, depth: int) -> None:
    """Sort `order` into the slots of leaves, halving every group at the median along its longest axis."""
    for level in range(depth):
        size = len(order) >> level
        for first in range(0, len(order), size):
            axis, longest = 0, -1.0
            for r in range(3):
                low, high = np.inf, -np.inf
                for slot in order[first : first + size]:
                    low, high = min(low, centroids[r, slot]), max(high, centroids[r, slot])
                if high - low > longest:
                    axis, longest = r, high - low
            _select(centroids[axis], order, first, first + size, first + size // 2)


def triangle_tree(mesh: TriMesh) -> TriangleTree:
    """The tree of a mesh's triangles; one is enough."""
    depth = _depth(mesh)
    order = _filled(np.arange(len(mesh.faces)), depth)
    _halved(np.ascontiguousarray(mesh.middles.T), order, depth)
    return _bounded(mesh, order, depth)


def morton_tree(mesh: TriMesh) -> TriangleTree:
    """The same for few queries: made in a tenth of the time, its boxes overlap more.

    Triangles stand in the order of Morton's curve (Karras, "Maximizing parallelism in the construction of BVHs,
    octrees, and k-d trees", 2012, section 3).
    """
    depth = _depth(mesh)
    return _bounded(mesh, _filled(morton_order(mesh.middles), depth), depth)


def morton_order(points: Floats) -> Ints:
    """(n,): the order of points (n, 3) along Morton's curve, which visits neighbours one after the other, mostly."""
    if not len(points):
        return np.empty(0, np.int64)
    away = points - points.min(axis=0)
    place = (away * ((2**MORTON_BITS - 1) / (away.max() or 1.0))).astype(np.int64)
    code = np.zeros(len(points), np.int64)
    for axis in range(3):
        bits = place[:, axis]
        for shift, mask in ((16, 0x0000FF0000FF), (8, 0x00F00F00F00F), (4, 0x0C30C30C30C3), (2, 0x249249249249)):
            bits = (bits | (bits << shift)) & mask
        code |= bits << axis
    return np.argsort(code, kind="stable")


def _depth(mesh: TriMesh) -> int:
    return max(int(np.log2(max(len(mesh.faces) / LEAF, 1))), 0)


def _filled(order: Ints, depth: int) -> Ints:
    """The order with some triangles twice, so that all leaves have the same number."""
    return np.resize(order, -(-len(order) // 2**depth) * 2**depth)


def _bounded(mesh: TriMesh, order: Ints, depth: int) -> TriangleTree:
    leaves = 2**depth
    corners = np.ascontiguousarray(mesh.corners[order])
    low, high = np.zeros((2 * leaves, 3)), np.zeros((2 * leaves, 3))
    boxes = corners.reshape(leaves, -1, 3)
    for extreme, ends in ((np.minimum, low), (np.maximum, high)):  # of two arrays: an axis of length two is slow
        ends[leaves:] = boxes[:, 0]
        for corner in range(1, boxes.shape[1]):
            extreme(ends[leaves:], boxes[:, corner], out=ends[leaves:])
        for first in (2**level for level in range(depth - 1, -1, -1)):
            children = ends[2 * first : 4 * first]
            extreme(children[::2], children[1::2], out=ends[first : 2 * first])
    return TriangleTree(low, high, corners, order.astype(np.int64))


@njit(cache=True, inline="always")
def _dot(a: tuple[float, float, float], b: tuple[float, float, float]) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, inline="always")
def _less(a: Floats, b: Floats) -> tuple[float, float, float]:
    """The difference a − b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@njit(cache=True, _nrt=False)
def _weights(triangle: Floats, point: Floats) -> tuple[float, float]:
    """Barycentric weights of the second and third corner at the closest point (Ericson 2005, section 5.1.5)."""
    ab, ac = _less(triangle[1], triangle[0]), _less(triangle[2], triangle[0])
    ap, bp, cp = _less(point, triangle[0]), _less(point, triangle[1]), _less(point, triangle[2])
    d1, d2, d3, d4, d5, d6 = _dot(ab, ap), _dot(ac, ap), _dot(ab, bp), _dot(ac, bp), _dot(ab, cp), _dot(ac, cp)
    a, b, c = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    if d1 <= 0 and d2 <= 0:
        second, third = 0.0, 0.0
    elif d3 >= 0 and d4 <= d3:
        second, third = 1.0, 0.0
    elif d6 >= 0 and d5 <= d6:
        second, third = 0.0, 1.0
    elif c <= 0 and d1 >= 0 and d3 <= 0 and d1 > d3:  # equal where the first two corners coincide
        second, third = d1 / (d1 - d3), 0.0
    elif b <= 0 and d2 >= 0 and d6 <= 0:
        second, third = 0.0, d2 / (d2 - d6)
    elif a <= 0 and d4 >= d3 and d5 >= d6:
        third = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        second = 1.0 - third
    else:
        second, third = b / (a + b + c), c / (a + b + c)
    return second, third


@njit(cache=True, _nrt=False)
def _squared_to_triangle(triangle: Floats, point: Floats) -> float:
    second, third = _weights(triangle, point)
    total = 0.0
    for r in range(3):
        at = triangle[0, r] + second * (triangle[1, r] - triangle[0, r]) + third * (triangle[2, r] - triangle[0, r])
        total += (point[r] - at) ** 2
    return total


@njit(cache=True, _nrt=False)
def _squared_to_box(low: Floats, high: Floats, node: int, point: Floats) -> float:
    total = 0.0
    for r in range(3):
        out = max(low[node, r] - point[r], point[r] - high[node, r], 0.0)
        total += out * out
    return total


@njit(cache=True, _nrt=False)
def _nearest_in_leaf(corners: Floats, first: int, last: int, point: Floats, best: float) -> tuple[float, int]:
    """Squared distance and slot of a triangle nearer than `best`, or `best` and −1."""
    found = -1
    for slot in range(first, last):
        squared = _squared_to_triangle(corners[slot], point)
        if squared < best:
            best, found = squared, slot
    return best, found


@njit(cache=True, _nrt=False)
def _push_children(low: Floats, high: Floats, node: int, point: Floats, stack: Ints, depth: int) -> int:
    """Both children onto the stack, the nearer on top; the stack's new depth."""
    nearer, farther = 2 * node, 2 * node + 1
    if _squared_to_box(low, high, farther, point) < _squared_to_box(low, high, nearer, point):
        nearer, farther = farther, nearer
    stack[depth], stack[depth + 1] = farther, nearer
    return depth + 2


@njit(cache=True, _nrt=False)
def _nearest(low: Floats, high: Floats, corners: Floats, point: Floats, slot: int, stack: Ints) -> tuple[float, int]:
    """Squared distance and slot of the nearest triangle; `slot` is a first guess."""
    leaves = len(low) // 2
    size = len(corners) // leaves
    best = _squared_to_triangle(corners[slot], point)
    stack[0], depth = 1, 1
    while depth > 0:
        depth -= 1
        node = stack[depth]
        if not _squared_to_box(low, high, node, point) < best:  # so that a point that is no number visits nothing
            continue
        if node < leaves:
            depth = _push_children(low, high, node, point, stack, depth)
            continue
        first = (node - leaves) * size
        best, found = _nearest_in_leaf(corners, first, first + size, point, best)
        if found >= 0:
            slot = found
    return best, slot


@njit(cache=True, nogil=True)
def closest_slots(tree: TriangleTree, points: Floats, slots: Ints) -> tuple[Floats, Floats]:
    """Squared distances (n,) and barycentric weights (n, 3) of the points (n, 3) closest on the mesh.

    `slots` (n,) hold first guesses and then the triangles found; guesses change the time it takes and nothing else.
    """
    stack = np.empty(DEEPEST, np.int64)
    squared, weights = np.empty(len(points)), np.empty((len(points), 3))
    for i in range(len(points)):
        squared[i], slots[i] = _nearest(tree.low, tree.high, tree.corners, points[i], slots[i], stack)
        second, third = _weights(tree.corners[slots[i]], points[i])
        weights[i, 0], weights[i, 1], weights[i, 2] = 1.0 - second - third, second, third
    return squared, weights


@njit(cache=True, nogil=True)
def _along(tree: TriangleTree, points: Floats, order: Ints, slots: Ints, weights: Floats) -> None:
    # For the points of `order`: the slots and the weights in them. Each looks first where the one before it was.
    stack = np.empty(DEEPEST, np.int64)
    slot = int(np.int64(0))
    for i in order:
        _, slot = _nearest(tree.low, tree.high, tree.corners, points[i], slot, stack)
        second, third = _weights(tree.corners[slot], points[i])
        slots[i] = slot
        weights[i, 0], weights[i, 1], weights[i, 2] = 1.0 - second - third, second, third


def projected(tree: TriangleTree, points: Floats, threads: int | None = None) -> tuple[Floats, Ints, Floats]:
    """The closest points on the mesh (n, 3), their triangles (n,) and barycentric weights in these (n, 3).

    The number of `threads`, by default one for each processor, changes the time it takes and nothing else.
    """
    points, order = np.array(points, float, order="C"), morton_order(points)
    slots, weights = np.zeros(len(points), np.int64), np.empty((len(points), 3))
    chunks = [order[start : start + CHUNK] for start in range(0, len(order), CHUNK)]

    def look(chunk: Ints) -> None:
        _along(tree, points, chunk, slots, weights)

    threads = min(threads or os.cpu_count() or 1, len(chunks))
    if threads > 1:
        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(look, chunks))
    else:
        for chunk in chunks:
            look(chunk)
    return np.einsum("ij,ijk->ik", weights, tree.corners[slots]), tree.face[slots], weights


def closest_points(tree: TriangleTree, points: Floats) -> tuple[Floats, Ints, Floats]:
    """Squared distances (n,) of points (n, 3), the nearest triangles (n,) and the closest points (n, 3)."""
    slots = np.zeros(len(points), np.int64)
    squared, weights = closest_slots(tree, np.array(points, float, order="C"), slots)
    return squared, tree.face[slots], np.einsum("ij,ijk->ik", weights, tree.corners[slots])
