"""The triangle of a class: laid down in the part frame, and the motions that carry it onto itself."""

from itertools import permutations

import numpy as np

from drkid.mesh import Bools, Floats, Ints

SAME_LENGTH = 2e-5  # relative: sides that differ by less are equal; far below what any process can print
TIE = 1e-12  # of the squared length: ways to lay a part that differ by less fit equally well, the first is taken
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


def following(corners: Floats) -> Floats:
    """The next corner at each of corners (…, n, 2) around a polygon; `np.roll`, but much faster for so few."""
    return np.concatenate([corners[..., 1:, :], corners[..., :1, :]], axis=-2)


def inward_normals(corners: Floats) -> Floats:
    """Unit normals (…, 3, 2) of the sides of counter-clockwise triangles (…, 3, 2), pointing inwards."""
    along = following(corners) - corners
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


def symmetrised(class_lengths: Floats) -> Floats:
    """The lengths with equal ones made exactly equal, so that rounding decides nothing."""
    out = np.array(class_lengths)
    for row in out:
        group = equal_sides(row)
        row[:] = (np.bincount(group, weights=row) / np.bincount(group))[group]
    return out


def laid_on(side_lengths: Floats, lengths: Floats, face_class: Ints) -> tuple[Bools, Ints]:
    """Which hand (F,) and turn (F,) lay each face's sides (F, 3) best on those of its class.

    Right goes before left where both fit alike, as they do in a class with equal sides: such a piece is only turned.
    """
    wanted = lengths[face_class]
    mismatch = np.stack(
        [
            ((side_lengths[:, (np.array(sides) + turn) % 3] - wanted) ** 2).sum(axis=1)
            for sides in ((0, 1, 2), LEFT_SIDES)
            for turn in range(3)
        ],
        axis=1,
    )
    allowed = mismatch.min(axis=1) + TIE * (wanted**2).sum(axis=1)
    choice = np.argmax(mismatch <= allowed[:, None], axis=1)
    return choice >= 3, (choice % 3).astype(np.int64)
