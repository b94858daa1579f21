"""Packing: shapes on rectangular sheets, by the no-fit polygon on a grid of places, bottom left first.

A place is free for a shape where its reference point lies outside the no-fit polygons of all that is placed there
(Adamowicz & Albano 1976; Burke et al. 2007). For convex outlines these are Minkowski sums, exact and quick; their
grid cells are found once for each pair of shapes, so that a place costs a lookup and a placement a few unions.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import ConvexHull

from drkid.mesh import Bools, Floats

TURNS_DEGREES = (0.0, 180.0, 90.0, 270.0)  # of a shape whose longest side lies along x: half turns pair up triangles
SHORTEST_SIDE_MM = 1e-6  # of a polygon: shorter ones are rounding, and nothing can be told to lie left of them


@dataclass(frozen=True, eq=False)
class Shape:
    """What is to be placed: convex outlines (n, 2), counter-clockwise, that together cover it."""

    outlines: tuple[Floats, ...]

    @cached_property
    def low(self) -> Floats:
        """(2,): lower left corner of the bounding box."""
        return np.vstack(self.outlines).min(axis=0)

    @cached_property
    def high(self) -> Floats:
        """(2,): upper right corner of the bounding box."""
        return np.vstack(self.outlines).max(axis=0)

    @property
    def area(self) -> float:
        """Of the outlines together; they do not overlap."""
        return sum(_area(outline) for outline in self.outlines)

    def turned(self, degrees: float) -> "Shape":
        """The shape turned counter-clockwise about the origin."""
        turn = rotation(degrees)
        return Shape(tuple(outline @ turn.T for outline in self.outlines))


@dataclass(frozen=True)
class Sheet:
    """A sheet from (0, 0) to (width, depth), the margin kept free along its border, and the gap between shapes."""

    width_mm: float
    depth_mm: float
    margin_mm: float
    spacing_mm: float


@dataclass(frozen=True)
class Place:
    """Where a shape lies: turned by `degrees` about its origin, which then lies at (x, y) of a sheet."""

    shape: int
    sheet: int
    degrees: float
    x: float
    y: float


def rotation(degrees: float) -> Floats:
    """(2, 2): counter-clockwise rotation; exact for quarter turns."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    matrix = np.array([[c, -s], [s, c]], np.float64)
    return matrix.round(15) if degrees % 90 == 0 else matrix


def hull_outline(points: Floats) -> Floats:
    """(n, 2): the convex hull of points (m, 2), counter-clockwise."""
    return points[ConvexHull(points).vertices]


def longest_side_degrees(outline: Floats) -> float:
    """Direction of an outline's longest side, the first where several are as long."""
    along = np.roll(outline, -1, axis=0) - outline
    length = np.linalg.norm(along, axis=1)
    x, y = along[int(np.argmax(length > length.max() * (1 - 1e-9)))]
    return float(np.degrees(np.arctan2(y, x)))


def pack(
    shapes: Sequence[Shape], counts: Sequence[int], sheet: Sheet, step_mm: float, *, aligned: bool = True
) -> list[Place]:
    """Places of `counts[i]` copies of every shape i, in the order of shapes, sheets filled one after another.

    Of several rules the one is kept that needs the fewest sheets and the least height on the last: every copy as low
    as it will go, or in rows of copies that stand upright and upside down by turns, what is left above the rows filled
    by the first rule. Turns are quarter turns, from the longest side along x where `aligned`; shapes that are not make
    no rows. Places lie on a grid of `step_mm`, distances are kept exactly.

    Raises:
        ValueError: a shape is larger than the sheet.
    """
    poses = [(i, turn, shape.turned(turn)) for i, shape in enumerate(shapes) for turn in _turns(shape, aligned)]
    table = _Table(poses, sheet, step_mm)
    order = [i for i, count in enumerate(counts) for _ in range(count)]
    tried = [_filled(order, table, rows) for rows in (((), (0, 1), (2, 3)) if aligned else ((),))]
    return min(tried, key=lambda filled: filled[1])[0]


