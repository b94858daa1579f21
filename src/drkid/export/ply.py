"""Binary PLY with double coordinates and, where wanted, an int property per face."""

import numpy as np

from drkid.mesh import Ints, TriMesh


def ply_bytes(mesh: TriMesh, **face_properties: Ints) -> bytes:
    """The mesh as little-endian binary PLY; each keyword is an int property (F,) of the faces."""
    header = [
        "ply",
        "format binary_little_endian 1.0",
        "comment drkid, millimetres",
        f"element vertex {len(mesh.vertices)}",
        *(f"property double {axis}" for axis in "xyz"),
        f"element face {len(mesh.faces)}",
        "property list uchar int vertex_indices",
        *(f"property int {name}" for name in face_properties),
        "end_header",
    ]
    fields = [("count", "u1"), ("corners", "<i4", 3), *((name, "<i4") for name in face_properties)]
    faces = np.zeros(len(mesh.faces), np.dtype(fields))
    faces["count"], faces["corners"] = 3, mesh.faces
    for name, values in face_properties.items():
        faces[name] = values
    return ("\n".join(header) + "\n").encode("ascii") + mesh.vertices.astype("<f8").tobytes() + faces.tobytes()
