"""Edge flips that bring valences nearer to six.

Botsch and Kobbelt, "A remeshing approach to multiresolution modeling" (SGP 2004), section 4; Botsch et al., Polygon
Mesh Processing (2010), section 6.5.3.
"""

import numpy as np
from numba import njit

from drkid.mesh import Floats, Ints, TriMesh
from drkid.remesh.half_edge import (
    are_joined,
    dot,
    face_normal,
    following,
    half_edges,
    mesh_of,
    normal,
    preceding,
    shape,
    valence_of,
)

LEAST_VALENCE = 4
LEAST_COSINE = 0.5  # normals across the flipped edge stay within 60°, unless they were farther apart before
LEAST_SHAPE = 0.5  # of a new face, unless an old one was worse: a triangle with angles 30°, 30° and 120°
FOLD_COSINE = -0.5  # inner dihedral angles stay above 60°


@njit(cache=True)
def flip_edge(origin: Ints, twin: Ints, start: Ints, h: int) -> None:
    """Turn the edge of half-edge h in the quadrilateral of its two faces."""
    g = twin[h]
    after_h, before_h, after_g, before_g = following(h), preceding(h), following(g), preceding(g)
    a, b, c, d = origin[h], origin[g], origin[before_h], origin[before_g]
    ca, ad, db, bc = twin[before_h], twin[after_g], twin[before_g], twin[after_h]
    origin[h], origin[after_h], origin[before_h] = d, c, a
    origin[g], origin[after_g], origin[before_g] = c, d, b
    for inner, outer in ((after_h, ca), (before_h, ad), (after_g, db), (before_g, bc)):
        twin[inner] = outer
        twin[outer] = inner
    start[a], start[b], start[c], start[d] = before_h, before_g, after_h, after_g


@njit(cache=True)
def is_harmless(origin: Ints, twin: Ints, vertices: Floats, h: int) -> bool:
    """Does flipping the edge of half-edge h make no fold, no sliver and no sharp ridge that was not there before?"""
    g = twin[h]
    a, b, c, d = origin[h], origin[g], origin[preceding(h)], origin[preceding(g)]
    old, older = normal(vertices, a, b, c), normal(vertices, b, a, d)
    new, newer = normal(vertices, a, d, c), normal(vertices, d, b, c)
    if dot(new, newer) < min(LEAST_COSINE, dot(old, older)):
        return False
    if min(dot(new, old), dot(new, older), dot(newer, old), dot(newer, older)) <= 0:
        return False
    worst = min(shape(vertices, a, b, c), shape(vertices, b, a, d))
    if min(shape(vertices, a, d, c), shape(vertices, d, b, c)) < min(LEAST_SHAPE, worst):
        return False
    for inner, side, was in (
        (preceding(h), new, old),
        (following(g), new, older),
        (preceding(g), newer, older),
        (following(h), newer, old),
    ):
        beyond = face_normal(origin, vertices, twin[inner])
        if dot(side, beyond) < min(FOLD_COSINE, dot(was, beyond)):
            return False
    return True


@njit(cache=True)
def _flip_once(origin: Ints, twin: Ints, start: Ints, vertices: Floats, valence: Ints) -> int:
    flips = 0
    for h in range(len(origin)):
        g = twin[h]
        if g < h:
            continue
        a, b, c, d = origin[h], origin[g], origin[preceding(h)], origin[preceding(g)]
        # Σ (v − 6)² changes by 2 (v_c + v_d − v_a − v_b + 2).
        if valence[c] + valence[d] - valence[a] - valence[b] + 2 >= 0 or min(valence[a], valence[b]) <= LEAST_VALENCE:
            continue
        if are_joined(origin, twin, start, c, d) or not is_harmless(origin, twin, vertices, h):
            continue
        flip_edge(origin, twin, start, h)
        valence[a] -= 1
        valence[b] -= 1
        valence[c] += 1
        valence[d] += 1
        flips += 1
    return flips


@njit(cache=True)
def _flip_all(origin: Ints, twin: Ints, start: Ints, vertices: Floats) -> int:
    valence = np.empty(len(start), np.int64)
    for v in range(len(start)):
        valence[v] = valence_of(twin, start[v])
    total = 0
    while True:
        flips = _flip_once(origin, twin, start, vertices, valence)
        total += flips
        if flips == 0:
            return total


def flip_towards_valence_six(mesh: TriMesh) -> tuple[TriMesh, int]:
    """Flip edges, in the order of faces, while that lowers Σ (valence − 6)²; the mesh, and how many were flipped.

    No edge is doubled, no valence falls below four, no normal turns by 90° or more. The mesh is closed and manifold.
    """
    edges = half_edges(mesh)
    flips = _flip_all(*edges, mesh.vertices.copy())
    return mesh_of(edges, mesh.vertices), flips