def _filled(order: list[int], table: "_Table", row_turns: tuple[int, ...]) -> tuple[list[Place], tuple[int, float]]:
    """Places by one rule, and how good they are: number of sheets, and height on the last."""
    sheets: list[_Filling] = []
    places: list[Place] = []
    first, before = 0, -1
    left = Counter(order)
    for i in order:
        first, before = (first if i == before else 0), i  # what did not fit there will not for the next copy
        own = [p for p, pose in enumerate(table.poses) if pose[0] == i]
        first, pose, at = _first_free(sheets, own, table, first, row_turns)
        left[i] -= 1
        sheets[first].place(pose, at, [p for p, (other, _, _) in enumerate(table.poses) if left[other]])
        places.append(Place(i, first, table.poses[pose][1], *table.position(pose, at)))
    return places, (len(sheets), sheets[-1].top if sheets else 0.0)


def _turns(shape: Shape, aligned: bool) -> list[float]:
    first = longest_side_degrees(max(shape.outlines, key=_area)) if aligned else 0.0
    return [turn - first for turn in TURNS_DEGREES]


def _first_free(
    sheets: "list[_Filling]", own: list[int], table: "_Table", first: int, row_turns: tuple[int, ...]
) -> tuple[int, int, tuple[int, int]]:
    for number in range(first, len(sheets) + 1):
        if number == len(sheets):
            sheets.append(_Filling(table))
        filling = sheets[number]
        found = filling.next_in_row([own[turn] for turn in row_turns]) or filling.lowest_of(own)
        if found is not None:
            return number, *found
        if filling.top < 0:
            break
    message = "a shape is larger than the sheet"
    raise ValueError(message)


class _Table:
    """Grids of places of every pose, and the cells that a placed pose takes from another's grid."""

    def __init__(self, poses: list[tuple[int, float, Shape]], sheet: Sheet, step_mm: float) -> None:
        self.poses = poses
        self.shapes = [shape for _, _, shape in poses]
        self.sheet, self.step_mm = sheet, step_mm
        size = np.array([sheet.width_mm, sheet.depth_mm]) - 2 * sheet.margin_mm
        room = [size - (shape.high - shape.low) for shape in self.shapes]
        self.grids = [np.maximum(np.floor(r / step_mm + 1e-9).astype(int) + 1, 0)[::-1] for r in room]
        self._cells: dict[tuple[int, int], tuple[int, int, Bools]] = {}

    def origin(self, pose: int) -> Floats:
        """(2,): where a pose's origin lies at cell (0, 0): its box is then in the margin's corner."""
        return self.sheet.margin_mm - self.shapes[pose].low

    def position(self, pose: int, at: tuple[int, int]) -> tuple[float, float]:
        """Where a pose's origin lies at a cell (row, column)."""
        x, y = self.origin(pose) + self.step_mm * np.array([at[1], at[0]])
        return float(x), float(y)

    def top(self, pose: int, at: tuple[int, int]) -> float:
        """How high a pose at a cell reaches."""
        return round(self.position(pose, at)[1] + float(self.shapes[pose].high[1]), 6)

    def cells(self, placed: int, other: int) -> tuple[int, int, Bools]:
        """Cells of `other`'s grid that `placed` at its cell (0, 0) takes: row and column of the first, and which."""
        key = placed, other
        if key not in self._cells:
            self._cells[key] = self._no_fit(placed, other)
        return self._cells[key]

    def _no_fit(self, placed: int, other: int) -> tuple[int, int, Bools]:
        gap, step = self.sheet.spacing_mm, self.step_mm
        shift = self.origin(placed) - self.origin(other)
        polygons = [
            hull_outline((a[:, None] - b[None]).reshape(-1, 2)) + shift
            for a in self.shapes[placed].outlines
            for b in self.shapes[other].outlines
        ]
        low = np.floor((np.min([p.min(axis=0) for p in polygons], axis=0) - gap) / step).astype(int)
        high = np.ceil((np.max([p.max(axis=0) for p in polygons], axis=0) + gap) / step).astype(int)
        taken = np.zeros((high - low + 1)[::-1], np.bool_)
        for polygon in polygons:
            first = np.maximum(np.floor((polygon.min(axis=0) - gap) / step).astype(int), low)
            last = np.ceil((polygon.max(axis=0) + gap) / step).astype(int)
            x, y = (step * np.arange(first[k], last[k] + 1) for k in range(2))
            inside = _nearer(polygon, x, y, gap)
            row, column = first[1] - low[1], first[0] - low[0]
            taken[row : row + len(y), column : column + len(x)] |= inside
        return int(low[1]), int(low[0]), taken


