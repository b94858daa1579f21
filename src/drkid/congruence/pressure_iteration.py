"""The compiled inner loop of the pressure solver: clustering step and pressure vertex translation."""

import numpy as np
from numba import njit

from drkid.mesh import Floats, Ints

ENERGY, MAXIMUM, MEAN = 0, 1, 2  # columns of the history


@njit(cache=True)
def _squared_distance_to_segment(px: float, py: float, pz: float, t: Floats, i: int, j: int) -> float:
    ux, uy, uz = t[j, 0] - t[i, 0], t[j, 1] - t[i, 1], t[j, 2] - t[i, 2]
    wx, wy, wz = px - t[i, 0], py - t[i, 1], pz - t[i, 2]
    s = min(1.0, max(0.0, (ux * wx + uy * wy + uz * wz) / (ux * ux + uy * uy + uz * uz)))
    return (wx - s * ux) ** 2 + (wy - s * uy) ** 2 + (wz - s * uz) ** 2


@njit(cache=True)
def squared_distance_to_triangle(p: Floats, t: Floats) -> float:
    """Of a point (3,) from a triangle (3, 3): to its plane where the foot is inside, else to the nearest side."""
    ux, uy, uz = t[1, 0] - t[0, 0], t[1, 1] - t[0, 1], t[1, 2] - t[0, 2]
    vx, vy, vz = t[2, 0] - t[0, 0], t[2, 1] - t[0, 1], t[2, 2] - t[0, 2]
    wx, wy, wz = p[0] - t[0, 0], p[1] - t[0, 1], p[2] - t[0, 2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    n2 = nx * nx + ny * ny + nz * nz
    # barycentric coordinates of the foot on the plane, times n2
    b = wx * (vy * nz - vz * ny) + wy * (vz * nx - vx * nz) + wz * (vx * ny - vy * nx)
    c = wx * (ny * uz - nz * uy) + wy * (nz * ux - nx * uz) + wz * (nx * uy - ny * ux)
    if b >= 0 and c >= 0 and b + c <= n2:
        return (wx * nx + wy * ny + wz * nz) ** 2 / n2
    nearest = np.inf
    for i in range(3):
        nearest = min(nearest, _squared_distance_to_segment(p[0], p[1], p[2], t, i, (i + 1) % 3))
    return nearest


@njit(cache=True)
def _within(p: Floats, limit: float, triangles: Floats, nearby: Ints) -> bool:
    for f in nearby:  # noqa: SIM110 — any() of a generator does not compile
        if squared_distance_to_triangle(p, triangles[f]) <= limit * limit:
            return True
    return False


@njit(cache=True)
def _sort_sides(lengths: Floats, face_edges: Ints, points: Floats, order: Ints) -> None:
    """Ascending side lengths of each face into `points`, and which side each of them is into `order`."""
    for f in range(face_edges.shape[0]):
        a, b, c = 0, 1, 2
        if lengths[face_edges[f, a]] > lengths[face_edges[f, b]]:
            a, b = b, a
        if lengths[face_edges[f, b]] > lengths[face_edges[f, c]]:
            b, c = c, b
        if lengths[face_edges[f, a]] > lengths[face_edges[f, b]]:
            a, b = b, a
        order[f, 0], order[f, 1], order[f, 2] = a, b, c
        for i in range(3):
            points[f, i] = lengths[face_edges[f, order[f, i]]]


@njit(cache=True)
def _squared_distance(points: Floats, means: Floats, f: int, j: int) -> float:
    return (points[f, 0] - means[j, 0]) ** 2 + (points[f, 1] - means[j, 1]) ** 2 + (points[f, 2] - means[j, 2]) ** 2


@njit(cache=True)
def _reassign(points: Floats, labels: Ints, means: Floats) -> None:
    """One Lloyd step of k-means: every triangle to the nearest mean, then the new means."""
    total, count = np.zeros_like(means), np.zeros(means.shape[0])
    for f in range(points.shape[0]):
        for j in range(means.shape[0]):
            if _squared_distance(points, means, f, j) < _squared_distance(points, means, f, labels[f]):
                labels[f] = j
        count[labels[f]] += 1
        for i in range(3):
            total[labels[f], i] += points[f, i]
    for j in range(means.shape[0]):
        if count[j] > 0:
            for i in range(3):
                means[j, i] = total[j, i] / count[j]


@njit(cache=True)
def _errors(points: Floats, labels: Ints, means: Floats) -> tuple[float, float, float]:
    """Energy, largest and mean distance (equations 1, 4 and 5)."""
    energy, largest, total = 0.0, 0.0, 0.0
    for f in range(points.shape[0]):
        squared = _squared_distance(points, means, f, labels[f])
        energy += squared
        total += np.sqrt(squared)
        largest = max(largest, np.sqrt(squared))
    return energy, largest, total / points.shape[0]


@njit(cache=True)
def _pressure(vertices: Floats, edges: Ints, lengths: Floats, wanted: Floats, shift: Floats, valence: Floats) -> None:
    """Mean over each vertex's edges of half the wanted change along the edge (equation 6), into `shift` (V, 3)."""
    shift[:] = 0
    for e in range(edges.shape[0]):
        i, j = edges[e, 0], edges[e, 1]
        half = 0.5 * (wanted[e] - lengths[e]) / lengths[e]
        for d in range(3):
            change = half * (vertices[i, d] - vertices[j, d])
            shift[i, d] += change / valence[i]
            shift[j, d] -= change / valence[j]


@njit(cache=True)
def _move(now: Floats, shift: Floats, limit: float, reference: Floats, nearby: Ints) -> None:
    """Move each vertex by its pressure; by half of it where that leaves the limit; not at all where that does too."""
    target = np.empty(3)
    for v in range(now.shape[0]):
        for part in (1.0, 0.5):
            for d in range(3):
                target[d] = now[v, d] + part * shift[v, d]
            if _within(target, limit, reference, nearby[v]):
                now[v] = target
                break


@njit(cache=True)
def _edge_lengths(vertices: Floats, edges: Ints, lengths: Floats) -> None:
    for e in range(edges.shape[0]):
        total = 0.0
        for d in range(3):
            total += (vertices[edges[e, 0], d] - vertices[edges[e, 1], d]) ** 2
        lengths[e] = np.sqrt(total)


@njit(cache=True)
def iterate(  # noqa: PLR0913, PLR0917 — a compiled kernel takes plain arrays
    vertices: Floats,
    edges: Ints,
    face_edges: Ints,
    means: Floats,
    reference: Floats,
    nearby: Ints,
    limit: float,
    tolerance: float,
    iterations: int,
) -> tuple[Floats, Floats, Ints, Floats, Floats]:
    """Iterations of clustering and pressure until `iterations` are done or the largest error is ≤ `tolerance`.

    Args:
        vertices: (V, 3) positions at the start.
        edges: (E, 2) ends of the edges.
        face_edges: (F, 3) edges of the faces.
        means: (k, 3) ascending edge lengths of the classes at the start.
        reference: (R, 3, 3) triangles of the surface that is not to be left.
        nearby: (V, n) triangles of the reference near each vertex.
        limit: how far a vertex may lie from the reference.
        tolerance: largest error at which to stop; both are lengths.
        iterations: how many at most.

    Returns:
        Of the best iteration: vertices, means, labels (F,); the vertices of the last one; and the history (n, 3):
        energy, largest and mean error of each iteration's mesh.
    """
    now, means = vertices.copy(), means.copy()
    labels = np.zeros(face_edges.shape[0], np.int64)
    lengths, wanted = np.empty(edges.shape[0]), np.empty(edges.shape[0])
    points, order = np.empty((face_edges.shape[0], 3)), np.empty((face_edges.shape[0], 3), np.int64)
    shift, valence = np.empty_like(vertices), np.zeros(vertices.shape[0])
    for e in range(edges.shape[0]):
        for end in range(2):
            valence[edges[e, end]] += 1
    history = np.empty((iterations, 3))
    best, best_means, best_labels, least = now.copy(), means.copy(), labels.copy(), np.inf
    done = 0
    while done < iterations:
        _edge_lengths(now, edges, lengths)
        _sort_sides(lengths, face_edges, points, order)
        _reassign(points, labels, means)
        energy, largest, mean = _errors(points, labels, means)
        history[done, ENERGY], history[done, MAXIMUM], history[done, MEAN] = energy, largest, mean
        done += 1
        if largest < least:
            best[:], best_means[:], best_labels[:], least = now, means, labels, largest
        if largest <= tolerance:
            break
        wanted[:] = 0
        for f in range(face_edges.shape[0]):
            for i in range(3):
                wanted[face_edges[f, order[f, i]]] += 0.5 * means[labels[f], i]
        _pressure(now, edges, lengths, wanted, shift, valence)
        _move(now, shift, limit, reference, nearby)
    return best, best_means, best_labels, now, history[:done]
