"""Merged pieces: triangles joined into polygons, and the shapes that they make (the paper, "Merge Triangles")."""

from dataclasses import replace

import numpy as np

from drkid.kit import Decomposition, MergedClass, MergedPiece, Outcome, Patches
from drkid.measure import bend_radians
from drkid.mesh import Floats, TriMesh, read_only
from drkid.patches.identity import mirror_corners, misfits, residuals, shapes
from drkid.patches.matching import paired
from drkid.patches.outline import Outlined, outlined
from drkid.patches.vertex_star import starred
from drkid.spec import KitSpec

SAME_SIDE = 1e-6  # of a length: sides that differ by less do not decide which corner is first


def merged_patches(decomposition: Decomposition, spec: KitSpec, tolerance: float) -> Patches:
    """Faces merged as `spec.merge` asks, in as few shapes as are found within `tolerance` (the mesh's unit).

    A shape is that of the piece nearest to most others, its corners as they are, or laid into their mean plane where
    all of its triangles bend by `spec.merge_flat_degrees` at most.
    """
    mesh = decomposition.mesh
    groups = paired(mesh, tolerance) if spec.merge == 2 else starred(mesh, int(spec.merge or 2), tolerance)
    pieces = [outlined(mesh, group) for group in groups]
    residual, turn = residuals(mesh, pieces)
    stands = shapes(residual, tolerance)
    leaders, count = np.unique(stands, return_counts=True)
    leaders = leaders[np.argsort(-count, kind="stable")]
    limit = np.radians(spec.merge_flat_degrees)
    classes: list[MergedClass] = []
    placed: list[MergedPiece | None] = [None] * len(pieces)
    misfit = np.zeros(len(pieces))
    for index, leader in enumerate(leaders.tolist()):
        first = _first_corner(mesh, pieces[leader])
        model = pieces[leader].turned(first)
        shape = _shape(mesh, model, limit, tolerance)
        classes.append(shape)
        points = np.vstack([shape.corners, shape.inner])
        for p in np.flatnonzero(stands == leader).tolist():
            own = pieces[p].turned(int(turn[leader, p] + first) % len(model.vertices))
            placed[p] = MergedPiece(own.faces, index, own.vertices, own.inner)
            misfit[p] = misfits(points, own.points(mesh))
    found = tuple(piece for piece in placed if piece is not None)
    divided = _divided(decomposition, tuple(classes), found, spec)
    return Patches(divided, merged=tuple(classes), pieces=found, misfit=read_only(misfit), allowance=tolerance)


def _first_corner(mesh: TriMesh, piece: Outlined) -> int:
    """The corner from which the sides, read round, come in the lowest order: the shortest side first."""
    lengths = side_lengths(mesh.vertices[list(piece.vertices)])
    rounded = np.rint(lengths / (SAME_SIDE * lengths.max())).astype(np.int64)
    return min(range(len(rounded)), key=lambda by: tuple(np.roll(rounded, -by)))


def side_lengths(corners: Floats) -> Floats:
    """(n,): lengths of the sides of a polygon (n, 3)."""
    return np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)


def _shape(mesh: TriMesh, piece: Outlined, flat_radians: float, tolerance: float) -> MergedClass:
    """The piece in its part frame: origin amid its corners, z the mean normal, x along the first side."""
    points, count = piece.points(mesh), len(piece.vertices)
    corners = points[:count]
    z = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
    if len(piece.faces) == 1:
        z = mesh.face_normals[piece.faces[0]]
    z = z / np.linalg.norm(z)
    x = corners[1] - corners[0]
    x = x - (x @ z) * z
    x /= np.linalg.norm(x)
    local = (points - corners.mean(axis=0)) @ np.stack([x, np.cross(z, x), z], axis=1)
    if _sharpest(mesh, piece) <= flat_radians:
        local[:, 2] = 0.0
    return MergedClass(
        read_only(local[:count].copy()),
        read_only(local[count:].copy()),
        piece.triangles,
        piece.side_face,
        mirror_corners(local, piece, tolerance),
    )


def _sharpest(mesh: TriMesh, piece: Outlined) -> float:
    """The sharpest bend between two triangles of a piece, in radians."""
    inside = np.isin(mesh.edge_faces, piece.faces).all(axis=1)
    return float(np.abs(bend_radians(mesh)[inside]).max(initial=0.0))


def _divided(
    decomposition: Decomposition, classes: tuple[MergedClass, ...], pieces: tuple[MergedPiece, ...], spec: KitSpec
) -> Decomposition:
    """The decomposition by merged shapes: lengths of the outlines, rows filled up with NaN, errors of the pieces."""
    mesh = decomposition.mesh
    widest = max(len(c.corners) for c in classes)
    lengths = np.full((len(classes), widest), np.nan)
    for row, shape in zip(lengths, classes, strict=True):
        row[: len(shape.corners)] = np.sort(side_lengths(shape.corners))
    face_class = np.zeros(len(mesh.faces), np.int64)
    face_errors = np.zeros(len(mesh.faces))
    for piece in pieces:
        own = np.sort(side_lengths(mesh.vertices[list(piece.vertices)]))
        face_class[list(piece.faces)] = piece.class_index
        face_errors[list(piece.faces)] = np.linalg.norm(own - lengths[piece.class_index, : len(own)])
    percent = 100 * float(face_errors.max()) / mesh.mean_edge
    reached = percent <= spec.tolerance_for(len(mesh.faces))
    message = f"{len(pieces)} pieces in {len(classes)} shapes; sides differ by {percent:.2g} % of the mean edge at most"
    return replace(
        decomposition,
        face_class=read_only(face_class),
        class_lengths=read_only(lengths),
        face_errors=read_only(face_errors),
        outcome=Outcome("converged" if reached else "stalled", message),
    )
