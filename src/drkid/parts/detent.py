"""Detent: a bump on either end of a connector half that springs past the pocket's wall into a groove."""

from dataclasses import dataclass
from math import sqrt

import numpy as np

from drkid.kit import Dimensions
from drkid.parts.dimensions import half_width_mm, reach_mm
from drkid.solid import Solid

GRIP_SHARE = 0.6  # of the grip: how long the bump is
TIP_SHARE = 0.5  # half the width of the bump's tip, in its heights
ROOT_MM = 0.3  # how far a bump is sunk into what it stands on, so that both become one solid


@dataclass(frozen=True)
class Ridge:
    """A ridge with flanks of 45° on both ends of a half, or the groove that it sits in; lengths in mm.

    It stands `height` out of the wall, is `half_base` to either side of z = `z` at its foot, and runs from y = `start`
    to y = `end`.
    """

    height: float
    half_base: float
    z: float
    start: float
    end: float


def bump(d: Dimensions) -> Ridge | None:
    """The bump of a half; None where nothing but glue holds it.

    It lies where the half is lowest, so that it has only the wall below the pocket to pass, and ends before the
    half's back, where the pockets of neighbouring sides come nearest.
    """
    if d.detent_mm <= 0:
        return None
    reach, height = reach_mm(d), d.detent_mm
    half_base = (1 + TIP_SHARE) * height
    start = max(reach - GRIP_SHARE * (reach - d.barrel_diameter_mm / 2), d.grip_start_mm)
    return Ridge(height, half_base, half_base - d.barrel_diameter_mm / 2, start, max(reach - height, start + height))


def groove(d: Dimensions) -> Ridge | None:
    """The groove in a pocket's wall: the clearance lies between it and the bump at rest.

    It runs out through the side of the piece, or a thin tooth would stand between its end and the bevel.
    """
    b, c = bump(d), d.clearance_mm
    if b is None:
        return None
    return Ridge(b.height, b.half_base + (sqrt(2) - 1) * c, b.z, -d.thickness_mm - d.pocket_depth_mm, b.end + c)


def bumps(d: Dimensions) -> tuple[Solid, ...]:
    """Both bumps of a half, in connector coordinates."""
    ridge = bump(d)
    return () if ridge is None else _both(ridge, half_width_mm(d))


def grooves(d: Dimensions) -> tuple[Solid, ...]:
    """Both grooves of a pocket, in connector coordinates."""
    ridge = groove(d)
    return () if ridge is None else _both(ridge, d.pocket_width_mm / 2)


def _both(r: Ridge, wall: float) -> tuple[Solid, ...]:
    profile = [(wall - ROOT_MM, r.half_base), (wall, r.half_base), (wall + r.height, r.half_base - r.height)]
    points = np.array([(x, y, r.z + s * z) for x, z in profile for s in (-1, 1) for y in (r.start, r.end)])
    return Solid.hull(points), Solid.hull(points * [-1, 1, 1])
