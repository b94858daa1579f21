"""Mean-normal thickening: the paper's rule, for comparison."""

import numpy as np

from drkid.class_triangle import laid_down, symmetries
from drkid.mesh import Floats, read_only
from drkid.parts.members import Members
from drkid.parts.prismoid import Prismoid

FLATTEST = 0.2  # least z of a mean normal: beyond, the corner would run along the piece instead of through it


def mean_normal_slopes(members: Members, class_lengths: Floats) -> Floats:
    """(k, 3, 2): how far each corner of a class's piece moves sideways per unit of height.

    The direction is the mean of the vertices' normals over the members, in the part frame (the paper, section
    "Surface thickening"), averaged over the symmetries of the class triangle, so that an isosceles or equilateral
    class keeps one mould.
    """
    total = np.zeros((len(class_lengths), 3, 3))
    np.add.at(total, members.face_class, members.normals)
    total[total[..., 2] <= 0] = [0.0, 0.0, 1.0]
    total /= np.linalg.norm(total, axis=-1, keepdims=True)
    slopes = total[..., :2] / np.maximum(total[..., 2:], FLATTEST)
    for row, lengths in zip(slopes, class_lengths, strict=True):
        row[:] = np.mean([row[list(image)] @ matrix for image, matrix in symmetries(lengths)], axis=0)
    return slopes


def leaning(lengths_mm: Floats, slopes: Floats, deepest_mm: float, thickness_mm: float) -> Prismoid:
    """The prismoid through the class triangle's corners along `slopes` (3, 2), the triangle half-way.

    The corners end on two parallel planes `thickness_mm` apart, so that the piece has that thickness everywhere.
    Slopes are cut down together where a side would stand back by more than `deepest_mm`.
    """
    triangle = laid_down(lengths_mm)
    shift = slopes * thickness_mm / 2
    whole = Prismoid(np.stack([triangle - shift, triangle + shift]), thickness_mm)
    share = min(1.0, deepest_mm / max(float(whole.insets(triangle).max()), 1e-12))
    return Prismoid(read_only(np.stack([triangle - share * shift, triangle + share * shift])), thickness_mm)
