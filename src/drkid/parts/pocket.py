"""Pocket: the same recess in every side of every piece."""

import numpy as np

from drkid.class_triangle import inward_normals
from drkid.kit import Dimensions
from drkid.mesh import Floats, read_only
from drkid.solid import Solid


def pocket(dimensions: Dimensions) -> Solid:
    """The space that a connector needs in a piece, in connector coordinates.

    W wide along the side, P deep into the piece, with its roof at H/2 above the hinge axis, which lies on the
    middle surface. It is open to the inner face over its whole width: the finished hinge, rod included, is pressed
    in from inside, since no rod can be slid in along the edge of a shell that is nearly closed. It stands out over
    the side and the inner face by a thickness, so that the cut leaves no film.
    """
    d = dimensions
    return Solid.box(
        (-d.pocket_width_mm / 2, -d.thickness_mm - d.pocket_depth_mm, -1.5 * d.thickness_mm),
        (d.pocket_width_mm / 2, d.pocket_depth_mm, d.pocket_height_mm / 2),
    )


def side_frames(triangle: Floats) -> Floats:
    """(3, 4, 4): connector to part coordinates at each side of a triangle (3, 2) in the plane z = 0.

    Origin mid-side, x along the side, y into the piece, z outwards (the kit format).
    """
    normal, following = inward_normals(triangle), np.roll(triangle, -1, axis=0)
    frames = np.zeros((3, 4, 4))
    frames[:, :2, 0] = np.stack([normal[:, 1], -normal[:, 0]], axis=1)
    frames[:, :2, 1] = normal
    frames[:, :2, 3] = (triangle + following) / 2
    frames[:, 2, 2] = frames[:, 3, 3] = 1.0
    return read_only(frames)
