"""The groove at a joint: what an exact fit costs."""

import numpy as np

from drkid.mesh import Floats, Ints, TriMesh
from drkid.parts.members import Members


def recesses(members: Members, insets_mm: Floats, scale: float, thickness_mm: float) -> Floats:
    """(F, 2, 3): how far each side stands back from the plane half-way to its neighbour, inner and outer face, in mm.

    Measured along the piece, where the mesh's edge lies farthest outside the part's side; the least is then
    smaller by far − near. `insets_mm` is (k, 2, 3).
    """
    half = np.tan(members.bend_radians / 2)[:, None, :] * thickness_mm / 2
    heights = np.array([-1.0, 1.0])[None, :, None]
    return insets_mm[members.face_class] - scale * members.near[:, None, :] + heights * half


def groove_mm(mesh: TriMesh, members: Members, recess_mm: Floats) -> Floats:
    """(E,): widest gap at each joint, inner or outer face.

    With d(z) = σ − z·tan φ on either side it is (σ_a + σ_b + t·|tan(δ/2) − ½(tan φ_a + tan φ_b)|)·cos(δ/2): the
    two recesses from the plane that halves the angle, added and measured across.
    """
    gap = _per_edge(mesh, members, recess_mm).max(axis=0)
    bend = np.zeros(len(mesh.edges))
    bend[_edges(mesh, members)] = members.bend_radians
    return np.maximum(gap * np.cos(bend / 2), 0.0)


def touching_mm(mesh: TriMesh, members: Members, recess_mm: Floats, scale: float) -> Floats:
    """(E,): how far the two pieces at each joint reach into one another where they do so most; 0 where they do not."""
    least = recess_mm - scale * (members.far - members.near)[:, None, :]
    return np.maximum(-_per_edge(mesh, members, least).min(axis=0), 0.0)


def _edges(mesh: TriMesh, members: Members) -> Ints:
    return np.take_along_axis(mesh.face_edges, members.face_side, 1)


def _per_edge(mesh: TriMesh, members: Members, recess_mm: Floats) -> Floats:
    total = np.zeros((2, len(mesh.edges)))
    for height in range(2):
        np.add.at(total[height], _edges(mesh, members), recess_mm[:, height])
    return total
