"""Edge flips that let pairs of irregular vertices glide together and vanish, each tried with what it does to the edges.

A vertex of valence five beside one of valence seven is a dislocation of the triangular lattice; a flip moves it by one
edge (Sadoc and Mosseri, Geometrical Frustration, 1999, chapter 4). A flip that single counts of valences do not favour
pays off once its neighbourhood has relaxed: so each is tried, relaxed and kept if the edges have become more even.
"""

import numpy as np
from numba import njit

from drkid.mesh import Floats, Ints, TriMesh
from drkid.remesh.edge_flip import LEAST_VALENCE, flip_edge, is_harmless
from drkid.remesh.half_edge import are_joined, half_edges, mesh_of, preceding, valence_of
from drkid.remesh.sizing_field import SizingField, goals
from drkid.remesh.spring_energy import energy, gather, relax_region

ROOM = 160  # vertices around a flip that may move
MOST_CLIMB = 2  # of Σ (valence − 6)²: a dislocation that glides changes it by nothing, one that turns by two


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
def _save(vertices: Floats, region: Ints, saved: Floats) -> None:
    for k in range(len(region)):
        for d in range(3):
            saved[k, d] = vertices[region[k], d]


@njit(cache=True)
def _restore(vertices: Floats, region: Ints, saved: Floats) -> None:
    for k in range(len(region)):
        for d in range(3):
            vertices[region[k], d] = saved[k, d]


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
        room[0], room[1], room[2], room[3] = (
            origin[h],
            origin[twin[h]],
            origin[preceding(h)],
            origin[preceding(twin[h])],
        )
        region = room[: gather(edges, 4, marks, mark, room)]
        before = energy(edges, vertices, goal, marks, mark, region)
        _save(vertices, region, saved)
        flip_edge(origin, twin, start, h)
        relax_region(origin, twin, start, vertices, normals, goal, region)
        if energy(edges, vertices, goal, marks, mark, region) < before + heat[i]:
            kept += 1
        else:
            for _ in range(3):  # four flips of an edge are none
                flip_edge(origin, twin, start, h)
            _restore(vertices, region, saved)
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
