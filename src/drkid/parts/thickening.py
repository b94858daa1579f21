"""Thickening: from class triangles to bevelled pieces, by the rule that is asked for."""

import numpy as np

from drkid.class_triangle import laid_down, printed_lengths
from drkid.kit import Dimensions
from drkid.mesh import Floats
from drkid.parts.bevel import bevel_insets, bisector_insets, demanded, limited
from drkid.parts.dimensions import deepest_bevel_mm
from drkid.parts.mean_normal import leaning, mean_normal_slopes
from drkid.parts.members import Members
from drkid.parts.prismoid import Prismoid, bevelled
from drkid.spec import KitSpec


def thickened(
    class_lengths: Floats, members: Members, dimensions: Dimensions, spec: KitSpec, scale: float
) -> tuple[Prismoid, ...]:
    """The piece of every class, right-handed where it has two hands, at `scale` mm per unit of `class_lengths`.

    All rules keep the class triangle as the middle surface, so that hinge axes lie on the mesh's edges.
    """
    thickness, deepest = dimensions.thickness_mm, deepest_bevel_mm(dimensions)
    lengths_mm = printed_lengths(class_lengths, scale)
    if spec.thickening == "mean_normal":
        slopes = mean_normal_slopes(members, class_lengths)
        return tuple(leaning(*row, deepest, thickness) for row in zip(lengths_mm, slopes, strict=True))
    insets = np.zeros((len(class_lengths), 2, 3))
    if spec.bevel_degrees is not None:
        insets[:] = limited(bevel_insets(spec.bevel_degrees, thickness, spec.swing_degrees), deepest, thickness)
    elif spec.thickening == "bisector":
        demand = demanded(members, scale, thickness, spec.swing_degrees)
        insets = limited(bisector_insets(demand, members, class_lengths), deepest, thickness)
    return tuple(
        bevelled(laid_down(lengths), inset, thickness) for lengths, inset in zip(lengths_mm, insets, strict=True)
    )
