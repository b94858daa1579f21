"""The one function of this stage."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import count
from math import ceil, degrees

import numpy as np

from drkid.class_triangle import LEFT_CORNERS, is_mirror_symmetric, laid_down, printed_lengths, symmetrised
from drkid.curved_patch import CurvedPatch
from drkid.errors import FitError
from drkid.kit import Connector, Decomposition, Dimensions, Handedness, MergedClass, Part, PartSet, Patches
from drkid.mesh import Floats, Ints, read_only
from drkid.parts.bevel import require_bends
from drkid.parts.bevel_variants import Moulds, moulds
from drkid.parts.coupon import coupon
from drkid.parts.curved_piece import SHARES, curved_solid, is_own_mirror_image, needed_lift_mm, outer_margin
from drkid.parts.dimensions import proposals
from drkid.parts.fit import FITS_MM, Margin, corner_room_mm, margins, smallest_scale
from drkid.parts.groove import groove_mm
from drkid.parts.groove_choices import groove_choices, recesses_of
from drkid.parts.hinge import hinge_half
from drkid.parts.key import box_key
from drkid.parts.make_merged import merged_parts
from drkid.parts.marks import marked
from drkid.parts.members import Members
from drkid.parts.merged_marks import merged_marked
from drkid.parts.notes import connector_notes, corner_notes, groove_notes, notes, room_notes
from drkid.parts.pocket import pocket, side_frames
from drkid.parts.prismoid import Prismoid
from drkid.parts.process_findings import bridge_findings, findings
from drkid.parts.snap import snap_half
from drkid.parts.thickening import thickened
from drkid.parts.truncation import Truncated, truncated
from drkid.progress import Progress, silent
from drkid.spec import FOLLOWING, KitSpec

FIRST_GUESS_THICKNESSES = 4.0  # mean edge of the pieces with which the search for a size begins
WHOLE_MM = 1e-6
MOST_OF_SIDE = 0.4  # of the shortest side: how wide a pocket may be that is proposed for its strength
ROUNDING_ROOM = 1.005  # lengths rounded up to tenths of a mm make triangles of a slightly other shape
SMALLER = 1 - 1e-4  # of a scale: what another connector must save to be taken


def make_parts(
    decomposition: Decomposition, spec: KitSpec, progress: Progress = silent, patches: Patches | None = None
) -> PartSet:
    """The printed shapes of a kit: pieces with bevels and pockets, connectors, and which face uses which.

    One piece a class where it is its own mirror image, a left and a right one where it is not and both are used;
    `spec.bevel_variants` of each. An equilateral piece is laid down in the way that narrows its bevels.
    The scale is the decomposition's own where given edge lengths fix it. Else it makes the longest side of the mesh's
    bounding box `spec.size_mm`, or is the smallest at which all pockets and walls fit, rounded up to whole mm of that
    side. The inner face of each is marked. With curved `patches` the decomposition is theirs, and the
    size that of flat pieces: patches are flattened where their outer faces find no room at it. With merged ones it is
    that of the triangles.

    Raises:
        FitError: pockets and walls do not fit at the asked size or thickness, a piece is larger than the bed, or a
            joint bends beyond `spec.bevel_degrees`.
    """
    progress("laying pieces on faces", 0.0)
    found = moulds(decomposition, spec, spec.bevel_variants)
    members = found.members
    bends = spec.bevel_degrees or (degrees(float(np.abs(members.bend_radians).max())),)
    sharpest = max(bends) + spec.swing_degrees
    progress("finding the size", 0.2)
    curved = tuple(patches.curved[k] for k in found.class_index) if patches and patches.curved else ()
    merged = patches if patches and patches.merged else None
    design = _chosen([_Design(found, d, spec, curved, curved) for d in proposals(spec, sharpest)])
    scale = _scale(design)
    require_bends(decomposition.mesh.scaled(scale), spec)
    design = design.flattened(scale)
    progress("cutting parts", 0.5)
    corners = _truncated(design, scale) if merged is None else Truncated(design.pieces(scale))
    shapes = corners.shapes
    recess = recesses_of(found, shapes, scale)
    width = groove_mm(decomposition.mesh, members, recess)
    choices = () if patches else groove_choices(decomposition, design.dimensions, spec, scale)
    parts, face_part = _parts(design, shapes, scale)
    part_set = PartSet(
        scale_mm_per_unit=scale,
        dimensions=design.dimensions,
        parts=parts,
        connectors=_connectors(design.dimensions),
        face_part=face_part,
        face_turn=members.turn,
        groove_mm=read_only(width),
        notes=(
            *notes(found, design.dimensions, spec, recess, scale),
            *groove_notes(width, choices, spec),
            *corner_notes(corners),
            *design.curved_notes(scale),
        ),
        findings=findings(
            design.triangles(scale), shapes, np.unique(members.face_class).tolist(), found, design.dimensions, spec
        ),
        groove_choices=choices,
        coupon=coupon(design.dimensions, spec),
        cut_corners=corners.corners,
        deepest_cut_mm=corners.deepest_mm,
        split_class=tuple(found.class_index.tolist()) if found.variant.any() else (),
        patch_share=design.patch_share,
    )
    if merged is not None:
        part_set = merged_parts(merged, part_set, spec, tuple(connector_notes(members, design.dimensions)))
    part_set = _marked(part_set, spec, () if merged is None else merged.merged)
    bridges = bridge_findings(part_set.parts, part_set.connectors, spec)
    part_set = replace(part_set, findings=(*part_set.findings, *bridges))
    for part in part_set.parts:
        _require_bed(part, spec)
    progress("cutting parts", 1.0)
    return part_set


@dataclass(frozen=True, eq=False)
class _Design:
    """All but the scale; `curved` are the `given` patches with `patch_share` of their height."""

    moulds: Moulds
    dimensions: Dimensions
    spec: KitSpec
    curved: tuple[CurvedPatch, ...] = ()
    given: tuple[CurvedPatch, ...] = ()
    patch_share: float = 1.0

    @property
    def decomposition(self) -> Decomposition:
        return self.moulds.decomposition

    @property
    def members(self) -> Members:
        return self.moulds.members

    @property
    def longest(self) -> float:
        """Longest side of the mesh's bounding box in its own unit."""
        return float(self.decomposition.mesh.extents.max())

    @property
    def asked_size_mm(self) -> float | None:
        """Longest side of the print as given, or as the given mean edge makes it."""
        edge = self.spec.mean_edge_mm
        return self.spec.size_mm if edge is None else edge / self.decomposition.mesh.mean_edge * self.longest

    def triangles(self, scale: float) -> Floats:
        return laid_down(printed_lengths(self.decomposition.class_lengths, scale))

    def pieces(self, scale: float) -> tuple[Prismoid, ...]:
        return thickened(self.decomposition.class_lengths, self.members, self.dimensions, self.spec, scale)

    def lift_mm(self, scale: float) -> float:
        """How much higher than half the thickness over their patches the outer faces of all curved pieces lie."""
        zipped = zip(self.triangles(scale), self.curved, strict=False)
        return max((needed_lift_mm(t, p.scaled(scale), self.dimensions) for t, p in zipped), default=0.0)

    def curved_margins(self, scale: float) -> list[Margin]:
        """Of every mould's outer face; none where pieces are flat."""
        lift, wall = self.lift_mm(scale), self.dimensions.min_wall_mm
        zipped = zip(self.triangles(scale), self.pieces(scale), self.curved, strict=True) if self.curved else ()
        return [outer_margin(t, piece, patch.scaled(scale), lift, wall) for t, piece, patch in zipped]

    def flattened(self, scale: float) -> "_Design":
        """With as much of the patches' height, the same share of all, as leaves every outer face its room."""
        tried = self
        for share in SHARES.tolist() if self.curved else ():
            tried = replace(self, curved=tuple(p.flattened(share) for p in self.given), patch_share=share)
            if all(margin.slack_mm >= FITS_MM for margin in tried.curved_margins(scale)):
                break
        return tried

    def curved_notes(self, scale: float) -> Iterator[str]:
        """What the outer faces of curved pieces are like that a user might not expect."""
        if not self.curved:
            return
        lift = self.lift_mm(scale)
        if lift:
            yield (
                f"Patches dip under their triangles: all outer faces lie {lift:.1f} mm higher over them than half the "
                "thickness, for the pockets' roofs."
            )
        if self.patch_share < 1:
            whole = replace(self, curved=self.given)
            index, margin = min(enumerate(whole.curved_margins(scale)), key=lambda pair: pair[1].slack_mm)
            yield (
                f"Patches have {100 * self.patch_share:.0f} % of their height: with all of it the {margin.what} of "
                f"class {self.moulds.name(index)} would be {margin.available_mm:.2f} mm, {margin.needed_mm:g} mm are "
                "needed behind the bevels of its sharpest joints; more --faces or a larger --size-mm leave more."
            )

    def tightest(self, scale: float) -> tuple[int, Margin]:
        """The mould with the least slack of those in use, and where."""
        used = np.unique(self.members.face_class)
        triangles, pieces = self.triangles(scale), self.pieces(scale)
        found = [(int(k), m) for k in used for m in margins(triangles[k], pieces[k], self.dimensions)]
        return min(found, key=lambda pair: pair[1].slack_mm)

    def slack_mm(self, scale: float) -> float:
        return self.tightest(scale)[1].slack_mm

    @cached_property
    def smallest_scale(self) -> float:
        """At which everything fits."""
        mean_length = float(self.decomposition.class_lengths.mean())
        guess = FIRST_GUESS_THICKNESSES * self.dimensions.thickness_mm / mean_length
        return smallest_scale(self.slack_mm, guess)

    def smallest_size_mm(self) -> int:
        """Whole mm of the longest side at which everything fits."""
        first = ceil(self.smallest_scale * self.longest - WHOLE_MM)
        return next(size for size in count(first) if self.slack_mm(size / self.longest) >= 0)


