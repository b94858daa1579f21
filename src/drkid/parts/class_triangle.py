"""The triangle of a class: laid down in the part frame, and the motions that carry it onto itself."""

from itertools import permutations

import numpy as np

from drkid.mesh import Floats, Ints

SAME_LENGTH = 2e-5  # relative: sides that differ by less are equal; far below what any process can print
DECIMALS = 9  # of a printed length in mm
LEFT_SIDES = (0, 2, 1)  # which class side lies at side i of a left part: ascending clockwise from outside
LEFT_CORNERS = (1, 0, 2)  # which corner of the right part mirrors to corner i of the left part


def laid_down(lengths: Floats) -> Floats:
    """Corners (…, 3, 2) of triangles with sides of these `lengths` (…, 3) in order, counter-clockwise.

    The centroid is the origin and the first side runs along +x (the kit format's part frame).
    """
    first, second, third = np.moveaxis(lengths, -1, 0)
    x = (first**2 + third**2 - second**2) / (2 * first)
    y = np.sqrt(np.maximum(third**2 - x**2, 0.0))
    zero = np.zeros_like(first)
    corners = np.stack([np.stack([zero, zero], -1), np.stack([first, zero], -1), np.stack([x, y], -1)], -2)
    return corners - corners.mean(axis=-2, keepdims=True)


def printed_lengths(lengths: Floats, scale: float) -> Floats:
    """Lengths in mm, rounded far below what prints: the same lengths, found on two shapes, then make the same file."""
    return np.round(lengths * scale, DECIMALS)


def inward_normals(corners: Floats) -> Floats:
    """Unit normals (…, 3, 2) of the sides of counter-clockwise triangles (…, 3, 2), pointing inwards."""
    along = np.roll(corners, -1, axis=-2) - corners
    normals = np.stack([-along[..., 1], along[..., 0]], axis=-1)
    return normals / np.linalg.norm(normals, axis=-1, keepdims=True)


def equal_sides(lengths: Floats) -> Ints:
    """(3,): for each of three ascending side lengths, the number of its group of equal ones."""
    return np.concatenate([[0], np.cumsum(np.diff(lengths) > SAME_LENGTH * lengths[2])]).astype(np.int64)


def is_mirror_symmetric(lengths: Floats) -> bool:
    """Whether a class is isosceles or equilateral, and its piece therefore its own mirror image."""
    return int(equal_sides(lengths)[-1]) < 2


def is_equilateral(lengths: Floats) -> bool:
    """Whether all three sides of a class are equal, so that its piece can be laid down in three ways."""
    return int(equal_sides(lengths)[-1]) == 0


def symmetries(lengths: Floats) -> list[tuple[tuple[int, ...], Floats]]:
    """The motions, reflections included, that carry a class triangle onto itself.

    Each is a permutation and the 2×2 matrix that carries corner i to corner permutation[i].
    """
    group, corners = equal_sides(lengths), laid_down(lengths)
    side_between = {frozenset((i, (i + 1) % 3)): int(group[i]) for i in range(3)}
    found: list[tuple[tuple[int, ...], Floats]] = []
    for permutation in permutations(range(3)):
        if all(side_between[frozenset(permutation[i] for i in pair)] == g for pair, g in side_between.items()):
            matrix = np.linalg.solve(corners[:2], corners[list(permutation[:2])]).T
            found.append((permutation, matrix.astype(np.float64)))
    return found
