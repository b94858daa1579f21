"""Prismoid: a triangle with thickness, its sides bevelled."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from drkid.class_triangle import following, inward_normals
from drkid.mesh import Floats, read_only
from drkid.solid import Solid

RIDGED = 3  # outlines, or insets of a side: at both faces and between
FROM_AXIS = 0.9  # of half the thickness: from there on bevels with a ridge go on in planes through the hinge axes; from
# the faces on, three planes would meet in one line


@dataclass(frozen=True, eq=False)
class Prismoid:
    """The convex hull of `outlines` (n, 3, 2), spaced evenly from −thickness_mm/2 to +thickness_mm/2.

    Two outlines make plane bevels, three make bevels with a ridge along the middle plane. Where `cuts` (2, 3) are
    given the corners of the inner and the outer face are cut off, so far behind them along the bisectors.
    """

    outlines: Floats
    thickness_mm: float
    cuts: Floats | None = None

    @property
    def faces(self) -> Floats:
        """(2, 3, 2): the inner and the outer face."""
        return self.outlines[[0, -1]]

    @property
    def is_ridged(self) -> bool:
        """Whether its bevels have a ridge along the middle plane."""
        return len(self.outlines) == RIDGED

    @property
    def levels_mm(self) -> Floats:
        """(n,): the height of each outline."""
        return np.linspace(-0.5, 0.5, len(self.outlines)) * self.thickness_mm

    @property
    def heights_mm(self) -> tuple[float, float]:
        """The heights of the two faces."""
        return -self.thickness_mm / 2, self.thickness_mm / 2

    @property
    def solid(self) -> Solid:
        """The piece without pockets."""
        return Solid.hull(self.points)

    @property
    def points(self) -> Floats:
        """(6n, 3): its corners, two for each corner of an outline, which are one where nothing is cut."""
        flat = np.repeat(self.outlines, 2, axis=1)
        if self.cuts is not None:
            flat[[0, -1]] = [
                cut_corners(face, row).reshape(6, 2) for face, row in zip(self.faces, self.cuts, strict=True)
            ]
        return np.vstack([np.column_stack([f, np.full(6, z)]) for f, z in zip(flat, self.levels_mm, strict=True)])

    def truncated(self, cuts_mm: Floats) -> "Prismoid":
        """With its corners cut off, `cuts_mm` (2, 3) behind them."""
        return replace(self, cuts=read_only(np.array(cuts_mm)))

    def outline(self, height_mm: float) -> Floats:
        """(3, 2): corners of the section at a height (a twisted side bulges over it, never stays behind)."""
        below = int(np.clip(np.searchsorted(self.levels_mm, height_mm) - 1, 0, len(self.outlines) - 2))
        low, high = self.levels_mm[below : below + 2]
        share = (height_mm - low) / (high - low)
        return (1 - share) * self.outlines[below] + share * self.outlines[below + 1]

    def insets(self, triangle: Floats) -> Floats:
        """(2, 3): how far each side of either face stands inside the class triangle's (3, 2), at the nearer end."""
        return np.stack([side_insets(triangle, face) for face in self.faces])

    def bevels(self, triangle: Floats) -> Iterator[tuple[float, float, Floats]]:
        """The planes of the bevels from below: lowest and highest height, and by how much a mm of height opens each.

        That is (3,), how much farther out a side stands at the top of a mm than at its bottom.
        """
        insets = [side_insets(triangle, outline) for outline in self.outlines]
        for (low, below), (high, above) in pairwise(zip(self.levels_mm.tolist(), insets, strict=True)):
            yield low, high, (below - above) / (high - low)


def cut_corners(outline: Floats, depths_mm: Floats) -> Floats:
    """(3, 2, 2): both ends of the cuts that lie `depths_mm` (3,) behind the corners of an outline (3, 2)."""
    ways = np.stack([np.roll(outline, 1, axis=0), following(outline)], axis=1) - outline[:, None]
    ways /= np.linalg.norm(ways, axis=2, keepdims=True)
    bisector = ways.sum(axis=1, keepdims=True)
    along = (ways * bisector / np.linalg.norm(bisector, axis=2, keepdims=True)).sum(axis=2, keepdims=True)
    return outline[:, None] + depths_mm[:, None, None] * ways / along


def side_insets(triangle: Floats, outline: Floats) -> Floats:
    """(3,): how far each side of an outline (3, 2) stands inside a triangle's (3, 2), at the nearer end."""
    offset = np.stack([outline, following(outline)]) - triangle
    return np.einsum("esk,sk->es", offset, inward_normals(triangle)).min(axis=0)


def bevelled(triangle: Floats, insets_mm: Floats, thickness_mm: float) -> Prismoid:
    """The prismoid whose outlines' sides stand `insets_mm` (n, 3) inside those of the class triangle (3, 2)."""
    normal = inward_normals(triangle)
    level = np.einsum("sk,sk->s", normal, triangle) + insets_mm
    systems = np.stack([np.roll(normal, 1, axis=0), normal], axis=1)  # corner i: sides i − 1 and i meet
    levels = np.stack([np.roll(level, 1, axis=1), level], axis=-1)
    outlines = np.linalg.solve(systems[None], levels[..., None])[..., 0]
    return Prismoid(read_only(outlines.astype(np.float64)), thickness_mm)
