"""Curved patch: a smooth surface over a triangle, a polynomial in its barycentric coordinates.

A polynomial, and not a mesh, because a piece's skins reach beyond the triangle where its sides are bevelled.
"""

from dataclasses import dataclass
from functools import cache
from itertools import combinations_with_replacement

import numpy as np

from drkid.mesh import Floats, Ints, read_only


@dataclass(frozen=True, eq=False)
class CurvedPatch:
    """P(b) = Σ c·b₀^p b₁^q b₂^r: `exponents` (t, 3), `coefficients` (t, 3) in the part frame of the patch's class."""

    exponents: Ints
    coefficients: Floats

    def points(self, barycentric: Floats) -> Floats:
        """(n, 3): the surface at barycentric coordinates (n, 3) that add up to 1, negative beyond a side."""
        return monomials(self.exponents, barycentric) @ self.coefficients

    def normals(self, barycentric: Floats) -> Floats:
        """(n, 3): the surface's unit normals there."""
        per_corner = np.einsum("ntj,tk->njk", gradients(self.exponents, barycentric), self.coefficients)
        a, b, c = np.moveaxis(per_corner, 1, 0)
        normal = np.cross(b - a, c - a)
        return normal / np.linalg.norm(normal, axis=1, keepdims=True)

    def scaled(self, factor: float) -> "CurvedPatch":
        """All coordinates times `factor`."""
        return CurvedPatch(self.exponents, read_only(self.coefficients * factor))

    def flattened(self, share: float) -> "CurvedPatch":
        """The patch at this share of the way from its plane triangle, corners where they are."""
        corners = (1 - share) * self.points(np.eye(3))
        return CurvedPatch(
            read_only(np.vstack([self.exponents, np.eye(3, dtype=np.int64)])),
            read_only(np.vstack([share * self.coefficients, corners])),
        )


def monomials(exponents: Ints, barycentric: Floats) -> Floats:
    """(n, t): every term at barycentric coordinates (n, 3)."""
    return np.prod(barycentric[:, None, :] ** exponents[None], axis=2)


def gradients(exponents: Ints, barycentric: Floats) -> Floats:
    """(n, t, 3): derivatives of every term by each barycentric coordinate as if they were independent."""
    out = np.empty((len(barycentric), len(exponents), 3))
    for j in range(3):
        lowered = exponents.copy()
        lowered[:, j] = np.maximum(lowered[:, j] - 1, 0)
        out[..., j] = exponents[:, j] * monomials(lowered, barycentric)
    return out


@dataclass(frozen=True, eq=False)
class BarycentricGrid:
    """`points` (n, 3) barycentric coordinates, `faces` (m, 3) counter-clockwise where the triangle is.

    `sides[i]` (2^levels + 1,) are the points from corner i to corner i + 1; `central` is the middle triangle.
    """

    points: Floats
    faces: Ints
    sides: tuple[Ints, Ints, Ints]
    central: int


@cache
def barycentric_grid(levels: int) -> BarycentricGrid:
    """A triangle halved so many times into 4^levels equal ones: (2^levels + 1)(2^levels + 2)/2 points."""
    n = 2**levels
    lattice = [(n - i - j, i, j) for j in range(n + 1) for i in range(n + 1 - j)]
    number = {point: k for k, point in enumerate(lattice)}
    faces: list[tuple[int, int, int]] = []
    for a, b, c in lattice:
        if a > 0:
            faces.append((number[a, b, c], number[a - 1, b + 1, c], number[a - 1, b, c + 1]))
        if a > 0 and b > 0:
            faces.append((number[a, b, c], number[a - 1, b, c + 1], number[a, b - 1, c + 1]))
    points = np.array(lattice, np.float64) / n
    along = range(n + 1)
    first = read_only(np.array([number[n - i, i, 0] for i in along], np.int64))
    second = read_only(np.array([number[0, n - i, i] for i in along], np.int64))
    third = read_only(np.array([number[i, 0, n - i] for i in along], np.int64))
    centres = points[np.array(faces)].mean(axis=1)
    central = int(np.argmin(((centres - 1 / 3) ** 2).sum(axis=1)))
    return BarycentricGrid(read_only(points), read_only(np.array(faces, np.int64)), (first, second, third), central)


def fitted(barycentric: Floats, points: Floats, degree: int) -> CurvedPatch:
    """The polynomial patch of a degree nearest to points (n, 3) at barycentric coordinates, exact at the corners."""
    exponents = np.array([np.bincount(c, minlength=3) for c in combinations_with_replacement(range(3), degree)])
    corner = exponents.max(axis=1) == degree
    at = [int(np.argmax(barycentric[:, exponents[i].argmax()])) for i in np.flatnonzero(corner)]
    coefficients = np.zeros((len(exponents), 3))
    coefficients[corner] = points[at]
    terms = monomials(exponents, barycentric)
    rest = points - terms[:, corner] @ coefficients[corner]
    coefficients[~corner] = np.linalg.lstsq(terms[:, ~corner], rest, rcond=None)[0]
    return CurvedPatch(read_only(exponents), read_only(coefficients))


def side_points(side: int, shares: Floats) -> Floats:
    """(n, 3): barycentric coordinates at shares of the way from corner `side` to the next."""
    out = np.zeros((len(shares), 3))
    out[:, side], out[:, (side + 1) % 3] = 1 - shares, shares
    return out