def _chosen(designs: list[_Design]) -> _Design:
    """Of designs that differ in their connector, the one that makes the smallest print.

    Where the size is given, of those that fit the one with the thinnest pieces and then the most knuckles, as long as
    the pockets leave most of the shortest side. Lengths that are given take the first: their pieces are to be the same
    for every shape.
    """
    first = designs[0]
    if len(designs) == 1 or first.decomposition.scale_mm_per_unit is not None:
        return first
    if first.asked_size_mm is not None:
        scale = first.asked_size_mm / first.longest
        shortest = float(first.decomposition.class_lengths.min()) * scale
        fitting = [d for d in designs if d.slack_mm(scale) >= FITS_MM]
        modest = [d for d in fitting if d.dimensions.pocket_width_mm <= MOST_OF_SIDE * shortest] or fitting[:1]
        return min(modest or [first], key=lambda d: (d.dimensions.thickness_mm, -d.dimensions.knuckles))
    best, least = first, first.smallest_scale
    for design in designs[1:]:
        if design.slack_mm(least * SMALLER) >= 0:
            best, least = design, design.smallest_scale
    return best


def _scale(design: _Design) -> float:
    fixed = design.decomposition.scale_mm_per_unit
    if fixed is not None:
        return _required_scale(design, fixed)
    size = design.asked_size_mm
    if size is None:
        return design.smallest_size_mm() / design.longest
    index, margin = design.tightest(size / design.longest)
    if margin.slack_mm < FITS_MM:
        name, lengths = design.moulds.name(index), design.decomposition.class_lengths[index] * size / design.longest
        sides = ", ".join(f"{x:.1f}" for x in lengths)
        raise FitError(
            f"the {margin.what} of class {name} (sides {sides} mm) does not fit at size_mm {size:.4g}",
            wanted=f"{margin.needed_mm:.2f} mm",
            found=f"{margin.available_mm:.2f} mm",
            remedy=f"a larger print (--size-mm {design.smallest_size_mm()} or more), fewer pieces (--faces), "
            "or a thinner rod (--rod-diameter-mm)",
        )
    return size / design.longest


