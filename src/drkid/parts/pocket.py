"""Pocket: the same recess in every side of every piece."""

from math import cos, radians, sin, tan

import numpy as np

from drkid.class_triangle import inward_normals
from drkid.kit import Dimensions
from drkid.mesh import Floats, read_only
from drkid.parts.detent import grooves
from drkid.solid import Solid


def pocket(dimensions: Dimensions) -> Solid:
    """The space that a connector needs in a piece, in connector coordinates.

    W wide along the side, P deep into the piece, with its roof at H/2 above the hinge axis, which lies on the
    middle surface; its walls are drafted from the roof on, where the process asks for that. It is open to the inner
    face over its whole width: the finished hinge, rod included, is pressed in from inside, since no rod can be slid in
    along the edge of a shell that is nearly closed. Grooves take the bumps that hold it. It stands out over the side
    and the inner face by a thickness, so that the cut leaves no film.
    """
    d = dimensions
    corners = [
        (sign * (d.pocket_width_mm / 2 + flare), y, z)
        for z in (d.pocket_height_mm / 2, -1.5 * d.thickness_mm)
        for flare in (flare_mm(d, z),)
        for sign in (-1, 1)
        for y in (-d.thickness_mm - d.pocket_depth_mm, d.pocket_depth_mm + flare)
    ]
    space = Solid.hull(corners)
    for one in grooves(d):
        space += one
    return space


def flare_mm(dimensions: Dimensions, height_mm: float) -> float:
    """How far the draft sets a pocket's wall back at a height, from where it stands at the roof."""
    return (dimensions.pocket_height_mm / 2 - height_mm) * tan(radians(dimensions.draft_degrees))


def depth_mm(dimensions: Dimensions, height_mm: float) -> float:
    """How far a pocket reaches into a piece at a height; a key's leans inwards, and its roof is then its end."""
    d, lean = dimensions, radians(dimensions.key_bend_degrees / 2)
    floor = (d.pocket_depth_mm + height_mm * sin(lean)) / cos(lean) + flare_mm(d, height_mm)
    return min(floor, (d.pocket_height_mm / 2 - height_mm * cos(lean)) / sin(lean)) if lean else floor


def deepest_height_mm(dimensions: Dimensions) -> float:
    """The height at which a pocket reaches farthest into a piece: at the inner face, or where a key's roof ends."""
    d, lean = dimensions, radians(dimensions.key_bend_degrees / 2)
    end = d.pocket_height_mm / 2 * cos(lean) - d.pocket_depth_mm * sin(lean)
    return max(-d.thickness_mm / 2, end) if lean else -d.thickness_mm / 2


def side_frames(triangle: Floats, lean_degrees: float = 0.0) -> Floats:
    """(3, 4, 4): connector to part coordinates at each side of a triangle (3, 2) in the plane z = 0.

    Origin mid-side, x along the side, y into the piece, z outwards (the kit format), y leaning inwards.
    """
    normal, following = inward_normals(triangle), np.roll(triangle, -1, axis=0)
    frames = np.zeros((3, 4, 4))
    frames[:, :2, 0] = np.stack([normal[:, 1], -normal[:, 0]], axis=1)
    frames[:, :2, 1] = normal
    frames[:, :2, 3] = (triangle + following) / 2
    frames[:, 2, 2] = frames[:, 3, 3] = 1.0
    return read_only(frames @ leaning_turn(lean_degrees))


def leaning_turn(lean_degrees: float) -> Floats:
    """(4, 4): the turn about x that leans a frame's y inwards."""
    lean = radians(lean_degrees)
    turn = np.eye(4)
    turn[1:3, 1:3] = [[cos(lean), sin(lean)], [-sin(lean), cos(lean)]]
    return turn
