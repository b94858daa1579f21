"""Binary STL."""

import numpy as np

from drkid.mesh import TriMesh

_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def stl_bytes(mesh: TriMesh) -> bytes:
    """A mesh whose coordinates are already `rounded`, as binary STL."""
    records = np.zeros(len(mesh.faces), _RECORD)
    records["normal"], records["corners"] = mesh.face_normals, mesh.corners
    return b"drkid, millimetres".ljust(80) + np.uint32(len(records)).tobytes() + records.tobytes()
