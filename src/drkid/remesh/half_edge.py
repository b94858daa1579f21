"""Half-edges of a closed triangle mesh in three arrays, for kernels that change it.

Half-edge 3f + i runs from corner i of face f to the corner after it (Botsch et al., Polygon Mesh Processing, chapter 2;
Rossignac's corner table, 1999). `origin` (3F,) is the vertex that a half-edge starts from, `twin` (3F,) the
half-edge that runs against it, `start` (V,) a half-edge that starts from a vertex. A removed face has origins −1.
"""

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from drkid.mesh import Floats, Ints, TriMesh

Triple = tuple[float, float, float]
Index = Any  # a number out of an array of them, which numpy's stubs take for an array


class HalfEdges(NamedTuple):
    """The three arrays; kernels write into them, nobody else sees them."""

    origin: Ints
    twin: Ints
    start: Ints


def half_edges(mesh: TriMesh) -> HalfEdges:
    """The half-edges of a closed manifold mesh whose vertices are all used."""
    origin = mesh.faces.ravel().copy()
    order = mesh.sides_by_edge.reshape(-1, 2)
    twin = np.empty_like(origin)
    twin[order[:, 0]], twin[order[:, 1]] = order[:, 1], order[:, 0]
    start = np.empty(len(mesh.vertices), np.int64)
    start[origin] = np.arange(len(origin))
    return HalfEdges(origin, twin, start)


def mesh_of(edges: HalfEdges, vertices: Floats) -> TriMesh:
    """The faces that are left, and the vertices that they use."""
    faces = edges.origin.reshape(-1, 3)
    whole = TriMesh(vertices, faces[faces[:, 0] >= 0])
    return whole.submesh(np.arange(len(whole.faces)))


@njit(cache=True)
def following(h: Index) -> int:
    """The half-edge after h in its face."""
    return h - 2 if h % 3 == 2 else h + 1


@njit(cache=True)
def preceding(h: Index) -> int:
    """The half-edge before h in its face."""
    return h + 2 if h % 3 == 0 else h - 1


@njit(cache=True)
def valence_of(twin: Ints, h: Index) -> int:
    """Number of edges at the vertex that h starts from."""
    count, g = 1, twin[preceding(h)]
    while g != h:
        count += 1
        g = twin[preceding(g)]
    return count


@njit(cache=True)
def are_joined(origin: Ints, twin: Ints, start: Ints, a: Index, b: Index) -> bool:
    """Is there an edge between the vertices a and b?"""
    h = start[a]
    g = h
    while True:
        if origin[following(g)] == b:
            return True
        g = twin[preceding(g)]
        if g == h:
            return False


@njit(cache=True)
def normal(vertices: Floats, a: Index, b: Index, c: Index) -> Triple:
    """Unit normal of the triangle of three vertices; zero where it has no area."""
    ux, uy, uz = (vertices[b, 0] - vertices[a, 0], vertices[b, 1] - vertices[a, 1], vertices[b, 2] - vertices[a, 2])
    vx, vy, vz = (vertices[c, 0] - vertices[a, 0], vertices[c, 1] - vertices[a, 1], vertices[c, 2] - vertices[a, 2])
    x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    length = np.sqrt(x * x + y * y + z * z)
    return (x / length, y / length, z / length) if length > 0 else (0.0, 0.0, 0.0)


@njit(cache=True)
def face_normal(origin: Ints, vertices: Floats, h: Index) -> Triple:
    """Unit normal of the face that h belongs to."""
    return normal(vertices, origin[h], origin[following(h)], origin[preceding(h)])


@njit(cache=True)
def dot(a: Triple, b: Triple) -> float:
    """Scalar product of two triples."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True)
def shape(vertices: Floats, a: Index, b: Index, c: Index) -> float:
    """4√3 area / Σ side²: 1 for an equilateral triangle, 0 for one without area (Botsch et al., section 6.1)."""
    squares, ux, uy, uz, vx, vy, vz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i, j in ((a, b), (b, c), (c, a)):
        for d in range(3):
            squares += (vertices[j, d] - vertices[i, d]) ** 2
    ux, uy, uz = (vertices[b, 0] - vertices[a, 0], vertices[b, 1] - vertices[a, 1], vertices[b, 2] - vertices[a, 2])
    vx, vy, vz = (vertices[c, 0] - vertices[a, 0], vertices[c, 1] - vertices[a, 1], vertices[c, 2] - vertices[a, 2])
    x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    return 2 * np.sqrt(3.0) * np.sqrt(x * x + y * y + z * z) / squares if squares > 0 else 0.0
