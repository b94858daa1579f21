"""Merged pieces: triangles joined into polygons, and the shapes that they make (the paper, "Merge Triangles")."""

from dataclasses import replace

import numpy as np

from drkid.kit import Decomposition, MergedClass, MergedPiece, Outcome, Patches
from drkid.mesh import Floats, TriMesh, read_only
from drkid.patches.agglomeration import agglomerated, renumbered
from drkid.patches.distance_geometry import place
from drkid.patches.identity import mirror_corners, misfits, symmetrised
from drkid.patches.matching import paired
from drkid.patches.outline import Outlined, outlined, sharpest_fold
from drkid.patches.vertex_star import starred
from drkid.spec import KitSpec

LIKELY = 0.25  # of the most shift: pieces that differ by no more are likely to be made alike
SAME_SIDE = 1e-6  # of a length: sides that differ by less do not decide which corner is first


def merged_patches(decomposition: Decomposition, spec: KitSpec, tolerance: float) -> Patches:
    """Faces merged as `spec.merge` asks, in as few shapes as are found within `tolerance` (the mesh's unit).

    For fewer shapes vertices leave M_f's surface by `spec.merge_shift_percent` of the mean edge at most, unless the
    lengths of the edges are given: then M_f stays. A shape is the mean of its pieces, or laid into its mean plane where
    all of its triangles bend by `spec.merge_flat_degrees` at most. One that is nearly its own mirror image is made so,
    where all its pieces stay within the tolerance.
    """
    mesh = decomposition.mesh
    given = decomposition.scale_mm_per_unit is not None
    shift = 0.0 if given else spec.merge_shift_percent / 100 * mesh.mean_edge
    near = max(tolerance, LIKELY * shift)
    groups = paired(mesh, near) if spec.merge == 2 else starred(mesh, int(spec.merge or 2), near)
    found = renumbered(agglomerated(mesh, [outlined(mesh, group) for group in groups], tolerance, shift))
    mesh = mesh.moved(found.vertices)
    limit = np.radians(spec.merge_flat_degrees)
    classes: list[MergedClass] = []
    placed: list[MergedPiece | None] = [None] * len(groups)
    misfit = np.zeros(len(groups))
    for index, mean in sorted(found.means.items()):
        members = np.flatnonzero(found.shape == index).tolist()
        model = found.pieces[members[0]]
        first = _first_corner(mean[: len(model.vertices)])
        alike = np.stack([found.pieces[p].turned(first).points(mesh) for p in members])
        even, image = _evened(_turned(mean, model, first), model.turned(first), alike, tolerance)
        shape = _shape(even, model.turned(first), limit, image)
        classes.append(shape)
        points = np.vstack([shape.corners, shape.inner])
        for p in members:
            own = found.pieces[p].turned(first)
            placed[p] = MergedPiece(own.faces, index, own.vertices, own.inner)
            misfit[p] = misfits(points, own.points(mesh))
    pieces = tuple(piece for piece in placed if piece is not None)
    divided = _divided(replace(decomposition, mesh=mesh), tuple(classes), pieces, spec)
    return Patches(
        divided,
        merged=tuple(classes),
        pieces=pieces,
        misfit=read_only(misfit),
        notes=_moved(decomposition.mesh, mesh),
        allowance=tolerance,
    )


def _moved(before: TriMesh, after: TriMesh) -> tuple[str, ...]:
    moved = 100 * float(place(before).moved(after.vertices).max()) / before.mean_edge
    if not moved:
        return ()
    return (f"Vertices left the surface by up to {moved:.1f} % of the mean edge so that more merged pieces are alike.",)


def _turned(points: Floats, piece: Outlined, by: int) -> Floats:
    """Corners and inner points with corner `by` first."""
    count = len(piece.vertices)
    return np.vstack([np.roll(points[:count], -by, axis=0), points[count:]])


def _first_corner(corners: Floats) -> int:
    """The corner from which the sides, read round, come in the lowest order: the shortest side first."""
    lengths = side_lengths(corners)
    rounded = np.rint(lengths / (SAME_SIDE * lengths.max())).astype(np.int64)
    return min(range(len(rounded)), key=lambda by: tuple(np.roll(rounded, -by)))


def side_lengths(corners: Floats) -> Floats:
    """(n,): lengths of the sides of a polygon (n, 3)."""
    return np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)


def _evened(points: Floats, piece: Outlined, alike: Floats, tolerance: float) -> tuple[Floats, tuple[int, ...]]:
    """A shape that is its own mirror image, with the image of each corner, or the shape as it is and nothing."""
    image = mirror_corners(points, piece, tolerance)
    if not image:
        return points, ()
    even = symmetrised(points, image)
    return (even, image) if misfits(even, alike).max() <= tolerance else (points, ())


def _shape(points: Floats, piece: Outlined, flat_radians: float, image: tuple[int, ...]) -> MergedClass:
    """A piece of these points in its part frame: origin amid its corners, z the mean normal, x along the first side.

    `image` are the corners' mirror images, where the shape is its own.
    """
    count = len(piece.vertices)
    corners, shell = points[:count], TriMesh(points, piece.triangles)
    z = shell.face_normals[0]
    if len(piece.faces) > 1:
        z = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
        z /= np.linalg.norm(z)
    x = corners[1] - corners[0]
    x = x - (x @ z) * z
    x /= np.linalg.norm(x)
    local = (points - corners.mean(axis=0)) @ np.stack([x, np.cross(z, x), z], axis=1)
    if sharpest_fold(points, piece.triangles) <= flat_radians:
        local[:, 2] = 0.0
    return MergedClass(
        read_only(local[:count].copy()),
        read_only(local[count:].copy()),
        piece.triangles,
        piece.side_face,
        image,
    )


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
