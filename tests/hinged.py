"""Frameworks of hinged triangles: the faces of a mesh, or triangles of other lengths in their places."""

import numpy as np

from drkid.assembly.hinge_framework import HingeFramework, hinge_framework
from drkid.assembly.piece_graph import PieceGraph, piece_graph
from drkid.measure import bend_radians
from drkid.mesh import Floats, TriMesh


def graph_of(mesh: TriMesh) -> PieceGraph:
    return piece_graph(mesh.faces.tolist(), mesh.edges.tolist())


def laid(sides: Floats) -> Floats:
    """(3, 3): the corners of a triangle with these sides in the plane z = 0, about its centroid."""
    a, b, c = sides
    x = (a * a + c * c - b * b) / (2 * a)
    corners = np.array([[0, 0, 0], [a, 0, 0], [x, np.sqrt(c * c - x * x), 0]])
    return corners - corners.mean(axis=0)


def frames(corners: Floats) -> Floats:
    """(n, 4, 4): connector frames in the middles of a flat polygon's sides."""
    found = np.tile(np.eye(4), (len(corners), 1, 1))
    after = np.roll(corners, -1, axis=0)
    along = (after - corners) / np.linalg.norm(after - corners, axis=1, keepdims=True)
    found[:, :3, 0], found[:, :3, 1] = along, np.cross([0, 0, 1], along)
    found[:, :3, 3] = (corners + after) / 2
    return found


def triangles(mesh: TriMesh, change: Floats | float = 0.0) -> list[Floats]:
    """Each face laid down, its side lengths changed."""
    return [laid(sides) for sides in mesh.side_lengths + change]


def framework_of(mesh: TriMesh, change: Floats | float = 0.0) -> HingeFramework:
    corners = triangles(mesh, change)
    return hinge_framework(graph_of(mesh), corners, [frames(c) for c in corners], bend_radians(mesh))
