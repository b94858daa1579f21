"""Pairs of an edge collapse, where edges are short or valences low, and a vertex split, where they are long or high.

Hoppe, "Progressive meshes" (SIGGRAPH 1996), for the two as inverses of each other: a pair takes a vertex and two faces
from one place to another and leaves all counts as they were. A vertex split whose new vertex takes one edge along is
an edge split.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice

import numpy as np
from numba import njit

from drkid.intersection import self_intersections
from drkid.measure import bend_radians, distance_to_surface, smallest_angle_degrees
from drkid.mesh import Bools, Floats, Ints, TriMesh
from drkid.remesh.edge_collapse import collapse_edge, keeps_the_topology
from drkid.remesh.edge_flip import flip_towards_valence_six
from drkid.remesh.half_edge import HalfEdges, Index, following, half_edges, mesh_of, preceding, valence_of
from drkid.remesh.sizing_field import goals
from drkid.remesh.spring_energy import VALENCE_WEIGHT, energy, gather, relax_region
from drkid.remesh.surface_fit import SurfaceFit

SHORT, LONG = 0.6, 1.5  # of the wanted length: edges beyond this band are flaws, as are valences other than 5, 6 and 7
FEWEST, MOST = 4, 9  # edges at a vertex that a move may leave; what then is no 5, 6 or 7 has its price
PLACES = 40  # of collapses, and of splits, that are paired: those that promise most
TRIALS = 6  # pairs that are fitted to the surface before the search for a better mesh ends
MOST_PAIRS = 12  # that are kept: a mesh with more flaws has them for another reason
STEPS = 5  # of least squares after a pair
LEAST_GAIN = 0.01  # of the edges' spread, where a pair mends nothing else
MOST_SPREAD = 1.15  # times the first one, that all pairs together may cost where they mend flaws
WIDE_DEGREES = 35.0  # angles above this may shrink
FLAT_DEGREES, SHARPER = 60.0, 1.02  # and bends below this may grow, others by this factor
ROOM = 320  # vertices around a pair that may move


@njit(cache=True)
def _valence_cost(valence: Index) -> float:
    return VALENCE_WEIGHT * (valence - 6) ** 4


@njit(cache=True)
def _surplus(edges: tuple[Ints, Ints, Ints], vertices: Floats, goal: Floats) -> Floats:
    # (V,): the mean relative error of the edges at each vertex, negative where they are short.
    origin, twin, start = edges
    found = np.zeros(len(start))
    for v in range(len(start)):
        h = start[v]
        valence = valence_of(twin, h)
        for _ in range(valence):
            w = origin[following(h)]
            squared = 0.0
            for d in range(3):
                squared += (vertices[w, d] - vertices[v, d]) ** 2
            found[v] += (np.sqrt(squared) / ((goal[v] + goal[w]) / 2) - 1) / valence
            h = twin[preceding(h)]
    return found


@njit(cache=True)
def _collapses(edges: tuple[Ints, Ints, Ints], valence: Ints, surplus: Floats) -> list[tuple[Index, Index]]:
    # What the collapse of each edge promises to cost, and one of its half-edges.
    origin, twin, start = edges
    found: list[tuple[Index, Index]] = [(0.0, 0) for _ in range(0)]
    for h in range(len(origin)):
        g = twin[h]
        a, b, c, d = origin[h], origin[g], origin[preceding(h)], origin[preceding(g)]
        merged = valence[a] + valence[b] - 4
        allowed = FEWEST <= merged <= MOST and min(valence[c], valence[d]) > FEWEST
        if h < g and allowed and keeps_the_topology(origin, twin, start, h):
            cost = _valence_cost(merged) - _valence_cost(valence[a]) - _valence_cost(valence[b])
            for wing in (c, d):
                cost += _valence_cost(valence[wing] - 1) - _valence_cost(valence[wing])
            found.append((cost + (surplus[a] + surplus[b]) / 2, h))
    return found


@njit(cache=True)
def _splits(edges: tuple[Ints, Ints, Ints], valence: Ints, surplus: Floats) -> list[tuple[Index, Index, Index]]:
    # What the split of each vertex between each two of its edges promises to cost, and their half-edges.
    origin, twin, _ = edges
    found: list[tuple[Index, Index, Index]] = [(0.0, 0, 0) for _ in range(0)]
    for h in range(len(origin)):
        v, c = origin[h], origin[following(h)]
        g = twin[preceding(h)]
        for taken in range(3, valence[v] - 1):  # edges of the new vertex to old ones; the third at least
            g = twin[preceding(g)]
            d = origin[following(g)]
            one, two = taken + 1, valence[v] + 3 - taken
            if one > two or max(valence[c], valence[d]) == MOST:
                continue
            cost = _valence_cost(one) + _valence_cost(two) - _valence_cost(valence[v])
            for wing in (c, d):
                cost += _valence_cost(valence[wing] + 1) - _valence_cost(valence[wing])
            found.append((cost - surplus[v], h, g))
    return found


@njit(cache=True)
def split_vertex(edges: tuple[Ints, Ints, Ints], h: Index, g: Index, new: Index, faces: tuple[int, int]) -> None:
    """Give the edges from half-edge h to g, counter-clockwise around their vertex, to the vertex `new`.

    `faces` are two free faces; they fill the gaps that open at the edges of h and g, which both vertices keep.
    """
    origin, twin, start = edges
    v, c, d = origin[h], origin[following(h)], origin[following(g)]
    e = h
    while e != g:
        origin[e] = new
        e = twin[preceding(e)]
    one, two = 3 * faces[0], 3 * faces[1]
    origin[one], origin[one + 1], origin[one + 2] = v, c, new
    origin[two], origin[two + 1], origin[two + 2] = v, new, d
    for inner, outer in ((one, twin[h]), (one + 1, h), (two + 1, twin[g]), (two + 2, g), (one + 2, two)):
        twin[inner] = outer
        twin[outer] = inner
    start[v], start[new], start[c], start[d] = one, two + 1, one + 1, two + 2


@njit(cache=True)
def _towards_neighbours(origin: Ints, twin: Ints, start: Ints, vertices: Floats, v: Index) -> None:
    # Half of the way to the mean of the neighbours.
    h = start[v]
    valence = valence_of(twin, h)
    for d in range(3):
        total = 0.0
        for _ in range(valence):
            total += vertices[origin[following(h)], d]
            h = twin[preceding(h)]
        vertices[v, d] = (vertices[v, d] + total / valence) / 2


@njit(cache=True)
def _moved(
    edges: tuple[Ints, Ints, Ints], vertices: Floats, places: tuple[Floats, Floats], h: int, split: tuple[int, int]
) -> bool:
    # Collapse the edge of h into its middle and split a vertex between two half-edges, with the vertex that went as the
    # new one; is that possible? If not, the arrays are spoilt. `places` are normals (V, 3) and goals (V,).
    origin, twin, start = edges
    a, b, g = origin[h], origin[twin[h]], twin[h]
    for d in range(3):
        vertices[a, d] = (vertices[a, d] + vertices[b, d]) / 2
    collapse_edge(origin, twin, start, h)
    one, two = split
    v = origin[one]
    if v < 0 or origin[two] < 0:  # a face of theirs has gone
        return False
    for here, there in ((one, two), (two, one)):  # each side keeps an edge of its own
        if twin[preceding(here)] == there or here == there:
            return False
    split_vertex(edges, one, two, b, (h // 3, g // 3))
    normals, goal = places
    goal[b] = goal[v]
    for d in range(3):
        vertices[b, d], normals[b, d] = vertices[v, d], normals[v, d]
    _towards_neighbours(origin, twin, start, vertices, b)
    _towards_neighbours(origin, twin, start, vertices, v)
    return True


@njit(cache=True)
def _gather_pair(edges: tuple[Ints, Ints, Ints], h: int, split: tuple[int, int], marks: Ints, room: Ints) -> int:
    # The vertices around both moves; marked with 1.
    origin, twin, _ = edges
    count = 0
    marks[:] = 0
    for e in (h, twin[h], split[0], split[1]):
        for v in (origin[e], origin[following(e)], origin[preceding(e)]):
            if marks[v] == 0:
                marks[v] = 1
                room[count] = v
                count += 1
    return gather(edges, count, marks, 1, room)


@njit(cache=True)
def _tried(
    edges: tuple[Ints, Ints, Ints], vertices: Floats, places: tuple[Floats, Floats], h: int, split: tuple[int, int]
) -> float:
    # Make the pair of moves in these arrays and relax around it: by how much the energy grows, infinite if impossible.
    origin, twin, start = edges
    marks, room = np.zeros(len(start), np.int64), np.empty(ROOM, np.int64)
    region = room[: _gather_pair(edges, h, split, marks, room)]
    before = energy(edges, vertices, places[1], marks, 1, region)
    if not _moved(edges, vertices, places, h, split):
        return np.inf
    relax_region(origin, twin, start, vertices, places[0], places[1], region)
    return energy(edges, vertices, places[1], marks, 1, region) - before


@njit(cache=True)
def _growths(
    edges: tuple[Ints, Ints, Ints], vertices: Floats, places: tuple[Floats, Floats], collapses: Ints, splits: Ints
) -> Floats:
    # (C, S): by how much the energy grows with each collapse (C,) and split (S, 2).
    found = np.empty((len(collapses), len(splits)))
    for i in range(len(collapses)):
        for k in range(len(splits)):
            spare = (edges[0].copy(), edges[1].copy(), edges[2].copy())
            around = (places[0].copy(), places[1].copy())
            found[i, k] = _tried(spare, vertices.copy(), around, collapses[i], (splits[k, 0], splits[k, 1]))
    return found


def _copied(edges: HalfEdges) -> tuple[Ints, Ints, Ints]:
    return edges.origin.copy(), edges.twin.copy(), edges.start.copy()


def _drafts(mesh: TriMesh, fit: SurfaceFit) -> Iterator[TriMesh]:
    """Meshes after a pair of moves that lowers the energy, the lowest first; no move is in two of them."""
    edges, goal = half_edges(mesh), goals(mesh, fit.sizing)
    kernels, normals = _copied(edges), mesh.vertex_normals.copy()
    surplus = _surplus(kernels, mesh.vertices.copy(), goal)
    valence = mesh.valence.copy()
    collapses = np.array([h for _, h in sorted(_collapses(kernels, valence, surplus))[:PLACES]], np.int64)
    splits = np.array([pair for _, *pair in sorted(_splits(kernels, valence, surplus))[:PLACES]], np.int64)
    if not len(collapses) or not len(splits):
        return
    growth = _growths(kernels, mesh.vertices.copy(), (normals, goal), collapses, splits)
    while growth.min() < 0:
        i, k = np.unravel_index(int(growth.argmin()), growth.shape)
        spare, vertices = _copied(edges), mesh.vertices.copy()
        _tried(spare, vertices, (normals.copy(), goal.copy()), collapses[i], (splits[k, 0], splits[k, 1]))
        yield mesh_of(HalfEdges(*spare), vertices)
        growth[i], growth[:, k] = np.inf, np.inf


@dataclass(frozen=True)
class _Figures:
    """What a pair is judged by. `largest` is the largest distance from the surface, either way."""

    odd_valences: int
    beyond_band: int
    spread: float
    angle_degrees: float
    bend_degrees: float
    largest: float
    cuts: int

    def pays(self, before: "_Figures", most_spread: float) -> bool:
        """Are there fewer flaws or more even edges than before, and is nothing else worse?"""
        flaws, were = self.odd_valences + self.beyond_band, before.odd_valences + before.beyond_band
        better = (flaws < were and self.spread <= most_spread) or self.spread < (1 - LEAST_GAIN) * before.spread
        return (
            better
            and self.odd_valences <= before.odd_valences
            and self.beyond_band <= before.beyond_band
            and self.angle_degrees >= min(before.angle_degrees, WIDE_DEGREES)
            and self.bend_degrees <= max(SHARPER * before.bend_degrees, FLAT_DEGREES)
            and self.largest <= before.largest
            and self.cuts <= before.cuts
        )


def _figures(mesh: TriMesh, fit: SurfaceFit) -> _Figures:
    surface = fit.closest.surface
    here = np.concatenate([mesh.vertices, mesh.middles, mesh.vertices[mesh.edges].mean(axis=1)])
    out = np.linalg.norm(here - fit.closest(here)[0], axis=1)
    back = distance_to_surface(mesh, np.concatenate([fit.points, surface.vertices]))
    return _Figures(
        int((~np.isin(mesh.valence, (5, 6, 7))).sum()),
        int(_beyond_band(mesh, fit).sum()),
        relative_spread(mesh, fit),
        smallest_angle_degrees(mesh),
        float(np.degrees(np.abs(bend_radians(mesh)).max())),
        float(max(out.max(), back.max())),
        len(self_intersections(mesh)),
    )


def _relative(mesh: TriMesh, fit: SurfaceFit) -> Floats:
    return mesh.edge_lengths / goals(mesh, fit.sizing)[mesh.edges].mean(axis=1)


def relative_spread(mesh: TriMesh, fit: SurfaceFit) -> float:
    """Standard deviation over mean of the edges' lengths, each over the length that is wanted there."""
    relative = _relative(mesh, fit)
    return float(relative.std() / relative.mean())


