"""Canonical patch: one curved shape for all members of a class, with boundaries that any neighbour of it shares.

Over its triangle a patch is P(b) = Σ bᵢvᵢ + Σᵢ 4sᵢ bᵢbᵢ₊₁ (cos φᵢ z − sin φᵢ yᵢ) + b₀b₁b₂ q(b) z: barycentric b, unit
normal z, unit inward normal yᵢ of side i. The second term alone remains on the sides: there the patch is a planar
parabola of sagitta sᵢ, leaning outwards by φᵢ. A length has one such curve or a few, and the two sides at a joint have
the same, so that pieces meet along it, exactly where the joint bends by 2φ. The polynomial q is what is left to choose:
the bubble of a Bernstein-Bézier triangle (Farin, "Curves and surfaces for CAGD", chapter 17).
"""

from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np

from drkid.class_triangle import SAME_LENGTH, inward_normals, laid_down, symmetries
from drkid.curved_patch import CurvedPatch
from drkid.mesh import Floats, Ints, read_only

ARCS = np.array([[1, 1, 0], [0, 1, 1], [1, 0, 1]])
"""Exponents in (b₀, b₁, b₂) of the term of each side."""

DEGREE = 5  # of q: a quadratic cannot follow both the surface and the bends at the sides

BUBBLES = np.array([np.bincount(term, minlength=3) + 1 for term in combinations_with_replacement(range(3), DEGREE)])
"""(21, 3): exponents of the terms that vanish on all sides."""


@dataclass(frozen=True, eq=False)
class CanonicalPatch:
    """A class's curved middle surface over its triangle of side `lengths` (3,), in their unit.

    `sagittas` (3,) and `leans` (3,), in radians, of the sides; `bubble` (21,) multiplies the terms of `BUBBLES`.
    """

    lengths: Floats
    sagittas: Floats
    leans: Floats
    bubble: Floats

    @property
    def surface(self) -> CurvedPatch:
        """The patch as one polynomial in the part frame."""
        flat = laid_down(self.lengths)
        inward = inward_normals(flat)
        rise = np.column_stack([-np.sin(self.leans)[:, None] * inward, np.cos(self.leans)])
        coefficients = np.vstack(
            [
                np.column_stack([flat, np.zeros(3)]),
                4 * self.sagittas[:, None] * rise,
                self.bubble[:, None] * np.array([0.0, 0.0, 1.0]),
            ]
        )
        return CurvedPatch(read_only(np.vstack([np.eye(3, dtype=np.int64), ARCS, BUBBLES])), read_only(coefficients))


def barycentric_gradients(lengths: Floats) -> Floats:
    """(3, 2): the gradient of each barycentric coordinate over a class triangle."""
    flat = laid_down(lengths)
    inward = np.roll(inward_normals(flat), -1, axis=0)  # coordinate j is 0 on side j + 1
    height = np.einsum("jk,jk->j", flat - np.roll(flat, -1, axis=0), inward)
    return inward / height[:, None]


def symmetric_bubbles(lengths: Floats, curves: Ints) -> Floats:
    """(b, r): a basis of the bubbles that every symmetry of the class, reflections included, leaves as they are.

    A symmetry must also carry each side to one that has the same boundary curve; `curves` (3,) numbers them.
    """
    number = {tuple(row): i for i, row in enumerate(BUBBLES.tolist())}
    side = {frozenset((i, (i + 1) % 3)): int(c) for i, c in enumerate(curves)}
    orbit = np.arange(len(BUBBLES))
    for permutation, _ in symmetries(lengths):
        if any(side[frozenset(permutation[i] for i in pair)] != c for pair, c in side.items()):
            continue
        for i, row in enumerate(BUBBLES.tolist()):
            image = number[tuple(row[p] for p in permutation)]
            orbit[orbit == orbit[image]] = orbit[i] = min(orbit[i], orbit[image])
    kinds = np.unique(orbit)
    return read_only((orbit[:, None] == kinds[None]).astype(np.float64))


def length_groups(class_lengths: Floats, most: int) -> Ints:
    """(k, 3): number of the group of equal lengths of each side; one group of all where there are more than `most`."""
    lengths, index = np.unique(class_lengths, return_inverse=True)
    steps = np.concatenate([[0], np.cumsum(np.diff(lengths) > SAME_LENGTH * lengths[-1])]).astype(np.int64)
    group = steps[index].reshape(class_lengths.shape)
    return group if group.max() < most else np.zeros_like(group)
