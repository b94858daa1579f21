"""Box key: a straight bar that sits in the pockets of both pieces of a joint."""

from math import atan2, degrees

from drkid.kit import Connector, Dimensions
from drkid.parts.dimensions import half_width_mm, reach_mm
from drkid.solid import Solid


def box_key(dimensions: Dimensions) -> Connector:
    """The key of a joint, symmetric about y = 0: one for both pieces, straight whatever the joint's angle."""
    x, y = half_width_mm(dimensions), reach_mm(dimensions)
    z = dimensions.pocket_height_mm / 2 - dimensions.clearance_mm
    return Connector("connector_key", Solid.box((-x, -y, -z), (x, y, z)))


def largest_bend_degrees(dimensions: Dimensions) -> float:
    """The convex bend up to which a straight key finds room: its ends then touch the roofs of both pockets.

    A concave joint leaves the key free, because the pockets are open to the inner face.
    """
    return 2 * degrees(atan2(dimensions.clearance_mm, reach_mm(dimensions)))