def _beyond_band(mesh: TriMesh, fit: SurfaceFit) -> Bools:
    relative = _relative(mesh, fit)
    return (relative < SHORT) | (relative > LONG)


def is_flawed(mesh: TriMesh, fit: SurfaceFit) -> bool:
    """Has it valences other than five, six and seven, or edges far from the wanted length?"""
    return bool((~np.isin(mesh.valence, (5, 6, 7))).any() or _beyond_band(mesh, fit).any())


def collapsed_and_split(mesh: TriMesh, fit: SurfaceFit) -> TriMesh:
    """Pairs of a collapse and a split while the mesh has flaws that they mend; the mesh itself where it has none.

    Each pair is fitted to the surface and kept where fewer valences are other than 5, 6 and 7, fewer edges far from the
    wanted length, or edges more even, and where neither the largest distance nor the sharpest corners get worse. All
    pairs together raise the spread of the edges by 15 % at most.
    The mesh is closed and manifold and stays so, with its genus and its number of vertices.
    """
    most_spread = MOST_SPREAD * relative_spread(mesh, fit)
    for _ in range(MOST_PAIRS):
        better = _with_a_pair(mesh, fit, most_spread) if is_flawed(mesh, fit) else None
        if better is None:
            break
        mesh = better
    return mesh


def _with_a_pair(mesh: TriMesh, fit: SurfaceFit, most_spread: float) -> TriMesh | None:
    before = _figures(mesh, fit)
    for draft in islice(_drafts(mesh, fit), TRIALS):
        trial, _ = flip_towards_valence_six(draft)
        for _ in range(STEPS):
            trial = fit.stepped(trial)
        if _figures(trial, fit).pays(before, most_spread):
            return trial
    return None
