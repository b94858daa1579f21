"""Box key: a rigid, straight bar that sits in the pockets of both pieces of a joint."""

from drkid.kit import Connector, Dimensions
from drkid.parts.dimensions import half_width_mm, reach_mm
from drkid.solid import Solid


def box_key(dimensions: Dimensions) -> Connector:
    """The key of every joint, symmetric about y = 0.

    Pockets lean by half of the kit's sharpest bend, so that there both lie in one line, along the key's roof. At
    flatter and concave joints the key's ends hang below the roofs, which they may, because pockets are open to the
    inner face.
    """
    x, y = half_width_mm(dimensions), reach_mm(dimensions)
    z = dimensions.pocket_height_mm / 2 - dimensions.clearance_mm
    return Connector("connector_key", Solid.box((-x, -y, -z), (x, y, z)))
