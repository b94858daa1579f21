"""Swing: how far a hinge turns before the pieces it joins touch."""

from collections.abc import Sequence

import numpy as np

from drkid.assembly.hinge_framework import HingeFramework
from drkid.kit import Swing
from drkid.mesh import Floats, Ints

ROUNDING_DEGREES = 1e-3  # corners in single precision, seen from an axis near by
NEAR_AXIS_MM = 1e-6  # nearer to the axis than this a corner has no direction


def sectors(points: Floats, frame: Floats) -> Floats:
    """(2,): how far a piece reaches round a hinge axis, in radians from its middle plane, outwards and inwards.

    `points` (n, 3) are the corners of the solid in its part frame, `frame` (4, 4) its connector frame there. A solid of
    flat faces reaches farthest at a corner.
    """
    local = (points - frame[:3, 3]) @ frame[:3, :3]
    along, across = local[:, 1], local[:, 2]
    far = np.hypot(along, across) > NEAR_AXIS_MM
    angle = np.arctan2(across[far], along[far])
    return np.array([max(angle.max(), 0.0), max(-angle.min(), 0.0)])


def swing(
    framework: HingeFramework, parts: Sequence[int], sides: Ints, reach: Sequence[Floats], wanted_degrees: float
) -> tuple[Swing, Floats]:
    """The least swing of all hinges, and each one's (J, 2) in degrees: inwards, to a more convex bend, and outwards.

    `reach[part]` (n, 2) are the `sectors` at each of a part's sides, `parts` (P,) each piece's part, `sides` (J, 2).
    Two pieces do not touch as long as their sectors on either side of the joint leave each other room: outside they
    have 180° + δ between them, inside 180° − δ. Pieces are taken to reach as far as that all along the side, so the
    true swing is never less.
    """
    joints = zip(framework.pieces.tolist(), sides.tolist(), strict=True)
    taken = np.array([sum(reach[parts[p]][i] for p, i in zip(*joint, strict=True)) for joint in joints])
    bend = framework.bend_radians
    free = np.degrees(np.stack([np.pi - bend - taken[:, 1], np.pi + bend - taken[:, 0]], axis=1))
    blocked = int((free < wanted_degrees - ROUNDING_DEGREES).any(axis=1).sum())
    return Swing(wanted_degrees, float(free[:, 0].min()), float(free[:, 1].min()), blocked), free
