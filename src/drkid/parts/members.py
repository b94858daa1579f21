"""The members of a class: which part each face is made from, which way round, and what its sides then meet."""

from dataclasses import dataclass

import numpy as np

from drkid.class_triangle import LEFT_CORNERS, LEFT_SIDES, inward_normals, laid_down, laid_on, symmetrised
from drkid.kit import Decomposition
from drkid.measure import bend_radians
from drkid.mesh import Bools, Floats, Ints, TriMesh, read_only


@dataclass(frozen=True, eq=False)
class Members:
    """The faces as members of their classes; lengths in the mesh's unit.

    Arrays run over the faces and over the class's sides or corners in ascending order of the sides; a left-handed
    face is seen in a mirror, so that all members of a class compare. `face_side` (F, 3) is the face's own side at
    each class side and `bend_radians` (F, 3) the bend of the surface there. `near` and `far` (F, 3) say how far
    the mesh's edge lies inside the class triangle's side, at its nearer and its farther end; both are 0 where the
    face is congruent to its class. `normals` (F, 3, 3) are the vertex normals in the part frame.
    """

    face_class: Ints
    left: Bools
    turn: Ints
    face_side: Ints
    bend_radians: Floats
    near: Floats
    far: Floats
    normals: Floats


def members_of(decomposition: Decomposition, turned: Ints | int = 0) -> Members:
    """How every face uses its class: handedness by the cyclic order of its sides, turn by least mismatch.

    An equilateral piece fits its face in three ways; `turned` (F,) says by how many sides more to turn each.
    """
    mesh, face_class = decomposition.mesh, decomposition.face_class
    lengths = symmetrised(decomposition.class_lengths)
    left, turn = laid_on(mesh.side_lengths, lengths, face_class)
    turn = (turn + turned) % 3
    face_side = (np.where(left[:, None], LEFT_SIDES, (0, 1, 2)) + turn[:, None]) % 3
    face_corner = (np.where(left[:, None], LEFT_CORNERS, (0, 1, 2)) + turn[:, None]) % 3
    corners, rotation = _fitted(np.take_along_axis(mesh.side_lengths, face_side, 1), lengths[face_class])
    offsets = _offsets(corners, laid_down(lengths[face_class]))
    return Members(
        face_class,
        read_only(left),
        read_only(turn),
        read_only(face_side),
        read_only(np.take_along_axis(bend_radians(mesh)[mesh.face_edges], face_side, 1)),
        read_only(offsets.min(axis=2)),
        read_only(offsets.max(axis=2)),
        read_only(_local_normals(mesh, face_corner, rotation)),
    )


def _fitted(face_lengths: Floats, class_lengths: Floats) -> tuple[Floats, Floats]:
    """The faces' triangles (F, 3, 2) laid on their class triangles, and the angles (F,) that this turned them by.

    Kabsch's least-squares fit in the plane, as the phase of a complex sum.
    """
    faces, classes = (laid_down(x) @ np.array([1, 1j]) for x in (face_lengths, class_lengths))
    angle = -np.angle((np.conj(classes) * faces).sum(axis=1))
    turned = faces * np.exp(1j * angle)[:, None]
    return np.stack([turned.real, turned.imag], axis=-1), angle


def _offsets(corners: Floats, reference: Floats) -> Floats:
    """(F, 3, 2): how far inside the reference's side either end of the corresponding side lies."""
    inward = inward_normals(reference)
    ends = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2) - reference[:, :, None, :]
    return np.einsum("fsek,fsk->fse", ends, inward)


def _local_normals(mesh: TriMesh, face_corner: Ints, rotation: Floats) -> Floats:
    """(F, 3, 3): vertex normals at the class's corners in the frame of the fitted part."""
    vertices = np.take_along_axis(mesh.faces, face_corner, 1)
    a, b, c = np.moveaxis(mesh.vertices[vertices], 1, 0)
    x = (b - a) / np.linalg.norm(b - a, axis=1, keepdims=True)
    y = (c - a) - np.einsum("ij,ij->i", c - a, x)[:, None] * x
    y /= np.linalg.norm(y, axis=1, keepdims=True)
    normals = mesh.vertex_normals[vertices]
    flat = np.einsum("fck,fk->fc", normals, x) + 1j * np.einsum("fck,fk->fc", normals, y)
    flat *= np.exp(1j * rotation)[:, None]
    return np.stack([flat.real, flat.imag, np.einsum("fck,fk->fc", normals, mesh.face_normals)], axis=-1)
