"""Edge flip and edge collapse where they bring triangles nearer to their classes (section Edge flip and collapse).

The paper applies them in the first iteration only. Here they see a mesh as the map of its half-edges: `third[a, b]`
is the third corner of the face on the left of a → b.
"""

from collections.abc import Callable, Sequence

import numpy as np

from drkid.mesh import Floats, Ints, TriMesh

VALENCE_RANGE = (4, 8)  # of all vertices, after any operator
LEAST_COSINE = 0.5  # a new face may lean by 60° at most against the faces it replaces
HalfEdges = dict[tuple[int, int], int]
Triangle = tuple[int, int, int]
Triangles = Sequence[Triangle]


def half_edge_map(faces: Ints) -> HalfEdges:
    """Third corner of the face on the left of each half-edge."""
    third: HalfEdges = {}
    for a, b, c in faces.tolist():
        third[a, b], third[b, c], third[c, a] = c, a, b
    return third


def mesh_of(third: HalfEdges, vertices: Floats) -> TriMesh:
    """The mesh of a half-edge map, vertices that no face uses left out."""
    faces = np.array(sorted((a, b, c) for (a, b), c in third.items() if a < b and a < c), np.int64)
    return TriMesh(vertices, faces).submesh(np.arange(len(faces)))


def _neighbours(third: HalfEdges, a: int) -> list[int]:
    """The ring of a vertex; any half-edge out of it will do to start."""
    start = next(b for (v, b) in third if v == a)
    ring, b = [start], third[a, start]
    while b != start:
        ring.append(b)
        b = third[a, b]
    return ring


def _normal(vertices: Floats, face: Triangle) -> Floats:
    a, b, c = vertices[list(face)]
    normal = np.cross(b - a, c - a)
    return normal / max(np.linalg.norm(normal), 1e-300)


def _distance(vertices: Floats, faces: Triangles, means: Floats) -> float:
    """Sum of the faces' squared distances from the nearest class (equation 3)."""
    corners = vertices[np.array(list(faces))]
    points = np.sort(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2), axis=1)
    return float(((points[:, None] - means[None]) ** 2).sum(axis=2).min(axis=1).sum())


def _leaning(vertices: Floats, old: Triangles, new: Triangles) -> bool:
    before = np.sum([_normal(vertices, f) for f in old], axis=0)
    before /= max(np.linalg.norm(before), 1e-300)
    return any(_normal(vertices, f) @ before < LEAST_COSINE for f in new)


def _replace(third: HalfEdges, old: Triangles, new: Triangles) -> None:
    for a, b, c in old:
        del third[a, b], third[b, c], third[c, a]
    for a, b, c in new:
        third[a, b], third[b, c], third[c, a] = c, a, b


def flip_towards_classes(mesh: TriMesh, means: Floats) -> tuple[TriMesh, int]:
    """Flip, in the order of edges, each edge whose flip lowers the clustering distance; the mesh and how many."""

    def improves(old: Triangles, new: Triangles, _before: Ints, _after: Ints) -> bool:
        return _distance(mesh.vertices, new, means) < _distance(mesh.vertices, old, means)

    return _flip(mesh, improves)


def flip_towards_valence_six(mesh: TriMesh) -> tuple[TriMesh, int]:
    """Flip edges while the sum of (valence − 6)² falls (Valence Optimization of algorithm 3)."""

    def improves(_old: Triangles, _new: Triangles, before: Ints, after: Ints) -> bool:
        return bool(((after - 6) ** 2).sum() < ((before - 6) ** 2).sum())

    mesh, total = _flip(mesh, improves)
    flips = total
    while flips:
        mesh, flips = _flip(mesh, improves)
        total += flips
    return mesh, total


def _flip(mesh: TriMesh, improves: Callable[[Triangles, Triangles, Ints, Ints], bool]) -> tuple[TriMesh, int]:
    """One pass over the edges; `improves` sees the old and new faces and the four valences before and after."""
    third, valence, flips = half_edge_map(mesh.faces), mesh.valence.copy(), 0
    for a, b in mesh.edges.tolist():
        if (a, b) not in third:
            continue
        c, d = third[a, b], third[b, a]
        before = valence[[a, b, c, d]]
        after = before + np.array([-1, -1, 1, 1])
        if (c, d) in third or after.min() < VALENCE_RANGE[0] or after.max() > VALENCE_RANGE[1]:
            continue
        old, new = [(a, b, c), (b, a, d)], [(a, d, c), (d, b, c)]
        if improves(old, new, before, after) and not _leaning(mesh.vertices, old, new):
            _replace(third, old, new)
            valence[[a, b, c, d]] = after
            flips += 1
    return mesh_of(third, mesh.vertices), flips


def collapse_towards_classes(mesh: TriMesh, means: Floats) -> tuple[TriMesh, int]:
    """Collapse edges to their middles where the faces that stay come nearer to their classes; the mesh, how many.

    The two faces that vanish are not counted as a gain: without that every collapse would look like one.
    """
    third, vertices, collapses = half_edge_map(mesh.faces), mesh.vertices.copy(), 0
    for a, b in mesh.edges[np.argsort(mesh.edge_lengths, kind="stable")].tolist():
        if (a, b) in third and _collapse(third, vertices, (a, b), means):
            collapses += 1
    return mesh_of(third, vertices), collapses


def _collapse(third: HalfEdges, vertices: Floats, edge: tuple[int, int], means: Floats) -> bool:
    a, b = edge
    ring_a, ring_b = _neighbours(third, a), _neighbours(third, b)
    wings = {third[a, b], third[b, a]}
    merged = len(ring_a) + len(ring_b) - 4
    thinned = min(len(_neighbours(third, w)) for w in wings) - 1
    if set(ring_a) & set(ring_b) != wings or merged > VALENCE_RANGE[1] or min(merged, thinned) < VALENCE_RANGE[0]:
        return False  # the link condition (Dey et al. 1999), and valences that stay in range
    around_a = [(a, x, third[a, x]) for x in ring_a]
    around_b = [(b, x, third[b, x]) for x in ring_b]
    old = around_a + [f for f in around_b if a not in f]
    staying = [f for f in old if b not in f or a not in f]
    new = [(_renamed(f[0], b, a), _renamed(f[1], b, a), _renamed(f[2], b, a)) for f in staying]
    moved = vertices.copy()
    moved[a] = (vertices[a] + vertices[b]) / 2
    if any(_normal(vertices, f) @ _normal(moved, g) < LEAST_COSINE for f, g in zip(staying, new, strict=True)):
        return False
    if _distance(moved, new, means) >= _distance(vertices, staying, means):
        return False
    _replace(third, old, new)
    vertices[a] = moved[a]
    return True


def _renamed(vertex: int, old: int, new: int) -> int:
    return new if vertex == old else vertex