class _Filling:
    """A sheet that is being filled: which cells of every pose's grid are still free."""

    def __init__(self, table: _Table) -> None:
        self.table = table
        self.free: list[Bools] = [np.ones((rows, columns), np.bool_) for rows, columns in table.grids]
        self.top = -1.0  # how high what is placed reaches; negative where nothing is
        self.row = 0  # of the grid: where the row of copies stands that is being filled

    def lowest_of(self, poses: list[int]) -> tuple[int, tuple[int, int]] | None:
        """The pose that goes lowest, and its cell; leftmost among equals."""
        found = [(pose, at) for pose in poses if (at := self._lowest(pose)) is not None]
        table = self.table
        return min(found, key=lambda f: (table.top(*f), table.position(*f)[0], f[0]), default=None)

    def next_in_row(self, poses: list[int]) -> tuple[int, tuple[int, int]] | None:
        """The pose that goes leftmost in the row, and its cell; a row is begun above what is placed."""
        step, sheet = self.table.step_mm, self.table.sheet
        above = int(np.ceil((self.top + sheet.spacing_mm - sheet.margin_mm) / step)) if self.top >= 0 else 0
        for row in sorted({self.row, max(above, self.row)}):
            found = [(pose, (row, column)) for pose in poses if (column := self._leftmost(pose, row)) is not None]
            if found:
                self.row = row
                return min(found, key=lambda f: (f[1][1], f[0]))
        return None

    def _leftmost(self, pose: int, row: int) -> int | None:
        free = self.free[pose]
        if row >= len(free) or not free[row].any():
            return None
        return int(free[row].argmax())

    def _lowest(self, pose: int) -> tuple[int, int] | None:
        """Row and column of the lowest free cell, leftmost among equals."""
        free = self.free[pose]
        first = int(free.argmax()) if free.size else 0
        if not free.size or not free.flat[first]:
            return None
        return first // free.shape[1], first % free.shape[1]

    def place(self, pose: int, at: tuple[int, int], others: list[int]) -> None:
        """Take the cells that this placement rules out, of the grids of poses that are still to come."""
        self.top = max(self.top, self.table.top(pose, at))
        for other in others:
            free = self.free[other]
            row, column, taken = self.table.cells(pose, other)
            row, column = row + at[0], column + at[1]
            r0, c0 = max(row, 0), max(column, 0)
            r1, c1 = min(row + taken.shape[0], free.shape[0]), min(column + taken.shape[1], free.shape[1])
            if r0 < r1 and c0 < c1:
                free[r0:r1, c0:c1] &= ~taken[r0 - row : r1 - row, c0 - column : c1 - column]


def _nearer(polygon: Floats, x: Floats, y: Floats, gap: float) -> Bools:
    """(len(y), len(x)): whether grid points are inside a convex polygon or nearer to it than `gap`."""
    along = np.roll(polygon, -1, axis=0) - polygon
    sides = np.hypot(*along.T) > SHORTEST_SIDE_MM
    polygon, along = polygon[sides], along[sides]
    px, py = x[None, :, None] - polygon[:, 0], y[:, None, None] - polygon[:, 1]
    left = along[:, 0] * py - along[:, 1] * px
    inside = (left > 1e-9).all(axis=-1)
    share = np.clip((px * along[:, 0] + py * along[:, 1]) / (along**2).sum(axis=1), 0, 1)
    away = np.hypot(px - share * along[:, 0], py - share * along[:, 1]).min(axis=-1)
    return inside | (away < gap - 1e-9)


def _area(outline: Floats) -> float:
    x, y = outline.T
    return float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2)
