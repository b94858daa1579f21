"""The faces laid on the triangles of their classes, and the sides that meet at each joint."""

from dataclasses import dataclass

import numpy as np

from drkid.class_triangle import LEFT_CORNERS, LEFT_SIDES, laid_on, symmetrised
from drkid.kit import Decomposition
from drkid.measure import bend_radians
from drkid.mesh import Bools, Floats, Ints, TriMesh, read_only


@dataclass(frozen=True, eq=False)
class LaidFaces:
    """Faces in the order of their classes' corners and sides; a left-handed face is seen in a mirror.

    `vertices` (F, 3) are the mesh's at each class corner, `class_lengths` (k, 3) the classes' with equal ones exactly
    equal. Joint e lies between sides `joint_side[e]` (2,) of faces `joint_face[e]` (2,); `opposed` (E,) says that the
    two sides run against one another; `bend_radians` (E,) is positive where convex.
    """

    mesh: TriMesh
    face_class: Ints
    class_lengths: Floats
    left: Bools
    vertices: Ints
    joint_face: Ints
    joint_side: Ints
    opposed: Bools
    bend_radians: Floats


def laid_faces(decomposition: Decomposition) -> LaidFaces:
    """Every face as a member of its class, hand and turn chosen as for its piece."""
    mesh, face_class = decomposition.mesh, decomposition.face_class
    lengths = symmetrised(decomposition.class_lengths)
    left, turn = laid_on(mesh.side_lengths, lengths, face_class)
    side = (np.where(left[:, None], LEFT_SIDES, (0, 1, 2)) + turn[:, None]) % 3
    corner = (np.where(left[:, None], LEFT_CORNERS, (0, 1, 2)) + turn[:, None]) % 3
    vertices = np.take_along_axis(mesh.faces, corner, 1)
    edge = np.take_along_axis(mesh.face_edges, side, 1).ravel()
    slots = np.argsort(edge, kind="stable").reshape(-1, 2)
    first = vertices.ravel()[slots]
    return LaidFaces(
        mesh,
        face_class,
        read_only(lengths),
        left,
        read_only(vertices),
        read_only(slots // 3),
        read_only(slots % 3),
        read_only(first[:, 0] != first[:, 1]),
        bend_radians(mesh),
    )
