"""Centroidal Voronoi tessellation restricted to a surface.

Du, Faber and Gunzburger, "Centroidal Voronoi tessellations" (SIAM Review 1999); Yan, Lévy, Liu, Sun and Wang,
"Isotropic remeshing with fast and exact computation of restricted Voronoi diagram" (SGP 2009), for the clipping and
its security radius; Liu et al., "On centroidal Voronoi tessellation: energy smoothness and fast computation" (TOG
2009), for the gradient and the quasi-Newton iterations.
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit
from scipy.optimize import minimize
from scipy.spatial import cKDTree

from drkid.errors import RemeshError
from drkid.mesh import Floats, Ints, TriMesh

NEIGHBOURS = 24  # of a seed, by which cells are clipped at first; doubled where the security radius asks for more
CORNERS = 64  # most corners of a clipped triangle: three and one more for each bisector that cuts it
CHUNK = 20_000  # triangles, about, that one thread clips at a time: sums depend on it, not on the number of threads
MEMORY = 7  # corrections that L-BFGS keeps; the usual choice
Part = tuple[Floats, Ints, bool]  # cells, dual triangles, and whether lists of neighbours were long enough
Scalar = Any  # a number out of an array of them, which numpy's stubs take for an array


@dataclass(frozen=True, eq=False)
class Tessellation:
    """The restricted Voronoi diagram of seeds on a surface.

    `mass` (N,) the integral of the density over each cell, its area where that is 1; `moment` (N, 3) and `energy` (N,)
    those of density times position, and times the squared distance to its seed. `triangles` (T, 3) are the dual ones:
    one for each corner where three cells meet, counter-clockwise seen from outside. `first` (F,) is the seed nearest to
    the middle of each of the surface's triangles.
    """

    mass: Floats
    moment: Floats
    energy: Floats
    triangles: Ints
    first: Ints


# The kernels take whole arrays and indices: a view of a row costs more than the few sums that are made with it.


@njit(cache=True, nogil=True)
def _reach(polygons: Floats, here: int, count: int, sites: Floats, i: int) -> float:
    # Squared distance from the seed to the farthest corner.
    most = 0.0
    for c in range(count):
        x = polygons[here, c, 0] - sites[i, 0]
        y = polygons[here, c, 1] - sites[i, 1]
        z = polygons[here, c, 2] - sites[i, 2]
        most = max(most, x * x + y * y + z * z)
    return most


@njit(cache=True, nogil=True)
def _bisector(sites: Floats, i: int, j: int) -> tuple[float, float, float, float]:
    # The half-space nearer to seed i than to j: x p + y q + z r ≥ offset.
    x, y, z = sites[i, 0] - sites[j, 0], sites[i, 1] - sites[j, 1], sites[i, 2] - sites[j, 2]
    double = x * (sites[i, 0] + sites[j, 0]) + y * (sites[i, 1] + sites[j, 1]) + z * (sites[i, 2] + sites[j, 2])
    return x, y, z, double / 2


@njit(cache=True, nogil=True)
def _cut(
    polygons: Floats,
    sides: Ints,
    here: int,
    count: int,
    plane: tuple[float, float, float, float],
    name: int,
    left: Floats,
) -> int:
    # Sutherland and Hodgman's clipping by a half-space, from polygons[here] to the other buffer; the number of corners
    # left, or -1 where nothing is cut off. sides[here, c] names what lies beyond the side from corner c to c + 1.
    x, y, z, offset = plane
    there, cut = 1 - here, False
    for c in range(count):
        left[c] = polygons[here, c, 0] * x + polygons[here, c, 1] * y + polygons[here, c, 2] * z - offset
        cut |= left[c] < 0
    if not cut:
        return -1
    kept = 0
    for c in range(count):
        n = c + 1 if c + 1 < count else 0
        if left[c] >= 0:
            for d in range(3):
                polygons[there, kept, d] = polygons[here, c, d]
            sides[there, kept] = sides[here, c]
            kept += 1
        if (left[c] >= 0) != (left[n] >= 0):
            t = left[c] / (left[c] - left[n])
            for d in range(3):
                polygons[there, kept, d] = polygons[here, c, d] + t * (polygons[here, n, d] - polygons[here, c, d])
            sides[there, kept] = name if left[c] >= 0 else sides[here, c]
            kept += 1
    return kept


@njit(cache=True, nogil=True)
def _clip(
    i: int, sites: Floats, near: Ints, apart: Floats, polygons: Floats, sides: Ints, left: Floats
) -> tuple[int, int]:
    # Clip the triangle in polygons[0] to the cell of seed i; the number of its corners and which of the two buffers
    # it is in, or -1 where the neighbours given are too few to be sure.
    count, here = int(np.int64(3)), int(np.int64(0))
    reach = _reach(polygons, here, count, sites, i)
    for k in range(near.shape[1]):
        if apart[i, k] > 4 * reach:
            return count, here
        j = near[i, k]
        kept = _cut(polygons, sides, here, count, _bisector(sites, i, j), j, left)
        if kept >= 0:
            count, here = kept, 1 - here
            if count == 0:
                return 0, here
            if count > CORNERS - 2:
                return -1, here
            reach = _reach(polygons, here, count, sites, i)
    return (count if near.shape[1] == len(sites) - 1 else -1), here


@njit(cache=True, nogil=True)
def _add_corner(triangles: Ints, found: int, i: int, j: int, k: int) -> int:
    # Three cells meet: each of them sees this corner, the first of them keeps it.
    if i < j and i < k and j != k and found < len(triangles):
        triangles[found, 0], triangles[found, 1], triangles[found, 2] = i, j, k
        return found + 1
    return found


@njit(cache=True, nogil=True)
def _integrate(polygons: Floats, here: int, count: int, sites: Floats, i: int, density: Scalar, cells: Floats) -> None:
    # Adds mass, energy and moment to cells[i]. Exact for the fan of triangles: the second moment of one about the seed
    # is A (Σ |p|² + |Σ p|²) / 12.
    p, q, r = sites[i, 0], sites[i, 1], sites[i, 2]
    ax, ay, az = polygons[here, 0, 0] - p, polygons[here, 0, 1] - q, polygons[here, 0, 2] - r
    for k in range(1, count - 1):
        bx, by, bz = polygons[here, k, 0] - p, polygons[here, k, 1] - q, polygons[here, k, 2] - r
        cx, cy, cz = polygons[here, k + 1, 0] - p, polygons[here, k + 1, 1] - q, polygons[here, k + 1, 2] - r
        x = (by - ay) * (cz - az) - (bz - az) * (cy - ay)
        y = (bz - az) * (cx - ax) - (bx - ax) * (cz - az)
        z = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        mass = density * (np.sqrt(x * x + y * y + z * z) / 2)
        sx, sy, sz = ax + bx + cx, ay + by + cy, az + bz + cz
        squares = ax * ax + ay * ay + az * az + bx * bx + by * by + bz * bz + cx * cx + cy * cy + cz * cz
        cells[i, 0] += mass
        cells[i, 1] += mass * (squares + sx * sx + sy * sy + sz * sz) / 12
        cells[i, 2] += mass * (p + sx / 3)
        cells[i, 3] += mass * (q + sy / 3)
        cells[i, 4] += mass * (r + sz / 3)


@njit(cache=True, nogil=True)
def _squared_distance(points: Floats, i: int, sites: Floats, j: int) -> float:
    x, y, z = points[i, 0] - sites[j, 0], points[i, 1] - sites[j, 1], points[i, 2] - sites[j, 2]
    return x * x + y * y + z * z


@njit(cache=True, nogil=True)
def _nearer(middles: Floats, f: int, sites: Floats, near: Ints, apart: Floats, g: int) -> tuple[int, bool]:
    # The nearest among seed g and its neighbours, and whether no other seed can be nearer: one that is lies within
    # twice g's distance of g.
    best, least = g, _squared_distance(middles, f, sites, g)
    radius = 4 * least
    for k in range(near.shape[1]):
        if apart[g, k] > radius:
            return best, True
        squared = _squared_distance(middles, f, sites, near[g, k])
        if squared < least:
            best, least = near[g, k], squared
    return best, near.shape[1] == len(sites) - 1


@njit(cache=True, nogil=True)
def _nearest(middles: Floats, sites: Floats, near: Ints, apart: Floats, first: Ints) -> bool:
    # The seed nearest to each point, where `first` is a guess, in place; where that is negative, the seed of the point
    # before is the guess. False where lists of neighbours are too short.
    for f in range(len(middles)):
        if first[f] < 0:
            first[f] = first[f - 1] if f else 0
        sure = False
        while not sure:
            best, sure = _nearer(middles, f, sites, near, apart, first[f])
            if best == first[f] and not sure:
                return False
            first[f] = best
    return True


@njit(cache=True, nogil=True)
def _restricted_voronoi(
    corners: Floats, density: Floats, first: Ints, sites: Floats, near: Ints, apart: Floats
) -> tuple[Floats, Ints, bool]:
    # `density` (F,) of each triangle, `first` (F,) the seed nearest to its middle; `near` (N, K) the other seeds in
    # order of distance, `apart` their squared distances. Mass, energy and moment (N, 5) of each cell; the dual
    # triangles; and False where K seeds were too few to be sure of a cell.
    n = len(sites)
    cells, triangles, found = np.zeros((n, 5)), np.empty((16 * n + 16, 3), np.int64), int(np.int64(0))
    queued, queue = np.full(n, -1, np.int64), np.empty(n, np.int64)
    polygons, sides, left = np.empty((2, CORNERS, 3)), np.empty((2, CORNERS), np.int64), np.empty(CORNERS)
    for f in range(len(corners)):
        queue[0] = first[f]
        queued[first[f]] = f
        head, tail = 0, 1
        while head < tail:
            i = queue[head]
            head += 1
            for c in range(3):
                sides[0, c] = -1
                for d in range(3):
                    polygons[0, c, d] = corners[f, c, d]
            count, here = _clip(i, sites, near, apart, polygons, sides, left)
            if count < 0:
                return cells, triangles[:0], False
            _integrate(polygons, here, count, sites, i, density[f], cells)
            for c in range(count):
                j, k = sides[here, c], sides[here, c + 1 if c + 1 < count else 0]
                if j >= 0 and queued[j] != f:
                    queued[j] = f
                    queue[tail] = j
                    tail += 1
                found = _add_corner(triangles, found, i, j, k)
    return cells, triangles[:found], True


def is_compiled() -> bool:
    """Is machine code of the kernels kept from an earlier run, and newer than their source?"""
    kernel: Any = _restricted_voronoi  # numba's dispatcher, which its stubs take for a plain function
    if kernel.signatures:
        return True
    source = Path(__file__).stat().st_mtime
    kept = Path(kernel.stats.cache_path).glob(f"*.{_restricted_voronoi.__name__}-*.nbi")
    return any(index.stat().st_mtime >= source for index in kept)


def tessellate(
    surface: TriMesh,
    seeds: Floats,
    guess: Ints | None = None,
    density: Floats | None = None,
    threads: int | None = None,
) -> Tessellation:
    """The restricted Voronoi diagram of `seeds` (N, 3), N ≥ 2, all different, on the surface or near it.

    `density` (F,) is that of each of the surface's triangles, 1 where None; it weighs integrals and moves no border.
    `guess` (F,), if given, is `first` of a diagram of nearly the same seeds: it saves time and changes nothing else.
    Nor does the number of `threads`, by default one for each processor.

    Raises:
        RemeshError: a cell has more corners in one triangle than there is room for.
    """
    tree = cKDTree(seeds)
    density = np.ones(len(surface.faces)) if density is None else density
    others = min(NEIGHBOURS, len(seeds) - 1)
    count = len(surface.faces)
    ends = np.linspace(0, count, 1 + (1 if count <= CHUNK else 2 * -(-count // (2 * CHUNK)))).astype(np.int64)
    parts = [slice(start, end) for start, end in pairwise(ends.tolist())]
    first = np.full(count, -1, np.int64) if guess is None else guess.copy()
    while True:
        apart, near = map(np.asarray, tree.query(seeds, k=others + 1))  # the first is the seed itself
        lists = np.ascontiguousarray(near[:, 1:], np.int64), np.ascontiguousarray(apart[:, 1:] ** 2)

        def clipped(part: slice, lists: tuple[Ints, Floats] = lists) -> Part:
            return _clipped(surface, density, part, first, tree, lists)

        found = _each(parts, clipped, threads)
        if all(sure for _, _, sure in found):
            cells = np.sum([cells for cells, _, _ in found], axis=0)
            return Tessellation(
                cells[:, 0], cells[:, 2:], cells[:, 1], np.concatenate([three for _, three, _ in found]), first
            )
        if others == len(seeds) - 1:
            raise RemeshError(
                "seeds lie too unevenly for a Voronoi diagram",
                wanted=f"cells of fewer than {CORNERS} corners",
                found="a cell of more",
                remedy="another --seed",
            )
        others = min(2 * others, len(seeds) - 1)


def _clipped(
    surface: TriMesh, density: Floats, part: slice, first: Ints, tree: cKDTree, lists: tuple[Ints, Floats]
) -> Part:
    """`_restricted_voronoi` of some of the triangles; fills their `first`."""
    middles, seeds = surface.middles[part], np.asarray(tree.data)
    if not _nearest(middles, seeds, *lists, first[part]):
        first[part] = tree.query(middles)[1]
    return _restricted_voronoi(surface.corners[part], density[part], first[part], seeds, *lists)


def _each(parts: list[slice], work: Callable[[slice], Part], threads: int | None) -> list[Part]:
    """The work on each part, in order; the kernels let other threads run meanwhile."""
    threads = min(threads or os.cpu_count() or 1, len(parts))
    if threads == 1:
        return [work(part) for part in parts]
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(work, parts))


def lloyd(
    surface: TriMesh, seeds: Floats, iterations: int, density: Floats | None = None
) -> tuple[Floats, list[float]]:
    """Each seed to the centroid of its cell, `iterations` times; the seeds and the energy before each step.

    The energy never rises (Du, Faber and Gunzburger 1999, section 5.2). A seed without a cell stays where it is.
    """
    history: list[float] = []
    guess: Ints | None = None
    for _ in range(iterations):
        cells = tessellate(surface, seeds, guess, density)
        guess = cells.first
        history.append(float(cells.energy.sum()))
        full = cells.mass > 0
        seeds = seeds.copy()
        seeds[full] = cells.moment[full] / cells.mass[full, None]
    return seeds, history


def energy_and_gradient(surface: TriMesh, seeds: Floats, density: Floats | None = None) -> tuple[float, Floats]:
    """E = Σ ∫ ρ |x − sᵢ|² over the cells, and dE/dsᵢ = 2 mᵢ (sᵢ − cᵢ), (N, 3) (Liu et al. 2009, equation 3)."""
    return _energy_and_gradient(tessellate(surface, seeds, None, density), seeds)


def _energy_and_gradient(cells: Tessellation, seeds: Floats) -> tuple[float, Floats]:
    return float(cells.energy.sum()), 2 * (cells.mass[:, None] * seeds - cells.moment)


def quasi_newton(
    surface: TriMesh, seeds: Floats, iterations: int, told: Callable[[int], None], density: Floats | None = None
) -> tuple[Floats, list[float]]:
    """Lower the energy by L-BFGS (Liu et al. 2009, section 4); the seeds, and the energies, the first one too.

    `told` hears how many iterations are done. Lengths and energy are scaled to about 1, as the step length of
    the first iteration is not free of units.
    """
    middle, length = seeds.mean(axis=0), np.sqrt(surface.areas.sum() / len(seeds))
    cells = tessellate(surface, seeds, None, density)
    start = float(cells.energy.sum())
    history, guess = [start], cells.first
    if iterations == 0:
        return seeds, history

    def scaled(flat: Floats) -> tuple[float, Floats]:
        nonlocal guess
        moved = middle + length * flat.reshape(-1, 3)
        cells = tessellate(surface, moved, guess, density)
        guess = cells.first
        energy, gradient = _energy_and_gradient(cells, moved)
        scale = len(seeds) / start
        return energy * scale, (gradient * (length * scale)).ravel()

    def heard(intermediate_result: object) -> None:
        history.append(float(getattr(intermediate_result, "fun")) * start / len(seeds))  # noqa: B009
        told(len(history) - 1)

    found = minimize(
        scaled,
        ((seeds - middle) / length).ravel(),
        jac=True,
        method="L-BFGS-B",
        callback=heard,
        options={"maxiter": iterations, "maxcor": MEMORY, "gtol": 0.0, "ftol": 0.0},
    )
    return middle + length * np.asarray(found.x, np.float64).reshape(-1, 3), history
