"""Hinge: one half that mates with itself turned round, and a metal rod through both."""

import numpy as np

from drkid.kit import Connector, Dimensions
from drkid.mesh import Floats
from drkid.parts.detent import bumps
from drkid.parts.dimensions import half_width_mm, reach_mm
from drkid.solid import Solid, circle_outside


def hinge_half(dimensions: Dimensions) -> Connector:
    """The half that either piece of a joint holds, in connector coordinates (the paper, "Hinge joint connectors").

    Of an even number of knuckle places it fills every other one; turned round by half a turn about z its knuckles
    come to lie in the empty ones, so that one mould serves both sides. It turns freely up to the sharpest joint that
    the dimensions were proposed for, either way. Barrel and bore are polygons outside their circles: neither the wall
    nor the hole is ever less than stated.
    """
    half_width = half_width_mm(dimensions)
    body = half_body(dimensions)
    places = [_empty_place(dimensions, k) for k in range(1, dimensions.knuckles, 2)]
    bore = Solid.cylinder_along_x(
        dimensions.rod_diameter_mm / 2 + dimensions.rod_clearance_mm, -half_width - 1, half_width + 1
    )
    return Connector("connector_half", body.minus_all([*places, bore]))


def half_body(dimensions: Dimensions) -> Solid:
    """What a half is cut from: barrel and grip over the whole width, with the bumps that hold it."""
    half_width = half_width_mm(dimensions)
    body = Solid.prism_along_x(_profile(dimensions), -half_width, half_width)
    for one in bumps(dimensions):
        body += one
    return body


def _profile(dimensions: Dimensions) -> Floats:
    """(n, 2) points in (y, z) whose hull is the barrel and, as high, the grip behind it."""
    radius, reach = dimensions.barrel_diameter_mm / 2, reach_mm(dimensions)
    circle = circle_outside(radius)
    return np.vstack([circle[circle[:, 0] < 0], [[reach, -radius], [reach, radius]]])


def _empty_place(dimensions: Dimensions, place: int) -> Solid:
    """The space that the other half's knuckle turns in, with the gaps beside it."""
    d, radius = dimensions, dimensions.barrel_diameter_mm / 2
    low = -half_width_mm(d) + place * (d.knuckle_length_mm + d.knuckle_gap_mm) - d.knuckle_gap_mm
    high = low + d.knuckle_length_mm + 2 * d.knuckle_gap_mm
    return Solid.box((low, -2 * radius, -2 * radius), (high, d.grip_start_mm, 2 * radius))
