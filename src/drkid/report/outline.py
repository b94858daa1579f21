"""The body of a part as few flat polygons: what a line drawing needs of it."""

import numpy as np

from drkid.mesh import Floats, TriMesh
from drkid.solid import Solid

NEARLY_CONVEX = 1.7  # volume of the hull over the part's: more than its pockets take, less than a curved shell's
DECIMALS = 5  # of unit normals and of distances in mm, by which triangles share a plane


def outline(mesh: TriMesh) -> tuple[Floats, ...]:
    """The faces (n, 3) of a part's convex hull, whole, counter-clockwise from outside: its pockets are left out.

    A part that is far from convex, as a curved one is, keeps its own triangles.
    """
    hull = Solid.hull(mesh.vertices)
    if hull.volume > NEARLY_CONVEX * mesh.volume:
        return tuple(mesh.corners[mesh.areas > 0])
    return _flat_faces(hull.mesh())


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
