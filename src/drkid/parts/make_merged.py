"""Parts of merged pieces: at the size and with the dimensions at which the triangles themselves would fit."""

from dataclasses import replace
from itertools import combinations

import numpy as np

from drkid.kit import Dimensions, Handedness, MergedClass, MergedPiece, Part, PartSet, Patches
from drkid.measure import bend_radians
from drkid.mesh import Floats, TriMesh, read_only
from drkid.parts.bevel import bevel_insets, flippable_insets, limited, ridged
from drkid.parts.dimensions import deepest_bevel_mm, held_height_mm
from drkid.parts.foot import with_foot
from drkid.parts.merged_piece import (
    SKIRT_MM,
    bevel_planes,
    cutting_sides,
    demanded,
    far_inside,
    merged_solid,
    outline_bends,
    outline_frames,
    shared,
    slab_mesh,
)
from drkid.parts.merged_truncation import reflection, tips_cut
from drkid.parts.pocket import pocket
from drkid.parts.process_findings import wall_findings
from drkid.solid import Solid
from drkid.spec import KitSpec

REACH = 2.0  # least walls: how far around a pocket others, and what is lost, are looked for
FILM_MM = 0.02  # how much a piece is thinner where its losses are looked for, so that rounding is none


def merged_parts(patches: Patches, of_triangles: PartSet, spec: KitSpec, notes: tuple[str, ...] = ()) -> PartSet:
    """The part set of merged pieces, from that of the same triangles unmerged.

    Every triangle of a piece keeps its pockets on the outline. Triangles that were made alike may lack room for them:
    findings tell which shapes have walls that are too thin. What was found of single triangles' walls and bevels is
    left out; `notes` take the place of theirs.
    """
    scale, dimensions = of_triangles.scale_mm_per_unit, of_triangles.dimensions
    mesh_mm = patches.decomposition.mesh.scaled(scale)
    shapes = tuple(_scaled(shape, scale) for shape in patches.merged)
    insets = _merged_insets(mesh_mm, patches, scale, dimensions, spec)
    space = None if dimensions.connector == "none" else pocket(dimensions)
    thickness, wall = dimensions.thickness_mm, dimensions.min_wall_mm
    cutting = [cutting_sides(s, i, thickness, space, wall) for s, i in zip(shapes, insets, strict=True)]
    bodies = tips_cut(
        [merged_solid(s, i, thickness, c) for s, i, c in zip(shapes, insets, cutting, strict=True)],
        [shape.corners for shape in shapes],
        patches.pieces,
        mesh_mm,
        [shape.mirror for shape in shapes],
        dimensions.clearance_mm,
        [_pocket_room(s, dimensions) for s in shapes],
    )
    walls = [_pocket_wall_mm(s, i, b, dimensions) for s, i, b in zip(shapes, insets, bodies, strict=True)]
    parts = tuple(_part(k, shape, bodies[k], dimensions) for k, shape in enumerate(shapes))
    parts, feet = _printable(parts, shapes, bodies, dimensions, spec)
    face_part = np.zeros(len(mesh_mm.faces), np.int64)
    for piece in patches.pieces:
        face_part[list(piece.faces)] = piece.class_index
    return replace(
        of_triangles,
        parts=parts,
        face_part=read_only(face_part),
        face_turn=read_only(np.zeros(len(face_part), np.int64)),
        groove_mm=read_only(_grooves(mesh_mm, patches.pieces, insets, dimensions)),
        notes=(*notes, *feet),
        findings=(
            *wall_findings(parts, walls, wall),
            *(finding for finding in of_triangles.findings if not finding.subject.startswith("class ")),
        ),
        groove_choices=(),
        merged=patches.pieces,
    )


def _merged_insets(
    mesh_mm: TriMesh, patches: Patches, scale: float, dimensions: Dimensions, spec: KitSpec
) -> list[Floats]:
    """For each shape (m, n): how far its sides stand back from their hinge axes, from inner to outer face, in mm."""
    members: list[list[MergedPiece]] = [[] for _ in patches.merged]
    for piece in patches.pieces:
        members[piece.class_index].append(piece)
    zipped = zip(patches.merged, members, strict=True)
    return [_insets(mesh_mm, _scaled(shape, scale), own, dimensions, spec) for shape, own in zipped]


def _at_sides(shape: MergedClass, space: Solid, dimensions: Dimensions) -> list[Solid]:
    """A space in connector coordinates as it lies at every side of a shape."""
    return [space.moved(frame) for frame in outline_frames(shape, dimensions.key_bend_degrees / 2)]


def _pocket_room(shape: MergedClass, dimensions: Dimensions) -> Solid:
    """All pockets of a shape with a wall around them; nothing where there are none."""
    if dimensions.connector == "none":
        return Solid.union([])
    wall = dimensions.min_wall_mm
    wider = replace(
        dimensions,
        pocket_width_mm=dimensions.pocket_width_mm + 2 * wall,
        pocket_depth_mm=dimensions.pocket_depth_mm + wall,
        pocket_height_mm=dimensions.pocket_height_mm + 2 * wall,
    )
    return Solid.union(_at_sides(shape, pocket(wider), dimensions))


