"""Engraving: strokes in the inner face of a piece, and the room that walls, pockets and other strokes leave for them.

The inner face lies in the plane z = −thickness/2; seen from inside, x runs to the left.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, cos, pi, sqrt

import numpy as np
from numba import njit
from scipy.ndimage import map_coordinates

from drkid.kit import Dimensions
from drkid.mesh import Floats
from drkid.parts.detent import groove
from drkid.parts.pocket import deepest_height_mm
from drkid.parts.stroke_font import strokes
from drkid.solid import Solid

HEIGHTS = (10.0, 7.5, 5.5, 4.0)  # of a letter in stroke widths; the last one is the smallest to be read
BETWEEN_LETTERS = 2.0  # between the middles of two letters' strokes, in stroke widths at least
APART = 2.0  # between the middles of two marks' strokes, in stroke widths
STEP_MM = 0.3  # between places that are tried
MOST_PLACES = 4000  # that are tried for a letter: a large piece has many more, next to one another
SAMPLES = 0.5  # of a stroke's width between the points at which it is tested
ROUND = 8  # corners of a stroke's end
SKIN_MM = 0.01  # how far inside the inner face the section is taken
BETWEEN_MM = 0.02  # what straight lines between nodes, and samples of strokes, may take from a distance
ABOVE = (0.25, 0.5, 0.75)  # of a wall over a stroke's ground: where else sections are taken
BENT = 0.02  # of a letter's height: how far its lines are off a straight line
NO_LINES = np.zeros((0, 2, 2))


@dataclass(frozen=True, eq=False)
class Ground:
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

    def without(self, lines: Floats, apart_mm: float) -> "Ground":
        """The ground that is left when strokes lie on it from which others keep a distance."""
        distance = np.abs(_inside_distance(self.nodes, lines)).reshape(self.room_mm.shape)
        return Ground(self.low, np.minimum(self.room_mm, distance - apart_mm))


def ground(solid: Solid, d: Dimensions, width_mm: float, depth_mm: float, outline: Floats | None = None) -> Ground:
    """Where strokes leave every wall whole; only inside a polygon (n, 2) and as far from it, where one is given.

    Walls are sought at the inner face, at the strokes' ground, where pockets are widest, and over the ground as far as
    a wall reaches, since sides may lean inwards.
    """
    ridge, needed = groove(d), d.min_wall_mm
    if ridge is not None:  # a groove lies deeper than the mark, and stands out farther than the pocket's wall
        below = ridge.z - ridge.half_base + d.thickness_mm / 2 - depth_mm
        needed = max(needed, ridge.height + sqrt(max(needed**2 - below**2, 0.0)))
    face = -d.thickness_mm / 2
    bottom = face + max(depth_mm, 2 * SKIN_MM)
    wanted = dict.fromkeys((face + SKIN_MM, bottom, max(face + SKIN_MM, deepest_height_mm(d))), needed)
    for share in ABOVE:
        wanted[bottom + share * d.min_wall_mm] = sqrt(1 - share**2) * d.min_wall_mm
    sections = {z: segments(solid.cross_section(z)) for z in sorted(wanted)}
    own = next(iter(sections.values())) if outline is None else segments([outline])
    low, high = own.min(axis=(0, 1)), own.max(axis=(0, 1))
    empty = Ground(low, np.zeros(np.ceil((high - low) / STEP_MM).astype(int) + 1))
    nodes, margin = empty.nodes, reach_mm(width_mm) + BETWEEN_MM
    room = np.full(len(nodes), np.inf)
    if outline is not None:
        room = _inside_distance(nodes, own) - d.min_wall_mm - margin
    near = room > -2 * STEP_MM  # other nodes have no neighbour with room
    for z, section in sections.items():
        room[near] = np.minimum(room[near], _inside_distance(nodes[near], section) - wanted[z] - margin)
    return Ground(low, room.reshape(empty.room_mm.shape))


def segments(loops: Sequence[Floats]) -> Floats:
    """(s, 2, 2): the sides of closed polygons, each (n, 2)."""
    return np.concatenate([NO_LINES, *(np.stack([loop, np.roll(loop, -1, axis=0)], axis=1) for loop in loops)])


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


def sampled(lines: Floats, width_mm: float) -> Floats:
    """(n, 2): points along strokes, nowhere farther apart than `SAMPLES` of their width."""
    count = int(np.ceil(np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1).max() / (SAMPLES * width_mm))) + 1
    share = np.linspace(0, 1, count)[None, :, None]
    return (lines[:, :1] * (1 - share) + lines[:, 1:] * share).reshape(-1, 2)


def glyphs(text: str, height_mm: float, width_mm: float) -> Floats:
    """(n, 2, 2): the strokes of letters and figures about 0, to be read from inside.

    They are bent, less than an eye sees: corners of three strokes in one straight line make faces without width, which
    single precision may turn over where they do not lie in a plane of the axes.
    """
    lines = strokes(text, height_mm, BETWEEN_LETTERS * width_mm) * [-1, 1]
    return lines + BENT / height_mm * lines[..., ::-1] ** 2 * [0.5, 1]


def letter(text: str, height_mm: float, free: Ground, width_mm: float) -> Floats | None:
    """The strokes at the place with most room, or None where there is not enough of it."""
    lines = glyphs(text, height_mm, width_mm)
    places = free.nodes[free.room_mm.ravel() > -width_mm]
    if not len(places):
        return None
    places = places[:: ceil(len(places) / MOST_PLACES)]
    room = free.room_at(places[:, None] + sampled(lines, width_mm)).min(axis=1)
    best = int(room.argmax())
    return lines + places[best] if room[best] > 0 else None


def reach_mm(width_mm: float) -> float:
    """How far a stroke of this width reaches from its middle line: the corners of its round ends lie outside."""
    return width_mm / 2 / cos(pi / ROUND)


def engraving(lines: Floats, width_mm: float, low: float, high: float) -> Solid:
    """What strokes with round ends remove."""
    angle = 2 * np.pi * (np.arange(ROUND) + 0.5) / ROUND
    end = reach_mm(width_mm) * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return Solid.prism_along_z([np.concatenate([a + end, b + end]) for a, b in lines], low, high)
