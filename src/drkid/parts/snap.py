"""Snap: a hinge half without metal, whose pin snaps into the clip of another one turned round."""

import numpy as np

from drkid.kit import Connector, Dimensions
from drkid.parts.dimensions import half_width_mm
from drkid.parts.hinge import half_body
from drkid.solid import Solid

MOUTH_HALF_DEGREES = 55.0  # the clip is open over twice this angle: its lips give by some 4 % of the pin's diameter


def snap_half(dimensions: Dimensions) -> Connector:
    """The half that either piece of a joint holds, in connector coordinates.

    Along the edge it has a clip and then a pin between two cheeks; turned round by half a turn about z its pin lies in
    the place of the clip, so that one mould serves both sides. The clip's mouth faces the other half: both are pushed
    together along y until they snap, outside the pieces, and then turn as a hinge does.
    """
    d = dimensions
    half, radius = half_width_mm(d), d.barrel_diameter_mm / 2
    cheek, gap = (radius - d.pin_diameter_mm / 2 - d.rod_clearance_mm), d.knuckle_gap_mm
    clip = (-half + cheek + gap, -half + cheek + gap + d.knuckle_length_mm)
    cheeks = ((gap / 2, gap / 2 + cheek), (half - cheek, half))
    free = ((-half - 1, clip[0]), (clip[1], cheeks[0][0]), (cheeks[0][1], cheeks[1][0]))
    body = half_body(d).minus_all(
        [Solid.box((low, -2 * radius, -2 * radius), (high, d.grip_start_mm, 2 * radius)) for low, high in free]
        + [Solid.cylinder_along_x(d.pin_diameter_mm / 2 + d.rod_clearance_mm, *clip), _mouth(radius, *clip)]
    )
    pin = Solid.cylinder_along_x(d.pin_diameter_mm / 2, (cheeks[0][0] + cheeks[0][1]) / 2, half - cheek / 2)
    return Connector("connector_snap", body + pin)


def _mouth(radius: float, low: float, high: float) -> Solid:
    """The wedge through which the pin enters, towards −y."""
    angle = np.radians(MOUTH_HALF_DEGREES)
    ends = 2 * radius * np.array([[-1.0, np.tan(angle)], [-1.0, -np.tan(angle)]])
    return Solid.prism_along_x(np.vstack([[[0.0, 0.0]], ends]), low, high)
