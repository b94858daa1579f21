"""Edge collapses down to a number of vertices, on a closed manifold that stays one.

Dey, Edelsbrunner, Guha and Nekhayev, "Topology preserving edge contraction" (1999), for the link condition; Garland and
Heckbert, "Surface simplification using quadric error metrics" (SIGGRAPH 1997), for the error.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drkid.mesh import Floats, Ints, TriMesh, summed
from drkid.remesh.half_edge import (
    HalfEdges,
    Index,
    are_joined,
    dot,
    face_normal,
    following,
    half_edges,
    mesh_of,
    normal,
    preceding,
    valence_of,
)
from drkid.remesh.sizing_field import SizingField

QUADRIC_WEIGHT = 10.0  # of the squared distance from the surface, against the squared length of the edge
ROUND = 0.1  # share of the edges that one round may collapse: costs are then never far out of date
Limits = tuple[float, float, float, float]
# Least cosines of a turned normal and of a fold, least and greatest valence; the next where the one before gets stuck.
LIMITS: tuple[Limits, ...] = ((0.5, -0.2, 4.0, 8.0), (0.2, -0.5, 4.0, 9.0), (0.0, -0.8, 3.0, 12.0))


@njit(cache=True)
def keeps_the_topology(origin: Ints, twin: Ints, start: Ints, h: int) -> bool:
    """The link condition on a closed surface: the ends of h's edge have only the two wings in common."""
    b, c, d = origin[twin[h]], origin[preceding(h)], origin[preceding(twin[h])]
    g = start[origin[h]]
    end = g
    while True:
        x = origin[following(g)]
        if x not in (b, c, d) and are_joined(origin, twin, start, x, b):
            return False
        g = twin[preceding(g)]
        if g == end:
            return True


@njit(cache=True)
def _keeps_the_shape(origin: Ints, twin: Ints, start: Ints, vertices: Floats, h: int, limits: Limits) -> bool:
    # The faces around the vertex that goes neither turn over nor fold against their neighbours.
    turn, fold, least, most = limits
    g = twin[h]
    a, c, d = origin[h], origin[preceding(h)], origin[preceding(g)]
    merged = valence_of(twin, h) + valence_of(twin, g) - 4
    thinned = min(valence_of(twin, start[c]), valence_of(twin, start[d])) - 1
    if merged > most or min(merged, thinned) < least:
        return False
    before = face_normal(origin, vertices, twin[following(g)])
    e = twin[preceding(g)]
    while e != following(h):
        new = normal(vertices, a, origin[following(e)], origin[preceding(e)])
        beyond = face_normal(origin, vertices, twin[following(e)])
        if dot(new, face_normal(origin, vertices, e)) <= turn or min(dot(new, before), dot(new, beyond)) < fold:
            return False
        before = new
        e = twin[preceding(e)]
    return dot(before, face_normal(origin, vertices, twin[preceding(h)])) >= fold


