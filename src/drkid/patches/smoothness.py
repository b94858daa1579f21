"""How smooth an assembled curved surface is: the gap and the tangent break at its joints, and the surface itself."""

from dataclasses import dataclass

import numpy as np

from drkid.class_triangle import laid_down
from drkid.curved_patch import CurvedPatch, barycentric_grid, side_points
from drkid.mesh import Floats, TriMesh
from drkid.patches.laid_faces import LaidFaces
from drkid.rigid_fit import rigid_fit

SHARES = (np.arange(16) + 0.5) / 16  # of a joint's length, at which it is measured


@dataclass(frozen=True, eq=False)
class Joints:
    """`gap` (E,), the widest of each joint in the mesh's unit, and `break_degrees` (E, n) along each."""

    gap: Floats
    break_degrees: Floats


def placements(laid: LaidFaces) -> Floats:
    """(F, 4, 4): from the classes' part frames to the faces; those of left-handed faces mirror."""
    flat = np.zeros((len(laid.class_lengths), 3, 3))
    flat[:, :, :2] = laid_down(laid.class_lengths)
    mirror = np.where(laid.left[:, None], [-1.0, 1.0, 1.0], 1.0)
    motion = rigid_fit(flat[laid.face_class] * mirror[:, None], laid.mesh.vertices[laid.vertices])
    motion[:, :3, :3] *= mirror[:, None, :]
    return motion


def assembled(laid: LaidFaces, shapes: tuple[CurvedPatch, ...], levels: int) -> TriMesh:
    """All patches at their faces: a surface of 4^levels triangles a face, not joined at their sides."""
    grid = barycentric_grid(levels)
    motion = placements(laid)
    local = np.stack([shape.points(grid.points) for shape in shapes])[laid.face_class]
    points = np.einsum("fij,fnj->fni", motion[:, :3, :3], local) + motion[:, None, :3, 3]
    faces = np.where(laid.left[:, None, None], grid.faces[:, ::-1], grid.faces)
    faces = faces + len(grid.points) * np.arange(len(motion))[:, None, None]
    return TriMesh(points.reshape(-1, 3), faces.reshape(-1, 3))


def joints(laid: LaidFaces, shapes: tuple[CurvedPatch, ...]) -> Joints:
    """Gap between the boundary curves of the two patches at every joint, and the angle between their tangent planes."""
    motion = placements(laid)[laid.joint_face]
    own = laid.face_class[laid.joint_face], laid.joint_side
    at = [side_points(side, SHARES) for side in range(3)]
    points = np.stack([[shape.points(b) for b in at] for shape in shapes])[own]
    normals = np.stack([[shape.normals(b) for b in at] for shape in shapes])[own]
    points = np.einsum("ejab,ejnb->ejna", motion[..., :3, :3], points) + motion[:, :, None, :3, 3]
    normals = np.einsum("ejab,ejnb->ejna", motion[..., :3, :3], normals)
    opposed = laid.opposed[:, None, None]
    gap = np.linalg.norm(points[:, 0] - np.where(opposed, points[:, 1, ::-1], points[:, 1]), axis=2).max(axis=1)
    cosine = np.einsum("enk,enk->en", normals[:, 0], np.where(opposed, normals[:, 1, ::-1], normals[:, 1]))
    return Joints(gap, np.degrees(np.arccos(np.clip(cosine, -1, 1))))
