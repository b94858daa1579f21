"""Edge flips that let pairs of irregular vertices glide together and vanish, each tried with what it does to the edges.

A vertex of valence five beside one of valence seven is a dislocation of the triangular lattice; a flip moves it by one
edge (Sadoc and Mosseri, Geometrical Frustration, 1999, chapter 4). A flip that single counts of valences do not favour
pays off once its neighbourhood has relaxed: so each is tried, relaxed and kept if the edges have become more even.
"""

import numpy as np
from numba import njit

from drkid.mesh import Floats, Ints, TriMesh
from drkid.remesh.edge_flip import LEAST_VALENCE, flip_edge, is_harmless
from drkid.remesh.half_edge import are_joined, following, half_edges, mesh_of, preceding, valence_of
from drkid.remesh.sizing_field import SizingField, goals

ROOM = 160  # vertices around a flip that may move
RINGS = 2  # of them
SWEEPS = 8  # of relaxation after a flip
STEP = 0.8  # of the Newton step of the springs at a vertex
VALENCE_WEIGHT = 0.01  # of (valence − 6)⁴, against the squared relative errors of edges: 4 and 8 are to go first
MOST_CLIMB = 2  # of Σ (valence − 6)²: a dislocation that glides changes it by nothing, one that turns by two


@njit(cache=True)
def _gather(origin: Ints, twin: Ints, start: Ints, h: int, marks: Ints, mark: int, region: Ints) -> int:
    # The vertices within RINGS edges of the four that a flip concerns.
    g = twin[h]
    count = 0
    for v in (origin[h], origin[g], origin[preceding(h)], origin[preceding(g)]):
        marks[v] = mark
        region[count] = v
        count += 1
    first = 0
    for _ in range(RINGS):
        last = count
        for i in range(first, last):
            e = start[region[i]]
            end = e
            while True:
                w = origin[following(e)]
                if marks[w] != mark and count < ROOM:
                    marks[w] = mark
                    region[count] = w
                    count += 1
                e = twin[preceding(e)]
                if e == end:
                    break
        first = last
    return count


@njit(cache=True)
def _energy(
    edges: tuple[Ints, Ints, Ints], vertices: Floats, goal: Floats, marks: Ints, mark: int, region: Ints
) -> float:
    origin, twin, start = edges
    # Σ (l / goal − 1)² over the edges at the region's vertices, and the valences' share.
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
def _relax(
    origin: Ints, twin: Ints, start: Ints, vertices: Floats, normals: Floats, goal: Floats, region: Ints
) -> None:
    # Gauss and Seidel's sweeps: each vertex by the Newton step of its springs, in its tangent plane.
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


@njit(cache=True)
def _is_candidate(origin: Ints, twin: Ints, start: Ints, h: int) -> bool:
    # The flip moves an irregular vertex and raises Σ (valence − 6)² by no more than MOST_CLIMB.
    g = twin[h]
    a, b = valence_of(twin, h), valence_of(twin, g)
    c, d = valence_of(twin, preceding(h)), valence_of(twin, preceding(g))
    if 2 * (c + d - a - b + 2) > MOST_CLIMB or min(a, b) <= LEAST_VALENCE:
        return False
    regular = a == 6 and b == 6 and c == 6 and d == 6
    return not regular and not are_joined(origin, twin, start, origin[preceding(h)], origin[preceding(g)])


@njit(cache=True)
def _glide(
    edges: tuple[Ints, Ints, Ints], vertices: Floats, normals: Floats, goal: Floats, order: Ints, heat: Floats
) -> int:
    # Try the flips of `order`, each with its share of heat; the number kept.
    origin, twin, start = edges
    marks, mark, kept = np.full(len(start), -1, np.int64), 0, 0
    room, saved = np.empty(ROOM, np.int64), np.empty((ROOM, 3))
    for i in range(len(order)):
        h = order[i]
        if not _is_candidate(origin, twin, start, h) or not is_harmless(origin, twin, vertices, h):
            continue
        mark += 1
        region = room[: _gather(origin, twin, start, h, marks, mark, room)]
        before = _energy(edges, vertices, goal, marks, mark, region)
        for k in range(len(region)):
            saved[k] = vertices[region[k]]
        flip_edge(origin, twin, start, h)
        _relax(origin, twin, start, vertices, normals, goal, region)
        if _energy(edges, vertices, goal, marks, mark, region) < before + heat[i]:
            kept += 1
        else:
            for _ in range(3):  # four flips of an edge are none
                flip_edge(origin, twin, start, h)
            for k in range(len(region)):
                vertices[region[k]] = saved[k]
    return kept


def glide(
    mesh: TriMesh, sweeps: int, heat: float, rng: np.random.Generator, sizing: SizingField | None = None
) -> TriMesh:
    """Try to flip every edge near irregular vertices, in random order, `sweeps` times.

    A flip is kept where the squared relative errors of the edges around it, against the mean edge or what a sizing
    field says, and what irregular valences cost, sum to
    less than before or, as in annealing, to more by no more than a random share of `heat` (exponentially distributed),
    which falls to nothing with the sweeps. Vertices move in their tangent planes. The mesh is closed and manifold.
    """
    edges, vertices, normals = half_edges(mesh), mesh.vertices.copy(), mesh.vertex_normals
    goal = goals(mesh, sizing)
    halves = np.arange(len(edges.origin))
    halves = halves[halves < edges.twin]
    for left in range(sweeps - 1, -1, -1):
        heats = heat * left / sweeps * rng.exponential(size=len(halves))
        kept = _glide((edges.origin, edges.twin, edges.start), vertices, normals, goal, rng.permutation(halves), heats)
        if kept == 0:
            break
    return mesh_of(edges, vertices)