@njit(cache=True)
def collapse_edge(origin: Ints, twin: Ints, start: Ints, h: int) -> None:
    """Remove the vertex that half-edge h runs to, and the edge's two faces; what met there meets at h's origin."""
    g = twin[h]
    a, c, d = origin[h], origin[preceding(h)], origin[preceding(g)]
    e = twin[preceding(g)]
    while e != following(h):
        origin[e] = a
        e = twin[preceding(e)]
    ca, bc, ad, db = twin[preceding(h)], twin[following(h)], twin[following(g)], twin[preceding(g)]
    for one, two in ((ca, bc), (ad, db)):
        twin[one] = two
        twin[two] = one
    start[a], start[c], start[d] = ca, bc, ad
    for k in range(3):
        origin[3 * (h // 3) + k] = -1
        origin[3 * (g // 3) + k] = -1


@njit(cache=True)
def _mark_neighbours(origin: Ints, twin: Ints, h: Index, marked: NDArray[np.bool_]) -> None:
    e = h
    while True:
        marked[origin[following(e)]] = True
        e = twin[preceding(e)]
        if e == h:
            return


@njit(cache=True)
def _collapse_round(
    origin: Ints, twin: Ints, start: Ints, vertices: Floats, order: Ints, budget: int, limits: Limits
) -> list[tuple[Index, Index]]:
    # The half-edges of `order`, cheapest first; a vertex next to a collapse waits for the next round.
    # The vertices that stayed and those that went.
    waiting = np.zeros(len(start), np.bool_)
    done: list[tuple[Index, Index]] = [(0, 0) for _ in range(0)]
    for h in order:
        if len(done) == budget:
            break
        a, b = origin[h], origin[twin[h]]
        if a < 0 or waiting[a] or waiting[b] or not keeps_the_topology(origin, twin, start, h):
            continue
        if _keeps_the_shape(origin, twin, start, vertices, h, limits):
            _mark_neighbours(origin, twin, start[a], waiting)
            _mark_neighbours(origin, twin, start[b], waiting)
            collapse_edge(origin, twin, start, h)
            done.append((a, b))
    return done


def _vertex_quadrics(mesh: TriMesh) -> Floats:
    """(V, 4, 4): a third of the area of each adjacent face times the quadric of its plane."""
    offset = np.einsum("ij,ij->i", mesh.face_normals, mesh.corners[:, 0])
    plane = np.column_stack([mesh.face_normals, -offset])
    quadric = plane[:, :, None] * plane[:, None, :] * (mesh.areas / 3)[:, None, None]
    thrice = np.tile(quadric.reshape(-1, 16), (3, 1))
    return summed(mesh.faces.T.ravel(), thrice, len(mesh.vertices)).reshape(-1, 4, 4)


def _costs(edges: HalfEdges, vertices: Floats, quadrics: Floats) -> Floats:
    """(3F,): of removing the vertex that a half-edge runs to: squared length and mean squared distance of planes."""
    stay, go = edges.origin, edges.origin[edges.twin]
    point = np.column_stack([vertices[stay], np.ones(len(stay))])
    weight = np.trace(quadrics[:, :3, :3], axis1=1, axis2=2)  # normals are unit: the area that the quadric stands for
    away = np.einsum("ij,ijk,ik->i", point, quadrics[go], point) / np.maximum(weight[go], np.finfo(float).tiny)
    return ((vertices[stay] - vertices[go]) ** 2).sum(axis=1) + QUADRIC_WEIGHT * away


def collapse_to(mesh: TriMesh, count: int, sizing: SizingField | None = None) -> TriMesh:
    """Collapse edges onto one of their ends, short and flat ones first, until `count` vertices are left or none can go.

    With a sizing field, short is what is short beside the length wanted there.

    Every vertex of the result is one of the mesh, which is closed and manifold; so is the result, with the same genus.
    """
    middle = mesh.vertices.mean(axis=0)
    mesh = mesh.moved(mesh.vertices - middle)  # the quadrics' squares cancel less near the origin
    quadrics = _vertex_quadrics(mesh)
    weight = None if sizing is None else sizing(mesh.vertices + middle) ** -2
    for limits in LIMITS:
        while len(mesh.vertices) > count:
            edges = half_edges(mesh)
            costs = _costs(edges, mesh.vertices, quadrics)
            order = np.argsort(costs if weight is None else costs * weight[edges.origin], kind="stable")
            budget = min(len(mesh.vertices) - count, max(1, int(ROUND * len(mesh.vertices))))
            done = _collapse_round(*edges, mesh.vertices.copy(), order, budget, limits)
            if not done:
                break
            stayed, went = np.array(done).T
            quadrics[stayed] += quadrics[went]
            left = np.unique(edges.origin[edges.origin >= 0])
            quadrics, weight = quadrics[left], None if weight is None else weight[left]
            mesh = mesh_of(edges, mesh.vertices)
    return mesh.moved(mesh.vertices + middle)
