"""What further moulds would make of the grooves."""

import numpy as np

from drkid.class_triangle import laid_down, printed_lengths
from drkid.kit import Decomposition, Dimensions, GrooveChoice
from drkid.mesh import Floats
from drkid.parts.bevel_variants import Moulds, moulds
from drkid.parts.groove import groove_mm, recesses
from drkid.parts.prismoid import Prismoid
from drkid.parts.thickening import thickened
from drkid.spec import FOLLOWING, KitSpec

MOST_LOOKED_AT = 4  # variants of a class; more only where they are asked for


def recesses_of(found: Moulds, shapes: tuple[Prismoid, ...], scale: float) -> Floats:
    """(F, 2, 3): how far each side of its mould's shape stands back from the plane half-way to its neighbour."""
    triangles = laid_down(printed_lengths(found.decomposition.class_lengths, scale))
    insets = np.stack([shape.insets(triangle) for shape, triangle in zip(shapes, triangles, strict=True)])
    return recesses(found.members, insets, scale, shapes[0].thickness_mm)


def groove_choices(
    decomposition: Decomposition, dimensions: Dimensions, spec: KitSpec, scale: float
) -> tuple[GrooveChoice, ...]:
    """Moulds and grooves for one bevel a class, two, and so on, all made for this shape alone; at the same scale.

    Nothing where the thickening does not follow the bends, and no line for variants that no class has.
    """
    own, found = spec.model_copy(update={"bevel_degrees": None}), list[GrooveChoice]()
    if spec.thickening not in FOLLOWING:
        return ()
    for count in range(1, max(MOST_LOOKED_AT, spec.bevel_variants) + 1):
        split = moulds(decomposition, own, count)
        if found and split.count == found[-1].moulds:
            break
        shapes = thickened(split.decomposition.class_lengths, split.members, dimensions, own, scale)
        width = groove_mm(decomposition.mesh, split.members, recesses_of(split, shapes, scale))
        found.append(GrooveChoice(count, split.count, float(width.mean()), float(width.max())))
    return tuple(found)
