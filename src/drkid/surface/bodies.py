"""The closed bodies of a mesh."""

import numpy as np

from drkid.mesh import Floats, TriMesh, summed


def signed_volumes(mesh: TriMesh) -> Floats:
    """(components,): signed volume of each edge-connected component, in the order of their numbers."""
    a, b, c = np.moveaxis(mesh.corners - mesh.vertices.mean(axis=0), 1, 0)
    volumes = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6
    return summed(mesh.face_component, volumes[:, None], mesh.component_count)[:, 0]


def outermost(mesh: TriMesh) -> tuple[TriMesh, int]:
    """The body of the largest volume, faces outwards, and the number of other bodies (inner shells among them)."""
    volumes = signed_volumes(mesh)
    body = int(np.abs(volumes).argmax())
    if len(volumes) > 1:
        mesh = mesh.submesh(mesh.face_component == body)
    return (mesh if volumes[body] > 0 else mesh.flipped()), len(volumes) - 1