def _required_scale(design: _Design, scale: float) -> float:
    """The scale that given edge lengths fix, if everything fits at it."""
    index, margin = design.tightest(scale)
    if margin.slack_mm >= FITS_MM:
        return scale
    sides = ", ".join(f"{x:g}" for x in np.round(design.decomposition.class_lengths[index] * scale, 6))
    factor = design.smallest_scale / scale
    lengths = np.unique(np.round(design.decomposition.class_lengths * scale, 6))
    longer = ",".join(f"{ceil(10 * ROUNDING_ROOM * factor * x) / 10:g}" for x in lengths)
    raise FitError(
        f"the {margin.what} of class {design.moulds.name(index)} does not fit at the given lengths (sides {sides} mm)",
        wanted=f"{margin.needed_mm:.2f} mm",
        found=f"{margin.available_mm:.2f} mm",
        remedy=f"lengths {factor:.2f} times as long (--palette {longer}), a thinner rod (--rod-diameter-mm), "
        "a finer --process, or --connector none",
    )


def _truncated(design: _Design, scale: float) -> Truncated:
    """The pieces, their corners cut as M_f's vertices ask; those with bevels for every shape are the same for all."""
    shapes, triangles, spec = design.pieces(scale), design.triangles(scale), design.spec
    if spec.thickening not in FOLLOWING or spec.bevel_degrees is not None:
        return Truncated(shapes)
    mesh = design.decomposition.mesh.scaled(scale)

    def room_mm(own: int, face: int, corner: int) -> float:
        both = (0, 1) if spec.thickening == "flippable" else (face,)
        return min(corner_room_mm(triangles[own], shapes[own], design.dimensions, one, corner) for one in both)

    return truncated(shapes, triangles, design.members, mesh, spec, room_mm)


