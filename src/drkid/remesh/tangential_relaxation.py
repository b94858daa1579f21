"""Tangential relaxation: vertices move along the surface until edges are about equally long.

Botsch et al., Polygon Mesh Processing (2010), section 6.5.3, for the tangential step and the projection; Persson and
Strang, "A simple mesh generator in MATLAB" (SIAM Review 2004), for edges as springs.
"""

import numpy as np
from numba import njit

from drkid.mesh import Floats, Ints, TriMesh, summed
from drkid.remesh.closest_point import ClosestPoint
from drkid.remesh.half_edge import Index, dot, face_normal, following, half_edges, preceding, shape
from drkid.remesh.sizing_field import SizingField, goals

LEAST_SHAPE = 0.5  # of a face after the move, unless one was worse before
STEP = 0.8  # of the mean pull of the springs at a vertex; all move at once, so less than the whole
FOLD_COSINE = -0.3  # inner dihedral angles stay above 70°, unless one was sharper before
MOST_VALENCE = 64  # room for the faces around a vertex; one with more stays where it is


@njit(cache=True)
def _look_around(origin: Ints, twin: Ints, vertices: Floats, h: Index, normals: Floats) -> tuple[int, float, float]:
    # Of the faces around a vertex: how many, the least shape, the least cosine with a neighbour, and their normals.
    count, least, fold = 0, 1.0, 1.0
    g = h
    while True:
        side = face_normal(origin, vertices, g)
        least = min(least, shape(vertices, origin[g], origin[following(g)], origin[preceding(g)]))
        fold = min(fold, dot(side, face_normal(origin, vertices, twin[g])))
        fold = min(fold, dot(side, face_normal(origin, vertices, twin[following(g)])))
        for d in range(3):
            normals[count, d] = side[d]
        count += 1
        g = twin[preceding(g)]
        if g == h or count == MOST_VALENCE:
            return count, least, fold


@njit(cache=True)
def _move_where_harmless(origin: Ints, twin: Ints, start: Ints, vertices: Floats, targets: Floats, which: Ints) -> None:
    before, after, was = np.empty((MOST_VALENCE, 3)), np.empty((MOST_VALENCE, 3)), np.empty(3)
    for v in which:
        count, shape_before, fold_before = _look_around(origin, twin, vertices, start[v], before)
        for d in range(3):
            was[d], vertices[v, d] = vertices[v, d], targets[v, d]
        _, shape_after, fold_after = _look_around(origin, twin, vertices, start[v], after)
        harmless = shape_after >= min(LEAST_SHAPE, shape_before) and fold_after >= min(FOLD_COSINE, fold_before)
        for i in range(count):
            turned = before[i, 0] * after[i, 0] + before[i, 1] * after[i, 1] + before[i, 2] * after[i, 2]
            harmless = harmless and turned > 0
        if not harmless or count == MOST_VALENCE:
            for d in range(3):
                vertices[v, d] = was[d]


def moved_where_harmless(mesh: TriMesh, targets: Floats, which: Ints) -> TriMesh:
    """The vertices `which` (n,) at `targets` (V, 3), unless a face would turn by 90° or become a sliver or a fold."""
    vertices = mesh.vertices.copy()
    _move_where_harmless(*half_edges(mesh), vertices, targets, which)
    return mesh.moved(vertices)


def relax(mesh: TriMesh, closest: ClosestPoint, rounds: int, sizing: SizingField | None = None) -> TriMesh:
    """`rounds` times: a step towards even edges along the surface, then to the closest point of the surface.

    Each edge is a spring of the mean length, or of that of a sizing field. (The neighbours' mean, the textbook's
    target, evens out areas: on coarse meshes it left edges a third less even and cut corners of the shape.) A vertex
    stays where it is in a round if one of its faces would turn by 90° or become a sliver or a fold, or if the surface
    looks the other way at its new place (the far side of a thin wall). The mesh is closed and manifold; its faces are
    kept.
    """
    edges = half_edges(mesh)
    ends, every = np.concatenate([mesh.edges, mesh.edges[:, ::-1]]), np.arange(len(mesh.vertices))
    for _ in range(rounds):
        vertices, normals = mesh.vertices.copy(), mesh.vertex_normals
        along = vertices[ends[:, 1]] - vertices[ends[:, 0]]
        goal = goals(mesh, sizing)[ends].mean(axis=1, keepdims=True)
        surplus = 1 - goal / np.linalg.norm(along, axis=1, keepdims=True)
        step = summed(ends[:, 0], surplus * along, len(vertices))
        step *= STEP / mesh.valence[:, None]
        step -= np.einsum("ij,ij->i", step, normals)[:, None] * normals
        targets, facing = closest(vertices + step)
        same_side = np.einsum("ij,ij->i", facing, normals) > 0
        _move_where_harmless(*edges, vertices, np.where(same_side[:, None], targets, vertices), every)
        mesh = mesh.moved(vertices)
    return mesh
