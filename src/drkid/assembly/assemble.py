"""The one function of this stage."""

import numpy as np

from drkid.assembly.merged_order import merged_steps
from drkid.assembly.order import steps
from drkid.kit import Assembly, Joint, PartSet, Piece, piece_of_face
from drkid.measure import bend_radians
from drkid.mesh import TriMesh, read_only
from drkid.progress import Progress, silent
from drkid.rigid_fit import rigid_fit


def assemble(mesh_mm: TriMesh, part_set: PartSet, progress: Progress = silent) -> Assembly:
    """Every part at its face of the connected closed mesh M_f in mm, the joints between them, and a building order.

    A piece's transform is the rigid motion that carries its part's corners nearest to the face's: what remains is
    the difference between the face and its class. Joints are in the order of `mesh_mm.edges`; their angle is the
    inner dihedral, 180° less the bend.
    """
    progress("placing pieces", 0.0)
    if part_set.merged:
        return _merged(mesh_mm, part_set, progress)
    turned = (np.arange(3) + part_set.face_turn[:, None]) % 3
    vertices = np.take_along_axis(mesh_mm.faces, turned, 1)
    corners = np.stack([part.corners for part in part_set.parts])[part_set.face_part]
    transforms = read_only(rigid_fit(corners, mesh_mm.vertices[vertices]))
    pieces = tuple(
        Piece((face,), int(part_set.face_part[face]), (a, b, c), transforms[face])
        for face, (a, b, c) in enumerate(vertices.tolist())
    )
    bend = bend_radians(mesh_mm)
    joints = tuple(
        Joint((a, b), (v, w), float(180 - degrees))
        for (a, b), (v, w), degrees in zip(
            mesh_mm.edge_faces.tolist(), mesh_mm.edges.tolist(), np.degrees(bend), strict=True
        )
    )
    progress("ordering pieces", 0.5)
    order = steps(mesh_mm, bend)
    progress("ordering pieces", 1.0)
    return Assembly(pieces, joints, order)


def _merged(mesh_mm: TriMesh, part_set: PartSet, progress: Progress) -> Assembly:
    """As `assemble`, of pieces that cover several faces; the edges inside of a piece are no joints."""
    owner = piece_of_face(part_set.merged, len(mesh_mm.faces))
    pieces: list[Piece] = []
    for piece in part_set.merged:
        corners = part_set.parts[piece.class_index].corners
        transform = read_only(rigid_fit(corners, mesh_mm.vertices[list(piece.vertices)]))
        pieces.append(Piece(piece.faces, piece.class_index, piece.vertices, transform))
    bend = bend_radians(mesh_mm)
    outer = np.flatnonzero(np.diff(owner[mesh_mm.edge_faces], axis=1)[:, 0])
    pairs, edges = mesh_mm.edge_faces.tolist(), mesh_mm.edges.tolist()
    joints = tuple(
        Joint((pairs[e][0], pairs[e][1]), (edges[e][0], edges[e][1]), float(180 - np.degrees(bend[e])))
        for e in outer.tolist()
    )
    progress("ordering pieces", 0.5)
    order = merged_steps(tuple(pieces), joints)
    progress("ordering pieces", 1.0)
    return Assembly(tuple(pieces), joints, order)