def _parts(design: _Design, shapes: tuple[Prismoid, ...], scale: float) -> tuple[tuple[Part, ...], Ints]:
    """The parts in use, by class and bevel variant, right before left, and which one each face is made from."""
    members, parts = design.members, list[Part]()
    face_part = np.empty(len(members.face_class), np.int64)
    for index in range(len(shapes)):
        own = members.face_class == index
        hands = [left for left in (False, True) if (own & (members.left == left)).any()]
        right = _right_part(design, index, shapes[index], scale) if hands else None
        for left in hands:
            face_part[own & (members.left == left)] = len(parts)
            parts += [] if right is None else [_mirrored(right, design.dimensions) if left else right]
    return tuple(parts), read_only(face_part)


def _right_part(design: _Design, index: int, shape: Prismoid, scale: float) -> Part:
    triangle = design.triangles(scale)[index]
    frames = side_frames(triangle, design.dimensions.key_bend_degrees / 2)
    solid, symmetric = shape.solid, is_mirror_symmetric(design.decomposition.class_lengths[index])
    if design.curved:
        patch, levels = design.curved[index].scaled(scale), design.spec.subdivision_levels
        solid = curved_solid(triangle, patch, shape, design.lift_mm(scale), levels)
        lengths = printed_lengths(symmetrised(design.decomposition.class_lengths)[index], scale)
        symmetric = symmetric and is_own_mirror_image(lengths, patch)
    if design.dimensions.connector != "none":
        solid = solid.minus_all([pocket(design.dimensions).moved(frame) for frame in frames])
    hand: Handedness = "any" if symmetric else "right"
    return Part(index, hand, _flat(triangle), frames, solid, design.moulds.name(index))


def _mirrored(right: Part, dimensions: Dimensions) -> Part:
    """The left part of a class: the mirror image of the right one, first side along x again."""
    triangle = (right.corners[:, :2] * [-1, 1])[list(LEFT_CORNERS)]
    frames = side_frames(triangle, dimensions.key_bend_degrees / 2)
    return Part(right.class_index, "left", _flat(triangle), frames, right.solid.mirrored(), right.class_name)


def _marked(part_set: PartSet, spec: KitSpec, shapes: tuple[MergedClass, ...]) -> PartSet:
    """The parts with their marks, and what has no room for them; `shapes` are those of merged pieces."""
    depth, width, d = spec.engraving_depth_mm, spec.preset.engrave_width_mm, part_set.dimensions
    if not spec.marks or spec.mark_depth_mm == 0:
        return part_set
    if depth == 0:
        return replace(part_set, notes=(*part_set.notes, *_unmarked(spec)))
    if shapes:
        scale = part_set.scale_mm_per_unit
        found = [
            merged_marked(part, replace(shape, corners=part.corners, inner=shape.inner * scale), d, width, depth)
            for part, shape in zip(part_set.parts, shapes, strict=True)
        ]
    else:
        found = [marked(part, d, width, depth) for part in part_set.parts]
    return replace(
        part_set,
        parts=tuple(part for part, _ in found),
        notes=(*part_set.notes, *room_notes([(part, missing) for part, missing in found if missing])),
    )


def _unmarked(spec: KitSpec) -> Iterator[str]:
    """Why pieces that a process could mark bear no marks."""
    kind = "Merged" if spec.merge is not None else "Curved" if spec.patch == "curved" else ""
    if kind:
        yield f"{kind} pieces bear no marks, because the ribs between strokes are thinner than a wall: --mark-depth-mm."


def _flat(triangle: Floats) -> Floats:
    return read_only(np.column_stack([triangle, np.zeros(3)]))


def _connectors(dimensions: Dimensions) -> tuple[Connector, ...]:
    makers = {"hinge": hinge_half, "snap": snap_half, "box": box_key}
    maker = makers.get(dimensions.connector)
    return () if maker is None else (maker(dimensions),)


def _require_bed(part: Part, spec: KitSpec) -> None:
    size = np.sort(np.ptp(part.solid.bounds, axis=0))
    if (size > np.sort(spec.bed_mm)).any():
        raise FitError(
            f"a piece of class {part.name} is larger than the printer's bed",
            wanted=" × ".join(f"{x:g}" for x in spec.bed_mm) + " mm at most",
            found=" × ".join(f"{x:.1f}" for x in size) + " mm",
            remedy="a smaller print (--size-mm), more pieces (--faces), or a larger bed (--bed-mm)",
        )
