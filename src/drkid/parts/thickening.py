"""Thickening: from class triangles to bevelled pieces, by the rule that is asked for."""

import numpy as np

from drkid.class_triangle import laid_down, printed_lengths
from drkid.kit import Dimensions
from drkid.mesh import Floats
from drkid.parts.bevel import bevel_insets, bisector_insets, demanded, flippable_insets, limited, ridged, ridges
from drkid.parts.dimensions import deepest_bevel_mm, held_height_mm
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
    thickness = dimensions.thickness_mm
    lengths_mm = printed_lengths(class_lengths, scale)
    if spec.thickening == "mean_normal":
        slopes = mean_normal_slopes(members, class_lengths)
        deepest = deepest_bevel_mm(dimensions)
        return tuple(leaning(*row, deepest, thickness) for row in zip(lengths_mm, slopes, strict=True))
    insets = np.zeros((len(class_lengths), 2, 3))
    if spec.thickening != "perpendicular":
        insets = _bevels(class_lengths, members, dimensions, spec, scale)
    return tuple(
        bevelled(laid_down(lengths), inset, thickness) for lengths, inset in zip(lengths_mm, insets, strict=True)
    )


def _bevels(class_lengths: Floats, members: Members, dimensions: Dimensions, spec: KitSpec, scale: float) -> Floats:
    """(k, 3, 3): insets at three heights that serve every member, or the bends of `spec.bevel_degrees`."""
    thickness, half_clearance = dimensions.thickness_mm, dimensions.clearance_mm / 2
    if spec.bevel_degrees is not None:
        one = bevel_insets(spec.bevel_degrees, thickness, spec.swing_degrees)
        insets, ridge = np.tile(one, (len(class_lengths), 1, 3)), np.full((len(class_lengths), 3), half_clearance)
    else:
        demand = demanded(members, scale, thickness, spec.swing_degrees)
        insets = bisector_insets(demand, members, class_lengths)
        ridge = ridges(members, class_lengths, scale, dimensions.clearance_mm)
    if spec.thickening == "flippable":
        insets = flippable_insets(insets)
    if dimensions.connector != "none":
        insets = limited(insets, ridge, deepest_bevel_mm(dimensions), 2 * held_height_mm(dimensions) / thickness)
    return ridged(insets, ridge)
