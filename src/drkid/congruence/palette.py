"""The palette: few lengths, and the multisets of them that a triangle may have.

Lengths are named by ascending letters: s and l of two, a, b, c of three (numbers 0, 1, 2). A palette of q lengths makes
at most C(q + 2, 3) classes of triangles; with two lengths each is isosceles, so that one mould serves both hands.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations_with_replacement, permutations

import numpy as np

from drkid.errors import SpecError
from drkid.mesh import Bools, Floats, Ints
from drkid.spec import MULTISETS, letters_of, multiset_words

Multiset = tuple[int, int, int]
LETTERS = {1: "s", 2: "sl", 3: "abc"}

# The choices that a research trial found best; ratio to the shortest length.
RATIOS = {2: (1.0, 1.17), 3: (1.0, 1.1, 1.2)}
ONE_CLASS_RATIOS = (1.0, 1.14)

MOST_CLASSES = 10
FIXED_CLASSES = (1, 2, 3, 4, MOST_CLASSES)  # the others need a mesh to choose for


@dataclass(frozen=True)
class Palette:
    """`ratios` of the lengths to the shortest, ascending; `multisets` are the triangles allowed.

    `held` ratios are given from outside: only the common scale of the lengths may then change.
    """

    ratios: tuple[float, ...]
    multisets: tuple[Multiset, ...]
    held: bool = False

    @property
    def size(self) -> int:
        """Number q of lengths."""
        return len(self.ratios)

    @cached_property
    def allowed(self) -> Bools:
        """(q, q, q): may a triangle have these three labels, in any order?"""
        table = np.zeros((self.size,) * 3, np.bool_)
        for multiset in self.multisets:
            for order in permutations(multiset):
                table[order] = True
        table.setflags(write=False)
        return table

    def lengths(self, mean: float, labels: Ints) -> Floats:
        """(q,): lengths of these ratios at which the labelled edges (E,) have this mean."""
        ratios = np.array(self.ratios)
        return ratios * (mean / ratios[labels].mean())

    def class_of(self, face_labels: Ints) -> Ints:
        """(F,): index into `multisets` of each face's labels (F, 3), or −1."""
        place = {multiset: i for i, multiset in enumerate(self.multisets)}
        return np.array([place.get(tuple(row), -1) for row in np.sort(face_labels, axis=1).tolist()], np.int64)


def all_multisets(size: int) -> tuple[Multiset, ...]:
    """Every multiset of three out of `size` lengths, ascending."""
    return tuple((a, b, c) for a, b, c in combinations_with_replacement(range(size), 3))


def parse_multisets(text: str) -> Palette:
    """A palette from words such as 'ssl,sll' or 'aab,abc,bcc'.

    Raises:
        SpecError: a word is not three letters of s, l or of a, b, c.
    """
    try:
        words = multiset_words(text)
    except ValueError as error:
        raise SpecError(
            f"multisets {text!r} cannot be read", wanted=str(error), found=text, remedy="--multisets ssl,sll"
        ) from error
    letters = letters_of(words)
    multisets = [tuple(letters.index(c) for c in word) for word in words]
    ratios = ONE_CLASS_RATIOS if letters == "sl" and len(multisets) == 1 else RATIOS[len(letters)]
    return Palette(ratios, tuple((a, b, c) for a, b, c in multisets))


def moulds(palette: Palette) -> int:
    """Number of moulds that make every piece: two for a scalene triangle, its mirror image being another, else one."""
    return sum(2 if len(set(multiset)) == 3 else 1 for multiset in palette.multisets)


def palette_of_classes(classes: int) -> Palette:
    """The palette for k classes: two lengths up to k = 4, all of three lengths for k = 10.

    Raises:
        SpecError: no palette of at most three lengths has so many classes.
    """
    if classes in MULTISETS:
        return parse_multisets(MULTISETS[classes])
    if classes == MOST_CLASSES:
        return Palette(RATIOS[3], all_multisets(3))
    raise SpecError(
        f"the palette solver has no palette of {classes} classes",
        wanted="1, 2, 3, 4 or 10 classes",
        found=str(classes),
        remedy="one of these, or --method pressure",
    )
