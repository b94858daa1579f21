"""Marks: class letter and side ticks, engraved on the inner face where they leave every wall whole."""

from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from drkid.class_triangle import SAME_LENGTH
from drkid.kit import Dimensions, Part
from drkid.mesh import Floats, Ints
from drkid.parts.engraving import APART, HEIGHTS, NO_LINES, SAMPLES, Ground, engraving, ground, letter

TICK_LENGTHS = (3.0, 2.0)  # in stroke widths
TICK_PITCH = 2.2  # from one tick to the next, in stroke widths
MOST_SHIFTS = 16.0  # how far from its pocket a tick may stand, in stroke widths


@dataclass(frozen=True, eq=False)
class Marks:
    """Strokes (n, 2, 2) on the inner face of a part in its frame; what found no room is missing from them."""

    letter: Floats
    ticks: Floats
    missing: tuple[str, ...]


def marked(part: Part, dimensions: Dimensions, width_mm: float, depth_mm: float) -> tuple[Part, tuple[str, ...]]:
    """The part with its marks, and what found no room on it, in words.

    The letter is as large as room allows and reads from inside; ticks stand beside each side: one at the shortest, two
    at the next longer, three at the longest, the same number at equal sides.
    """
    found = marks(part, dimensions, width_mm, depth_mm)
    lines = np.concatenate([found.letter, found.ticks])
    low = -dimensions.thickness_mm / 2
    solid = part.solid - engraving(lines, width_mm, low - depth_mm, low + depth_mm) if len(lines) else part.solid
    return replace(part, solid=solid), found.missing


def marks(part: Part, dimensions: Dimensions, width_mm: float, depth_mm: float) -> Marks:
    """Where the marks of a part go: the largest letter that leaves room for the ticks, or for most of them."""
    free = ground(part.solid, dimensions, width_mm, depth_mm)
    best: Marks | None = None
    for height in HEIGHTS:
        lines = letter(part.name, height * width_mm, free, width_mm)
        if lines is not None:
            found = Marks(lines, *_ticks(part, dimensions, free.without(lines, APART * width_mm), width_mm))
            best = found if best is None or len(found.missing) < len(best.missing) else best
            if not best.missing:
                return best
    if best is not None:
        return best
    ticks, missing = _ticks(part, dimensions, free, width_mm)
    return Marks(NO_LINES, ticks, ("letter", *missing))


def side_ranks(part: Part) -> Ints:
    """For each side, 1 at the shortest, 2 at the next longer, and so on; the same at equal ones."""
    lengths = np.linalg.norm(np.roll(part.corners, -1, axis=0) - part.corners, axis=1)
    order = np.argsort(lengths, kind="stable")
    rank = np.empty(len(lengths), np.int64)
    rank[order] = 1 + np.concatenate([[0], np.cumsum(np.diff(lengths[order]) > SAME_LENGTH * lengths.max())])
    return rank


def _ticks(part: Part, d: Dimensions, free: Ground, width_mm: float) -> tuple[Floats, tuple[str, ...]]:
    """The ticks of all sides that have room for their own, and which sides have none."""
    found, missing = [NO_LINES], list[str]()
    for side, (frame, rank) in enumerate(zip(part.side_frames, side_ranks(part), strict=True), 1):
        own = next(
            (g for n in TICK_LENGTHS if (g := _own_ticks(frame, int(rank), n, d, free, width_mm)) is not None), None
        )
        if own is None:
            missing.append(f"ticks of side {side}")
            continue
        found.append(own)
        free = free.without(own, APART * width_mm)
    return np.concatenate(found), tuple(missing)


def _own_ticks(frame: Floats, count: int, length: float, d: Dimensions, free: Ground, width_mm: float) -> Floats | None:
    """The ticks of one side, nearest to the side and then to its pocket, or None where there is no room."""
    x = d.pocket_width_mm / 2 + d.min_wall_mm + width_mm * np.arange(0.0, MOST_SHIFTS)
    y = np.arange(0.0, d.thickness_mm + d.pocket_depth_mm, width_mm)
    starts = np.stack(np.meshgrid(y, x, (1.0, -1.0), indexing="ij"), axis=-1).reshape(-1, 3)
    along = starts[:, 2:] * (starts[:, 1:2] + TICK_PITCH * width_mm * np.arange(count))
    low = np.stack([along, np.broadcast_to(starts[:, :1], along.shape)], axis=-1)
    groups = np.stack([low, low + np.array([0.0, length * width_mm])], axis=2) @ frame[:2, :2].T + frame[:2, 3]
    share = np.linspace(0, 1, ceil(length / SAMPLES) + 1)[:, None]
    points = groups[:, :, :1] * (1 - share) + groups[:, :, 1:] * share
    places = np.flatnonzero((free.room_at(points) > 0).all(axis=(1, 2)))
    return groups[places[0]] if len(places) else None
