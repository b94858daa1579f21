"""What the process needs of every piece and connector, beside what they have: walls, draft, undercuts, overhangs."""

from collections.abc import Iterator, Sequence

import numpy as np

from drkid.kit import BRIDGE, WALL, Connector, Dimensions, Finding, Part
from drkid.mesh import Floats, rounded
from drkid.parts.bevel_variants import Moulds
from drkid.parts.fit import margins
from drkid.parts.pocket import deepest_height_mm, depth_mm
from drkid.parts.prismoid import Prismoid
from drkid.print_orientation import print_orientation, widest_bridge_mm
from drkid.solid import Solid
from drkid.spec import KitSpec
from drkid.wall_thickness import thinnest_wall_mm


def findings(
    triangles: Floats,
    pieces: tuple[Prismoid, ...],
    used: list[int],
    moulds: Moulds,
    dimensions: Dimensions,
    spec: KitSpec,
) -> tuple[Finding, ...]:
    """Every finding, mould by mould, then the connector's; triangles (m, 3, 2), `used` the moulds that have pieces.

    Pieces are printed on their outer face, pockets and marks upwards, so that nothing but the lean of a side hangs
    over; moulds open along the piece's normal.
    """
    found: list[Finding] = []
    for k in used:
        subject = f"class {moulds.name(k)}"
        found += _walls(subject, triangles[k], pieces[k], dimensions)
        found += _sides(subject, triangles[k], pieces[k], spec)
    return (*found, *_process(dimensions, spec))


def bridge_findings(parts: Sequence[Part], connectors: Sequence[Connector], spec: KitSpec) -> Iterator[Finding]:
    """The widest bridge of everything that is printed, turned as the build plates have it."""
    longest = spec.preset.longest_bridge_mm
    if longest is None:
        return
    found: dict[int, float] = {}  # what is as wide in a part's mirror image
    for part in parts:
        if part.class_index not in found:
            found[part.class_index] = _bridge_mm(part.solid, longest)
        yield _bridge(_subject(part), longest, found[part.class_index])
    for one in connectors:
        yield _bridge(one.name.replace("_", " "), longest, _bridge_mm(one.solid, longest))


def wall_findings(parts: Sequence[Part], pocket_walls_mm: Sequence[float], least_mm: float) -> Iterator[Finding]:
    """The thinnest wall of every merged piece, `pocket_walls_mm` being those around their pockets."""
    for part, pocket_wall in zip(parts, pocket_walls_mm, strict=True):
        wall = min(pocket_wall, thinnest_wall_mm(part.solid.mesh()))
        remedy = "make the print larger, or merge more gently: --merge-shift-percent 0, --merge 2"
        yield Finding(_subject(part), WALL, least_mm, wall, "mm", "at least", remedy)


def _subject(part: Part) -> str:
    return f"class {part.name}" if part.handedness == "any" else f"class {part.name} ({part.handedness})"


def _bridge_mm(solid: Solid, longest_mm: float) -> float:
    mesh = rounded(solid.mesh())
    turn = print_orientation(mesh, longest_mm)
    return widest_bridge_mm(mesh.moved(mesh.vertices @ turn.T))


def _bridge(subject: str, longest_mm: float, bridge_mm: float) -> Finding:
    return Finding(subject, BRIDGE, longest_mm, bridge_mm, "mm", "at most", "print it with supports")


def _walls(subject: str, triangle: Floats, piece: Prismoid, dimensions: Dimensions) -> Iterator[Finding]:
    """The tightest of each kind of length that must not fall short."""
    tightest: dict[str, Finding] = {}
    for m in margins(triangle, piece, dimensions):
        if m.what not in tightest or m.available_mm < tightest[m.what].available:
            tightest[m.what] = Finding(
                subject, m.what, m.needed_mm, m.available_mm, "mm", "at least", "make the print larger"
            )
    yield from tightest.values()


def _sides(subject: str, triangle: Floats, piece: Prismoid, spec: KitSpec) -> Iterator[Finding]:
    """Draft of the sides in a mould, and their lean outwards from the outer face on, on which a piece is printed."""
    lean = -np.degrees(np.arctan([opening for _, _, opening in piece.bevels(triangle)]))  # (n, 3)
    preset = spec.preset
    if preset.draft_degrees:
        draft = np.abs(lean).min(axis=0)
        side = int(draft.argmin())
        yield Finding(
            subject,
            f"draft of side {side + 1}",
            preset.draft_degrees,
            float(draft[side]),
            "degrees",
            "at least",
            "its walls are upright in the mould: draft them there, or take another --seed",
        )
    if preset.overhang_degrees < UPRIGHT_DEGREES:
        hanging = lean.max(axis=0)
        side = int(hanging.argmax())
        yield Finding(
            subject,
            f"overhang of side {side + 1}, outer face down",
            preset.overhang_degrees,
            max(float(hanging[side]), 0.0),
            "degrees",
            "at most",
            "print it with supports, or inner face down",
        )


def _process(d: Dimensions, spec: KitSpec) -> Iterator[Finding]:
    preset = spec.preset
    if preset.max_wall_mm is not None:
        yield Finding(
            "all pieces",
            "thickness",
            preset.max_wall_mm,
            d.thickness_mm,
            "mm",
            "at most",
            "core them out from the inner face",
        )
    if preset.max_undercut_mm is not None and d.detent_mm:
        remedy = "hold the hinges with --retention glue"
        for subject, what in (("all pieces", "undercut of the detent's grooves"), ("connector", "height of its bumps")):
            yield Finding(subject, what, preset.max_undercut_mm, d.detent_mm, "mm", "at most", remedy)
    yield from _moulded(d, spec)
    if d.rod_diameter_mm:
        bore = d.rod_diameter_mm + 2 * d.rod_clearance_mm
        yield Finding("connector", "bore", preset.min_hole_mm, bore, "mm", "at least", "a thicker --rod-diameter-mm")
    if d.connector in {"hinge", "snap"}:
        yield Finding("connector", "gap between knuckles", preset.knuckle_gap_mm, d.knuckle_gap_mm, "mm", "at least")
    if spec.marks and (depth := spec.engraving_depth_mm):
        yield Finding(
            "marks", "depth", d.thickness_mm - d.min_wall_mm, depth, "mm", "at most", "a lesser --mark-depth-mm"
        )


def _moulded(d: Dimensions, spec: KitSpec) -> Iterator[Finding]:
    """What has no draft or hides from a mould that opens along a piece's normal, and along a connector's."""
    preset = spec.preset
    if preset.max_undercut_mm is not None and d.key_bend_degrees:
        hidden = depth_mm(d, deepest_height_mm(d)) - depth_mm(d, -d.thickness_mm / 2)
        remedy = "slide the pockets' cores along their lean, or take --connector hinge"
        yield Finding(
            "all pieces",
            "undercut of leaning pockets",
            preset.max_undercut_mm,
            max(hidden, 0.0),
            "mm",
            "at most",
            remedy,
        )
    if not preset.draft_degrees:
        return
    upright: list[tuple[str, str, str]] = []
    if spec.marks and spec.engraving_depth_mm:
        upright.append(("marks", "draft of their walls", "engrave the mould with a conical cutter, or --no-marks"))
    if d.connector != "none":
        upright.append(("connector", "draft of its ends", "its ends are upright in the mould: draft them there"))
    for subject, what, remedy in upright:
        yield Finding(subject, what, preset.draft_degrees, 0.0, "degrees", "at least", remedy)


UPRIGHT_DEGREES = 90.0  # a process that prints any overhang
