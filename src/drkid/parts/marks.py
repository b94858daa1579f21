"""Marks: class letter and side ticks, engraved on the inner face where they leave every wall whole."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil, cos, pi, sqrt

import numpy as np
from numba import njit
from scipy.ndimage import map_coordinates

from drkid.class_triangle import SAME_LENGTH
from drkid.kit import Dimensions, Part
from drkid.mesh import Floats, Ints
from drkid.parts.detent import groove
from drkid.parts.pocket import deepest_height_mm
from drkid.parts.stroke_font import strokes
from drkid.solid import Solid

HEIGHTS = (10.0, 7.5, 5.5, 4.0)  # of a letter in stroke widths; the last one is the smallest to be read
TICK_LENGTHS = (3.0, 2.0)  # in stroke widths
TICK_PITCH = 2.2  # from one tick to the next, in stroke widths
APART = 2.0  # between the middles of a letter's and a tick's strokes, in stroke widths
STEP_MM = 0.3  # between places that are tried
MOST_PLACES = 4000  # that are tried for a letter: a large piece has many more, next to one another
MOST_SHIFTS = 16.0  # how far from its pocket a tick may stand, in stroke widths
SAMPLES = 0.5  # of a stroke's width between the points at which it is tested
ROUND = 8  # corners of a stroke's end
SKIN_MM = 0.01  # how far inside the inner face the section is taken
BETWEEN_MM = 0.02  # what straight lines between nodes, and samples of strokes, may take from a distance


@dataclass(frozen=True, eq=False)
class Marks:
    """Strokes (n, 2, 2) on the inner face of a part in its frame; what found no room is missing from them."""

    letter: Floats
    ticks: Floats
    missing: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class _Ground:
    """How much farther than needed every place of the engraved face is from walls and from marks, in mm.

    `room_mm` (nx, ny) at `low` + `STEP_MM` · (i, j), the nodes of a grid; negative where a mark may not be.
    """

    low: Floats
    room_mm: Floats

    @property
    def nodes(self) -> Floats:
        """(nx · ny, 2): the places of the grid."""
        grid = np.stack(np.meshgrid(*map(np.arange, self.room_mm.shape), indexing="ij"), axis=-1)
        return self.low + STEP_MM * grid.reshape(-1, 2)

    def room_at(self, points: Floats) -> Floats:
        """(…): the room at points (…, 2) between the nodes; negative beyond the grid."""
        at = np.moveaxis((points - self.low) / STEP_MM, -1, 0)
        return map_coordinates(self.room_mm, at, order=1, mode="constant", cval=-1.0)

    def without(self, lines: Floats, apart_mm: float) -> "_Ground":
        """The ground that is left when strokes lie on it from which others keep a distance."""
        distance = np.abs(_inside_distance(self.nodes, lines)).reshape(self.room_mm.shape)
        return _Ground(self.low, np.minimum(self.room_mm, distance - apart_mm))


def marked(part: Part, dimensions: Dimensions, width_mm: float, depth_mm: float) -> tuple[Part, tuple[str, ...]]:
    """The part with its marks, and what found no room on it, in words.

    The letter is as large as room allows and reads from inside; ticks stand beside each side: one at the shortest, two
    at the next longer, three at the longest, the same number at equal sides.
    """
    found = marks(part, dimensions, width_mm, depth_mm)
    lines = np.concatenate([found.letter, found.ticks])
    low = -dimensions.thickness_mm / 2
    solid = part.solid - _engraving(lines, width_mm, low - depth_mm, low + depth_mm) if len(lines) else part.solid
    return replace(part, solid=solid), found.missing


def marks(part: Part, dimensions: Dimensions, width_mm: float, depth_mm: float) -> Marks:
    """Where the marks of a part go: the largest letter that leaves room for the ticks, or for most of them."""
    ground = _ground(part, dimensions, width_mm, depth_mm)
    best: Marks | None = None
    for height in HEIGHTS:
        letter = _letter(part.name, height * width_mm, ground, width_mm)
        if letter is not None:
            found = Marks(letter, *_ticks(part, dimensions, ground, letter, width_mm))
            best = found if best is None or len(found.missing) < len(best.missing) else best
            if not best.missing:
                return best
    if best is not None:
        return best
    none = np.zeros((0, 2, 2))
    ticks, missing = _ticks(part, dimensions, ground, none, width_mm)
    return Marks(none, ticks, ("letter", *missing))


def side_ranks(part: Part) -> Ints:
    """For each side, 1 at the shortest, 2 at the next longer, and so on; the same at equal ones."""
    lengths = np.linalg.norm(np.roll(part.corners, -1, axis=0) - part.corners, axis=1)
    order = np.argsort(lengths, kind="stable")
    rank = np.empty(len(lengths), np.int64)
    rank[order] = 1 + np.concatenate([[0], np.cumsum(np.diff(lengths[order]) > SAME_LENGTH * lengths.max())])
    return rank


def _ground(part: Part, d: Dimensions, width_mm: float, depth_mm: float) -> _Ground:
    ridge, needed = groove(d), d.min_wall_mm
    if ridge is not None:  # a groove lies deeper than the mark, and stands out farther than the pocket's wall
        below = ridge.z - ridge.half_base + d.thickness_mm / 2 - depth_mm
        needed = max(needed, ridge.height + sqrt(max(needed**2 - below**2, 0.0)))
    face = -d.thickness_mm / 2
    heights = {face + SKIN_MM, face + max(depth_mm, 2 * SKIN_MM), max(face + SKIN_MM, deepest_height_mm(d))}
    sections = [_segments(part.solid.cross_section(z)) for z in sorted(heights)]
    low, high = sections[0].min(axis=(0, 1)), sections[0].max(axis=(0, 1))
    ground = _Ground(low, np.zeros(np.ceil((high - low) / STEP_MM).astype(int) + 1))
    room = np.min([_inside_distance(ground.nodes, s) for s in sections], axis=0) - (
        needed + _reach_mm(width_mm) + BETWEEN_MM
    )
    return _Ground(low, room.reshape(ground.room_mm.shape))


def _segments(loops: Sequence[Floats]) -> Floats:
    return np.concatenate([np.stack([loop, np.roll(loop, -1, axis=0)], axis=1) for loop in loops])


@njit(cache=True)
def _inside_distance(points: Floats, segments: Floats) -> Floats:
    """(n,): distance of points (n, 2) from the boundary of a region (s, 2, 2), negative outside it."""
    found = np.empty(len(points))
    for i in range(len(points)):
        x, y = points[i, 0], points[i, 1]
        least, inside = np.inf, False
        for j in range(len(segments)):
            ax, ay = segments[j, 0, 0], segments[j, 0, 1]
            ux, uy = segments[j, 1, 0] - ax, segments[j, 1, 1] - ay
            dx, dy = x - ax, y - ay
            share = min(max((dx * ux + dy * uy) / max(ux * ux + uy * uy, 1e-30), 0.0), 1.0)
            least = min(least, (dx - share * ux) ** 2 + (dy - share * uy) ** 2)
            if (dy < 0) != (dy < uy) and dx * uy * np.sign(uy) < dy * ux * np.sign(uy):
                inside = not inside
        found[i] = np.sqrt(least) if inside else -np.sqrt(least)
    return found


def _sampled(lines: Floats, width_mm: float) -> Floats:
    """(n, 2): points along strokes, nowhere farther apart than `SAMPLES` of their width."""
    count = int(np.ceil(np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1).max() / (SAMPLES * width_mm))) + 1
    share = np.linspace(0, 1, count)[None, :, None]
    return (lines[:, :1] * (1 - share) + lines[:, 1:] * share).reshape(-1, 2)


def _letter(text: str, height_mm: float, ground: _Ground, width_mm: float) -> Floats | None:
    """The strokes at the place with most room, or None where there is not enough of it."""
    lines = strokes(text, height_mm) * [-1, 1]  # seen from inside, x runs to the left
    places = ground.nodes[ground.room_mm.ravel() > -width_mm]
    if not len(places):
        return None
    places = places[:: ceil(len(places) / MOST_PLACES)]
    room = ground.room_at(places[:, None] + _sampled(lines, width_mm)).min(axis=1)
    best = int(room.argmax())
    return lines + places[best] if room[best] > 0 else None


def _ticks(
    part: Part, d: Dimensions, ground: _Ground, letter: Floats, width_mm: float
) -> tuple[Floats, tuple[str, ...]]:
    """The ticks of all sides that have room for their own, and which sides have none."""
    apart = APART * width_mm
    left = ground.without(letter, apart) if len(letter) else ground
    found, missing = [np.zeros((0, 2, 2))], list[str]()
    for side, (frame, rank) in enumerate(zip(part.side_frames, side_ranks(part), strict=True), 1):
        own = next(
            (g for n in TICK_LENGTHS if (g := _own_ticks(frame, int(rank), n, d, left, width_mm)) is not None), None
        )
        if own is None:
            missing.append(f"ticks of side {side}")
            continue
        found.append(own)
        left = left.without(own, apart)
    return np.concatenate(found), tuple(missing)


def _own_ticks(
    frame: Floats, count: int, length: float, d: Dimensions, ground: _Ground, width_mm: float
) -> Floats | None:
    """The ticks of one side, nearest to the side and then to its pocket, or None where there is no room."""
    x = d.pocket_width_mm / 2 + d.min_wall_mm + width_mm * np.arange(0.0, MOST_SHIFTS)
    y = np.arange(0.0, d.thickness_mm + d.pocket_depth_mm, width_mm)
    starts = np.stack(np.meshgrid(y, x, (1.0, -1.0), indexing="ij"), axis=-1).reshape(-1, 3)
    along = starts[:, 2:] * (starts[:, 1:2] + TICK_PITCH * width_mm * np.arange(count))
    low = np.stack([along, np.broadcast_to(starts[:, :1], along.shape)], axis=-1)
    groups = np.stack([low, low + np.array([0.0, length * width_mm])], axis=2) @ frame[:2, :2].T + frame[:2, 3]
    share = np.linspace(0, 1, ceil(length / SAMPLES) + 1)[:, None]
    points = groups[:, :, :1] * (1 - share) + groups[:, :, 1:] * share
    free = np.flatnonzero((ground.room_at(points) > 0).all(axis=(1, 2)))
    return groups[free[0]] if len(free) else None


def _reach_mm(width_mm: float) -> float:
    """How far a stroke of this width reaches from its middle line: the corners of its round ends lie outside."""
    return width_mm / 2 / cos(pi / ROUND)


def _engraving(lines: Floats, width_mm: float, low: float, high: float) -> Solid:
    """What strokes with round ends remove."""
    angle = 2 * np.pi * (np.arange(ROUND) + 0.5) / ROUND
    end = _reach_mm(width_mm) * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return Solid.prism_along_z([np.concatenate([a + end, b + end]) for a, b in lines], low, high)
