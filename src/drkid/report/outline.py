"""The body of a part as few flat polygons, and their creases: what a line drawing needs of it."""

import numpy as np

from drkid.mesh import Bools, Floats, TriMesh
from drkid.solid import Solid

NEARLY_CONVEX = 1.7  # volume of the hull over the part's: more than its pockets take, less than a curved shell's
DECIMALS = 5  # of unit normals and of distances in mm, by which triangles share a plane
MOST_VERTICES = 40  # of a hull that is drawn as it is: a flat triangle has 6 or 12, a curved one hundreds
CELLS = 7  # along a hull with more: of the vertices of each cell the farthest out is kept
CREASE_COSINE = np.cos(np.radians(35.0))  # of the angle between faces, from which on their edge is drawn


def outline(mesh: TriMesh) -> tuple[Floats, ...]:
    """The faces (n, 3) of a part's convex hull, whole, counter-clockwise from outside: its pockets are left out.

    A part that is far from convex, as a curved one is, keeps its own triangles.
    """
    hull = Solid.hull(mesh.vertices)
    if hull.volume > NEARLY_CONVEX * mesh.volume:
        return tuple(mesh.corners[mesh.areas > 0])
    return _flat_faces(_coarse(hull.mesh()))


def creases(polygons: tuple[Floats, ...]) -> tuple[Bools, ...]:
    """For each side (n,) of each polygon (n, 3) whether it is an edge to draw: a crease, or no other polygon is there.

    Facets of a smooth surface meet in edges that are none of the body's.
    """
    normals = [np.cross(p - p[0], np.roll(p, -1, axis=0) - p[0]).sum(axis=0) for p in polygons]
    normals = [n / max(float(np.linalg.norm(n)), 1e-300) for n in normals]
    _, index = np.unique(np.round(np.concatenate(polygons), DECIMALS) + 0.0, axis=0, return_inverse=True)
    rings = np.split(index.ravel(), np.cumsum([len(p) for p in polygons])[:-1])
    sides = [list(zip(ring.tolist(), np.roll(ring, -1).tolist(), strict=True)) for ring in rings]
    owner = {side: i for i, ring in enumerate(sides) for side in ring}
    beyond = [[owner.get((b, a), -1) for a, b in ring] for ring in sides]
    return tuple(
        np.array([j < 0 or float(normals[i] @ normals[j]) < CREASE_COSINE for j in others], np.bool_)
        for i, others in enumerate(beyond)
    )


def _coarse(convex: TriMesh) -> TriMesh:
    """The hull of the vertices that stand out the most, where there are many."""
    if len(convex.vertices) <= MOST_VERTICES:
        return convex
    low, size = convex.vertices.min(axis=0), float(convex.extents.max())
    _, cell = np.unique(
        np.floor((convex.vertices - low) * (CELLS / size)).astype(np.int64), axis=0, return_inverse=True
    )
    out = np.linalg.norm(convex.vertices - convex.vertices.mean(axis=0), axis=1)
    order = np.lexsort((-out, cell.ravel()))
    first = np.unique(cell.ravel()[order], return_index=True)[1]
    return Solid.hull(convex.vertices[order[first]]).mesh()


def _flat_faces(convex: TriMesh) -> tuple[Floats, ...]:
    offset = np.einsum("fk,fk->f", convex.face_normals, convex.corners[:, 0])
    planes = np.round(np.column_stack([convex.face_normals, offset]), DECIMALS) + 0.0
    found, index = np.unique(planes[convex.areas > 0], axis=0, return_inverse=True)
    faces, index = convex.faces[convex.areas > 0], index.ravel()
    return tuple(_ring(convex.vertices[np.unique(faces[index == i])], plane[:3]) for i, plane in enumerate(found))


def _ring(points: Floats, normal: Floats) -> Floats:
    """Points of a convex polygon in their order around it, counter-clockwise about the normal."""
    from_middle = points - points.mean(axis=0)
    x = from_middle[np.linalg.norm(from_middle, axis=1).argmax()]
    angle = np.arctan2(from_middle @ np.cross(normal, x) / np.linalg.norm(x), from_middle @ x / np.linalg.norm(x))
    return points[np.argsort(angle)]
