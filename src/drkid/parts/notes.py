"""What a user should know about the parts, in sentences."""

from collections.abc import Iterator

import numpy as np

from drkid.kit import Dimensions, GrooveChoice, Part
from drkid.mesh import Floats
from drkid.parts.bevel import SHARPEST_JOINT_DEGREES, demanded
from drkid.parts.bevel_variants import Moulds
from drkid.parts.groove import touching_mm
from drkid.parts.members import Members
from drkid.parts.truncation import Truncated
from drkid.spec import FOLLOWING, KitSpec

TOUCH_MM = 1e-3  # pieces that reach into one another by less are drawn apart by any process


def notes(moulds: Moulds, dimensions: Dimensions, spec: KitSpec, recess_mm: Floats, scale: float) -> tuple[str, ...]:
    """The sentences, most general first; `recess_mm` (F, 2, 3) as `groove.recesses` gives it."""
    members = moulds.members
    touching = touching_mm(moulds.decomposition.mesh, members, recess_mm, scale)
    return (
        *connector_notes(members, dimensions),
        *_touching_notes(touching, spec),
        *_short_notes(moulds, dimensions, spec, recess_mm, scale),
        *_limit_notes(members, spec),
    )


def connector_notes(members: Members, dimensions: Dimensions) -> Iterator[str]:
    """How the connector is put in; of merged pieces too."""
    if dimensions.connector == "none":
        return
    open_inwards = "Pockets are open to the inner face:"
    if dimensions.connector == "box":
        bend, limit = np.degrees(members.bend_radians), dimensions.key_bend_degrees
        beyond = int((bend > limit).sum()) // 2
        yield (
            f"{open_inwards} the key is pressed in from inside, and glued. One key serves all joints, which bend from "
            f"{bend.min():.1f}° to {bend.max():.1f}°: pockets lean for {limit:.1f}°, glue sets the angle; "
            f"{beyond} joints bend more than a key follows."
        )
        return
    hold = "its bumps spring into grooves" if dimensions.detent_mm else "glue holds it"
    yield (
        f"{open_inwards} the finished hinge is pressed in from inside, straight outwards, until {hold}. "
        "The last piece is pushed on from outside, over the halves that its neighbours hold."
    )


def _touching_notes(touching_mm: Floats, spec: KitSpec) -> Iterator[str]:
    count = int((touching_mm > TOUCH_MM).sum())
    if count:
        yield (
            f"Pieces reach into one another at {count} of {len(touching_mm)} joints, by up to "
            f"{touching_mm.max():.2f} mm (thickening: {spec.thickening})."
        )


def groove_notes(groove_mm: Floats, choices: tuple[GrooveChoice, ...], spec: KitSpec) -> tuple[str, ...]:
    """What a bevel for any shape costs, or what further moulds would buy; `groove_mm` (E,) is what the kit has."""
    if not choices:
        return ()
    if spec.bevel_degrees is not None:
        own = choices[0]
        return (
            f"One bevel for every shape: grooves are {groove_mm.mean():.1f} mm wide in the mean and "
            f"{groove_mm.max():.1f} mm at most; bevels for this shape alone would make them {own.mean_mm:.1f} and "
            f"{own.max_mm:.1f} mm.",
        )
    steps = ", ".join(
        f"{c.mean_mm:.1f} and {c.max_mm:.1f} mm with {c.moulds} (--bevel-variants {c.bevel_variants})"
        for c in choices
        if c.bevel_variants > spec.bevel_variants
    )
    if not steps:
        return ()
    own = choices[spec.bevel_variants - 1]
    return (
        f"Grooves are {own.mean_mm:.1f} mm wide in the mean and {own.max_mm:.1f} mm at most with {own.moulds} "
        f"{'mould' if own.moulds == 1 else 'moulds'}; {steps}.",
    )


def corner_notes(corners: Truncated) -> Iterator[str]:
    """Which corners were cut, and where that was not enough."""
    if corners.corners:
        yield (
            f"{corners.corners} corners of the pieces are cut off, by up to {corners.deepest_mm:.1f} mm: around a "
            "vertex pieces that are no neighbours would meet there."
        )
    if corners.vertices:
        named = ", ".join(map(str, corners.vertices[:3])) + (", …" if len(corners.vertices) > 3 else "")
        yield (
            f"Around {len(corners.vertices)} vertices ({named}) pieces that are no neighbours come nearer than hinges "
            "swing, or meet: no more of their corners can be cut off. More --faces or another --seed helps."
        )


def room_notes(missing: list[tuple[Part, tuple[str, ...]]]) -> Iterator[str]:
    """Which marks found no room on which parts."""
    for part, words in missing:
        hand = "" if part.handedness == "any" else f" ({part.handedness})"
        yield f"Class {part.name}{hand}: no room for the {', '.join(words)} inside."


def _short_notes(
    moulds: Moulds, dimensions: Dimensions, spec: KitSpec, recess_mm: Floats, scale: float
) -> Iterator[str]:
    """Sides whose bevel was cut down to keep the connector's hold, mould by mould."""
    if spec.thickening not in FOLLOWING or spec.bevel_degrees is not None:
        return
    members = moulds.members
    rest = demanded(members, scale, dimensions.thickness_mm, 0.0)
    swung = demanded(members, scale, dimensions.thickness_mm, spec.swing_degrees)
    slack = scale * (members.far - members.near)[:, None, :]
    missing = (swung - rest - (recess_mm - slack)).max(axis=1)
    for index in np.unique(members.face_class):
        own = missing[members.face_class == index]
        for side in np.flatnonzero((own > TOUCH_MM).any(axis=0)):
            yield (
                f"Class {moulds.name(index)}, side {side + 1}: its bevel stops short of what every joint asks, or the "
                f"connector would have no hold; {int((own[:, side] > TOUCH_MM).sum())} sides lack up to "
                f"{own[:, side].max():.2f} mm and touch or cannot swing by {spec.swing_degrees:g}°."
            )


def _limit_notes(members: Members, spec: KitSpec) -> Iterator[str]:
    sharp = np.degrees(np.abs(members.bend_radians)) + spec.swing_degrees > SHARPEST_JOINT_DEGREES
    if sharp.any():
        yield (
            f"{int(sharp.sum()) // 2} joints bend by more than {SHARPEST_JOINT_DEGREES - spec.swing_degrees:g}°: "
            "what they join touches."
        )
