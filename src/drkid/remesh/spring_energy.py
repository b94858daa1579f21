"""Edges as springs around a few vertices: their energy, with what irregular valences cost, and its relaxation.

What a local operation is worth shows once its neighbourhood has relaxed; kernels that try one use these.
"""

import numpy as np
from numba import njit

from drkid.mesh import Floats, Ints
from drkid.remesh.half_edge import following, preceding

RINGS = 2  # of neighbours that may move
SWEEPS = 8  # of relaxation
STEP = 0.8  # of the Newton step of the springs at a vertex
VALENCE_WEIGHT = 0.01  # of (valence − 6)⁴, against the squared relative errors of edges: 4 and 8 are to go first


@njit(cache=True)
def gather(edges: tuple[Ints, Ints, Ints], count: int, marks: Ints, mark: int, region: Ints) -> int:
    """Write the vertices within RINGS edges of the first `count` of a region behind them; how many it holds then.

    All get `mark` in `marks` (V,), by which they are told apart from others; the region's length is the room there is.
    """
    origin, twin, start = edges
    for i in range(count):
        marks[region[i]] = mark
    first = 0
    for _ in range(RINGS):
        last = count
        for i in range(first, last):
            e = start[region[i]]
            end = e
            while True:
                w = origin[following(e)]
                if marks[w] != mark and count < len(region):
                    marks[w] = mark
                    region[count] = w
                    count += 1
                e = twin[preceding(e)]
                if e == end:
                    break
        first = last
    return count


@njit(cache=True)
def energy(
    edges: tuple[Ints, Ints, Ints], vertices: Floats, goal: Floats, marks: Ints, mark: int, region: Ints
) -> float:
    """Σ (l / goal − 1)² over the edges at the region's vertices, which bear `mark`, and the valences' share."""
    origin, twin, start = edges
    total = 0.0
    for v in region:
        e = start[v]
        end = e
        valence = 0
        while True:
            w = origin[following(e)]
            if marks[w] != mark or v < w:
                squared = 0.0
                for d in range(3):
                    squared += (vertices[w, d] - vertices[v, d]) ** 2
                total += (np.sqrt(squared) / ((goal[v] + goal[w]) / 2) - 1) ** 2
            valence += 1
            e = twin[preceding(e)]
            if e == end:
                break
        total += VALENCE_WEIGHT * (valence - 6) ** 4
    return total


@njit(cache=True)
def relax_region(
    origin: Ints, twin: Ints, start: Ints, vertices: Floats, normals: Floats, goal: Floats, region: Ints
) -> None:
    """Gauss and Seidel's sweeps: each vertex of the region by the Newton step of its springs, in its tangent plane."""
    for _ in range(SWEEPS):
        for v in region:
            x, y, z, valence = 0.0, 0.0, 0.0, 0
            e = start[v]
            end = e
            while True:
                w = origin[following(e)]
                p, q, r = (
                    vertices[w, 0] - vertices[v, 0],
                    vertices[w, 1] - vertices[v, 1],
                    vertices[w, 2] - vertices[v, 2],
                )
                length = (goal[v] + goal[w]) / 2
                surplus = 1 - length / max(np.sqrt(p * p + q * q + r * r), 1e-3 * length)
                x += surplus * p
                y += surplus * q
                z += surplus * r
                valence += 1
                e = twin[preceding(e)]
                if e == end:
                    break
            out = x * normals[v, 0] + y * normals[v, 1] + z * normals[v, 2]
            step = 2 * STEP / valence
            vertices[v, 0] += step * (x - out * normals[v, 0])
            vertices[v, 1] += step * (y - out * normals[v, 1])
            vertices[v, 2] += step * (z - out * normals[v, 2])
