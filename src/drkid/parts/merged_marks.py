"""Marks of merged pieces: the shape's letters on one triangle, a number beside each side of the outline.

A bent piece has no one plane inside: every mark lies in the inner face of one of its triangles, between that triangle's
folds. Sides are numbered counter-clockwise seen from outside, from the first of the kit format on. Letters and numbers
stand with their feet to the rim, so that M and W are told apart.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np

from drkid.kit import Dimensions, MergedClass, Part
from drkid.mesh import Floats, read_only
from drkid.parts.engraving import APART, HEIGHTS, Ground, engraving, glyphs, ground, letter, sampled
from drkid.parts.merged_piece import slab_mesh
from drkid.solid import Solid

NUMBER_HEIGHTS = (5.5, 4.0)  # in stroke widths
PLACE_STEP = 0.75  # between places that are tried for a number, in stroke widths
WORDS_APART = (5.0, APART)  # between the strokes of two marks, in stroke widths: rather so far apart than large
FARTHEST = 0.6  # of a triangle's height: how far from its side a number may stand
LETTERED_TRIANGLES = 3  # that are tried for the letters, those with the widest free places


@dataclass(frozen=True, eq=False)
class _Triangle:
    """The inner face of one triangle of a piece, in a plane of its own, and the ground that is left for marks.

    `frame` takes the plane, with the inner face at z = −thickness/2, to the part; `outline` (3, 2) are its corners
    there, the first side one of the piece's outline if the triangle has one. `sides` are those of the piece that the
    triangle has, and where each starts and ends (2, 2).
    """

    frame: Floats
    outline: Floats
    sides: dict[int, Floats]
    ground: Ground
    lines: tuple[Floats, ...] = ()

    @cached_property
    def widest_mm(self) -> float:
        """Of the places that are free, the distance to what surrounds the widest."""
        return float(self.ground.room_mm.max())

    def bearing(self, lines: Floats, apart_mm: float) -> "_Triangle":
        """With further strokes, from which others keep a distance."""
        return replace(self, ground=self.ground.without(lines, apart_mm), lines=(*self.lines, lines))

    def cutter(self, width_mm: float, depth_mm: float, thickness_mm: float) -> Solid:
        """What its strokes remove of the part."""
        low = -thickness_mm / 2
        return engraving(np.concatenate(self.lines), width_mm, low - depth_mm, low + depth_mm).moved(self.frame)


@dataclass(frozen=True)
class _Missing:
    """What found no room: the letters, and the numbers of which sides, counted from 1."""

    letters: bool
    sides: tuple[int, ...]

    @property
    def count(self) -> int:
        return self.letters + len(self.sides)


def merged_marked(
    part: Part, shape: MergedClass, dimensions: Dimensions, width_mm: float, depth_mm: float
) -> tuple[Part, tuple[str, ...]]:
    """The part of a shape in its part frame, with its marks, and what found no room on it, in words."""
    triangles, missing = _marks(part, shape, dimensions, width_mm, depth_mm)
    cutters = [t.cutter(width_mm, depth_mm, dimensions.thickness_mm) for t in triangles if t.lines]
    words = ("letters" if len(part.name) > 1 else "letter",) if missing.letters else ()
    numbers = tuple(f"number of side {side}" for side in missing.sides)
    return replace(part, solid=part.solid.minus_all(cutters).without_needles()), (*words, *numbers)


def _marks(
    part: Part, shape: MergedClass, dimensions: Dimensions, width_mm: float, depth_mm: float
) -> tuple[list[_Triangle], _Missing]:
    """The triangles with their strokes: the largest letters that leave room for the numbers, or for most of them."""
    bare = [_triangle(part.solid, shape, face, dimensions, width_mm, depth_mm) for face in range(len(shape.faces))]
    best: tuple[list[_Triangle], _Missing] | None = None
    for apart, height in product(WORDS_APART, HEIGHTS):
        lettered = _lettered(bare, part.name, height, apart, width_mm)
        if lettered is None:
            continue
        triangles, sides = _numbered(lettered, shape, apart, width_mm)
        if best is None or len(sides) < best[1].count:
            best = triangles, _Missing(letters=False, sides=sides)
        if not sides:
            break
    if best is None:
        triangles, sides = _numbered(bare, shape, APART, width_mm)
        best = triangles, _Missing(letters=True, sides=sides)
    return best


def _triangle(
    solid: Solid, shape: MergedClass, face: int, d: Dimensions, width_mm: float, depth_mm: float
) -> _Triangle:
    """The inner face of a triangle with all its room; a side has the number of the corner at which it starts."""
    corners, own = shape.faces[face], np.flatnonzero(shape.side_face == face)
    corners = np.roll(corners, -int(np.isin(corners, own).argmax()))
    inner = slab_mesh(shape, 0.0, d.thickness_mm).vertices[corners]
    frame = _frame(inner, d.thickness_mm)
    to_plane = np.asarray(np.linalg.inv(frame), np.float64)
    outline = (inner @ to_plane[:3, :3].T + to_plane[:3, 3])[:, :2]
    ends = np.stack([outline, np.roll(outline, -1, axis=0)], axis=1)
    sides = {int(corner): read_only(ends[k]) for k, corner in enumerate(corners) if corner in own}
    return _Triangle(frame, outline, sides, ground(solid.moved(to_plane), d, width_mm, depth_mm, outline))


def _frame(inner: Floats, thickness_mm: float) -> Floats:
    """(4, 4): x along the first side of an inner face (3, 3), z outwards, the face at z = −thickness/2."""
    x = inner[1] - inner[0]
    x /= np.linalg.norm(x)
    z = np.cross(x, inner[2] - inner[0])
    z /= np.linalg.norm(z)
    frame = np.eye(4)
    frame[:3, 0], frame[:3, 1], frame[:3, 2] = x, np.cross(z, x), z
    frame[:3, 3] = inner.mean(axis=0) + z * thickness_mm / 2
    return read_only(frame)


def _lettered(bare: list[_Triangle], name: str, height: float, apart: float, width_mm: float) -> list[_Triangle] | None:
    """With the letters where the widest free place is, lengths in stroke widths; None where no triangle has room."""
    order = sorted(range(len(bare)), key=lambda k: -bare[k].widest_mm)
    for chosen in order[:LETTERED_TRIANGLES]:
        lines = letter(name, height * width_mm, bare[chosen].ground, width_mm)
        if lines is not None:
            return [t.bearing(lines, apart * width_mm) if k == chosen else t for k, t in enumerate(bare)]
    return None


def _numbered(
    triangles: list[_Triangle], shape: MergedClass, apart: float, width_mm: float
) -> tuple[list[_Triangle], tuple[int, ...]]:
    """With the numbers of all sides that have room for theirs, and those that have none, counted from 1."""
    triangles, missing = list(triangles), list[int]()
    for side, face in enumerate(shape.side_face.tolist()):
        found = (_number(triangles[face], side, height * width_mm, width_mm) for height in NUMBER_HEIGHTS)
        lines = next((lines for lines in found if lines is not None), None)
        if lines is None:
            missing.append(side + 1)
        else:
            triangles[face] = triangles[face].bearing(lines, apart * width_mm)
    return triangles, tuple(missing)


def _number(triangle: _Triangle, side: int, height_mm: float, width_mm: float) -> Floats | None:
    """The strokes of a side's number, its feet to the side, as near to it and then to its middle as there is room.

    It stands nearer to its own side than to any other of the outline.
    """
    start, end = triangle.sides[side]
    half, step = float(np.linalg.norm(end - start)) / 2, PLACE_STEP * width_mm
    x = (end - start) / (2 * half)
    turn = np.array([x, [-x[1], x[0]]])  # rows: along the side, inwards
    depth = FARTHEST * float(((triangle.outline - start) @ turn[1]).max())
    places = np.meshgrid(np.arange(0.0, depth, step), np.arange(0.0, half, step), (1.0, -1.0), indexing="ij")
    inwards, along, sign = (axis.ravel() for axis in places)
    middles = (start + end) / 2 + np.column_stack([along * sign, inwards]) @ turn
    others = [ends for other, ends in triangle.sides.items() if other != side]
    nearest = np.min([_distance(middles, *ends) for ends in others], axis=0, initial=np.inf)
    middles = middles[(inwards < nearest) & (triangle.ground.room_at(middles) > -width_mm)]
    if not len(middles):
        return None
    lines = glyphs(str(side + 1), height_mm, width_mm) @ turn
    room = triangle.ground.room_at(middles[:, None] + sampled(lines, width_mm)).min(axis=1)
    free = np.flatnonzero(room > 0)
    return lines + middles[free[0]] if len(free) else None


def _distance(points: Floats, start: Floats, end: Floats) -> Floats:
    """(n,): distance of points (n, 2) from the line through two others."""
    along = (end - start) / np.linalg.norm(end - start)
    return np.abs((points - start) @ np.array([-along[1], along[0]]))