def _pocket_wall_mm(shape: MergedClass, insets: Floats, body: Solid, dimensions: Dimensions) -> float:
    """The thinnest wall between two pockets, or a pocket and what other sides or tips lost; `REACH` walls at most."""
    most = REACH * dimensions.min_wall_mm
    if dimensions.connector == "none":
        return most
    pockets = [body & space for space in _at_sides(shape, pocket(dimensions), dimensions)]
    gaps = [one.gap(other, most) for one, other in combinations(pockets, 2)]
    skirt = max(-float(insets.min()), 0.0) + SKIRT_MM
    slab = Solid.of(slab_mesh(shape, skirt, dimensions.thickness_mm - FILM_MM))
    normals, levels, sides = bevel_planes(shape, insets, dimensions.thickness_mm)
    for i, space in enumerate(pockets):
        behind = slab
        for k in np.flatnonzero(sides == i).tolist():
            behind = behind.beyond(normals[k], float(levels[k]) + FILM_MM)
        gaps.append(space.gap(behind - body, most))
    return min(most, *gaps)


def _scaled(shape: MergedClass, scale: float) -> MergedClass:
    return replace(shape, corners=read_only(shape.corners * scale), inner=read_only(shape.inner * scale))


def _insets(
    mesh_mm: TriMesh, shape: MergedClass, members: list[MergedPiece], dimensions: Dimensions, spec: KitSpec
) -> Floats:
    """(m, n): by the rule that is asked for; bent pieces have no one normal, so mean_normal is the mean bevel."""
    thickness, sides = dimensions.thickness_mm, len(shape.corners)
    if spec.thickening == "mean_normal":
        return np.mean([demanded(mesh_mm, shape, p, thickness, 0.0) for p in members], axis=0)
    if spec.thickening == "perpendicular":
        return np.zeros((2, sides))
    ridge = np.full(sides, dimensions.clearance_mm / 2)
    if spec.bevel_degrees is not None:
        insets = np.repeat(bevel_insets(spec.bevel_degrees, thickness, spec.swing_degrees), sides, axis=1)
    else:
        insets = shared([demanded(mesh_mm, shape, p, thickness, spec.swing_degrees) for p in members], shape)
        insets = insets + np.maximum(-insets.mean(axis=0, keepdims=True), 0.0)
        ridge = ridge + shared([far_inside(mesh_mm, shape, p) for p in members], shape)
    if spec.thickening == "flippable":
        insets = flippable_insets(insets)
    if dimensions.connector != "none":
        share = 2 * held_height_mm(dimensions) / thickness
        insets = limited(insets[None], ridge[None], deepest_bevel_mm(dimensions), share)[0]
    return ridged(insets, ridge)


def _part(index: int, shape: MergedClass, body: Solid, dimensions: Dimensions) -> Part:
    frames = outline_frames(shape, dimensions.key_bend_degrees / 2)
    if dimensions.connector != "none":
        body = body.minus_all(_at_sides(shape, pocket(dimensions), dimensions))
    return Part(index, _handedness(shape), shape.corners, frames, body.without_needles())


def _deep(body: Solid, shape: MergedClass, dimensions: Dimensions) -> Floats:
    """(n, 3): corners of the inner halves of a piece's pockets, that which a connector is held by."""
    if dimensions.connector == "none":
        return np.zeros((0, 3))
    half = pocket(dimensions).beyond(np.array([0.0, 1.0, 0.0]), dimensions.pocket_depth_mm / 2)
    return np.vstack([(body & space).mesh().vertices for space in _at_sides(shape, half, dimensions)])


def _printable(
    parts: tuple[Part, ...],
    shapes: tuple[MergedClass, ...],
    bodies: list[Solid],
    dimensions: Dimensions,
    spec: KitSpec,
) -> tuple[tuple[Part, ...], list[str]]:
    """The parts with feet where they need them to print without supports, and a note that tells which have one.

    `bodies` are the parts before their pockets were cut.
    """
    longest = spec.preset.longest_bridge_mm
    if longest is None:
        return parts, []
    thickness, wall = dimensions.thickness_mm, dimensions.min_wall_mm
    found = [
        with_foot(
            part.solid,
            _deep(body, shape, dimensions),
            thickness,
            wall,
            longest,
            reflection(shape.corners, shape.mirror) if shape.mirror else None,
        )
        for part, shape, body in zip(parts, shapes, bodies, strict=True)
    ]
    footed = [part.name for part, (_, depth) in zip(parts, found, strict=True) if depth]
    note = (
        f"Class {', '.join(footed)}: a flat of up to {max(depth for _, depth in found):.1f} mm is cut off the rim, on "
        "which the piece prints without supports."
    )
    parts = tuple(replace(part, solid=solid) for part, (solid, _) in zip(parts, found, strict=True))
    return parts, [note] if footed else []


def _handedness(shape: MergedClass) -> Handedness:
    """'any' of a shape that is its own mirror image, else 'right'; of triangles by the order of their sides."""
    if shape.achiral:
        return "any"
    lengths = np.linalg.norm(np.roll(shape.corners, -1, axis=0) - shape.corners, axis=1)
    return "left" if len(lengths) == 3 and lengths[1] > lengths[2] else "right"


def _grooves(mesh_mm: TriMesh, pieces: tuple[MergedPiece, ...], insets: list[Floats], dimensions: Dimensions) -> Floats:
    """(J,): widest gap at each joint, in the order of the mesh's edges; as `groove.groove_mm`."""
    half = dimensions.thickness_mm / 2
    total = np.zeros((2, len(mesh_mm.edges)))
    outer = np.zeros(len(mesh_mm.edges), np.bool_)
    for piece in pieces:
        bend, edges = outline_bends(mesh_mm, piece)
        recess = insets[piece.class_index][[0, -1]] + np.array([[-half], [half]]) * np.tan(bend / 2)
        for height in range(2):
            np.add.at(total[height], edges, recess[height])
        outer[edges] = True
    return np.maximum(total.max(axis=0) * np.cos(bend_radians(mesh_mm) / 2), 0.0)[outer]
