"""Binary STL."""

import numpy as np

from drkid.mesh import TriMesh

_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def rounded(mesh: TriMesh) -> TriMesh:
    """The mesh with coordinates as STL stores them, without the triangles that lose a corner by that."""
    vertices, index = np.unique(mesh.vertices.astype(np.float32) + np.float32(0), axis=0, return_inverse=True)
    faces = index.ravel()[mesh.faces]
    whole = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    return TriMesh(vertices.astype(np.float64), faces[whole])


def stl_bytes(mesh: TriMesh) -> bytes:
    """A mesh whose coordinates are already `rounded`, as binary STL."""
    records = np.zeros(len(mesh.faces), _RECORD)
    records["normal"], records["corners"] = mesh.face_normals, mesh.corners
    return b"drkid, millimetres".ljust(80) + np.uint32(len(records)).tobytes() + records.tobytes()
