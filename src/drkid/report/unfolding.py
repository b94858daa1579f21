"""Unfolding: the pieces of a closed surface laid flat in connected strips that do not overlap.

Strips grow from a seed: the neighbour nearest to the seed in the plane is hinged on where it overlaps nothing and the
strip still fits a page, so that the tree of folds stays compact and few strips are needed; of several seeds the one
that places most pieces is kept. (O'Rourke, "How to Fold It", 2011, on nets and cuts.)
"""

from collections.abc import Sequence
from dataclasses import dataclass
from heapq import heappop, heappush

import numpy as np

from drkid.mesh import Bools, Floats, Ints

TOUCHING = 1e-4  # of a side: what outlines may reach into one another by rounding, or where a class fits inexactly
ANGLES = 36  # directions in which a strip is measured against the page, over half a turn
SEEDS = 10  # tried for each strip
FLATTENING_STEPS = 50


@dataclass(frozen=True)
class Fold:
    """Side `sides[0]` of piece `pieces[0]` meets side `sides[1]` of piece `pieces[1]`."""

    pieces: tuple[int, int]
    sides: tuple[int, int]


@dataclass(frozen=True, eq=False)
class Strip:
    """Pieces that hang together: outlines (n, 2) by piece, and the joints that are folds within the strip."""

    outlines: dict[int, Floats]
    folds: tuple[int, ...]

    def moved(self, turn: Floats, shift: Floats) -> "Strip":
        """Turned by a matrix (2, 2), then shifted."""
        return Strip({piece: outline @ turn.T + shift for piece, outline in self.outlines.items()}, self.folds)

    @property
    def points(self) -> Floats:
        """(n, 2): all corners."""
        return np.vstack(list(self.outlines.values()))


def flattened(corners: Floats) -> Floats:
    """(n, 2): an outline in space (n, 3) laid flat, every side as long as it was.

    A planar outline keeps its shape. A bent one is projected onto its mean plane and moved by the least that gives
    its sides back their lengths (Gauss–Newton).
    """
    centred = corners - corners.mean(axis=0)
    normal = np.cross(centred, np.roll(centred, -1, axis=0)).sum(axis=0)
    along = corners[1] - corners[0]
    x = along - along @ normal / (normal @ normal) * normal
    x /= np.linalg.norm(x)
    y = np.cross(normal / np.linalg.norm(normal), x)
    flat = centred @ np.stack([x, y], axis=1)
    wanted = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    count = len(flat)
    for _ in range(FLATTENING_STEPS):
        side = np.roll(flat, -1, axis=0) - flat
        length = np.linalg.norm(side, axis=1)
        if np.abs(length - wanted).max() < 1e-12 * wanted.max():
            break
        slope = np.zeros((count, count, 2))
        rows = np.arange(count)
        slope[rows, rows] = -side / length[:, None]
        slope[rows, (rows + 1) % count] += side / length[:, None]
        step = np.linalg.lstsq(slope.reshape(count, -1), wanted - length, rcond=None)[0]
        flat = flat + step.reshape(-1, 2)
    return flat


def unfold(outlines: Sequence[Floats], triangles: Sequence[Ints], joints: Sequence[Fold], page: Floats) -> list[Strip]:
    """Strips that together hold every outline (n, 2) once, none larger than `page` (2,), in order of size.

    `triangles[i]` (m, 3) covers outline i. Joined sides of differing length meet at their middles.
    """
    surface = _Surface(outlines, triangles, joints, page)
    left = set(range(len(outlines)))
    strips: list[Strip] = []
    while left:
        seeds = sorted(left)
        chosen = sorted({seeds[int(k)] for k in np.linspace(0, len(seeds) - 1, SEEDS)})
        grown = [surface.grown(seed, left) for seed in chosen]
        best = max(grown, key=lambda strip: len(strip.outlines))
        strips.append(best)
        left -= best.outlines.keys()
    return sorted(strips, key=lambda strip: -len(strip.outlines))


class _Surface:
    """Outlines and how they meet."""

    def __init__(
        self, outlines: Sequence[Floats], triangles: Sequence[Ints], joints: Sequence[Fold], page: Floats
    ) -> None:
        self.outlines, self.triangles, self.page = outlines, triangles, page
        self.touching = TOUCHING * float(np.linalg.norm(outlines[0][1] - outlines[0][0]))
        self.across: list[list[tuple[int, int, int, int]]] = [[] for _ in outlines]  # joint, side, other, its side
        for number, joint in enumerate(joints):
            (a, b), (i, j) = joint.pieces, joint.sides
            self.across[a].append((number, i, b, j))
            self.across[b].append((number, j, a, i))
        angle = np.arange(ANGLES) * np.pi / ANGLES
        self.directions = np.stack([np.cos(angle), np.sin(angle)])

    def grown(self, seed: int, free: set[int]) -> Strip:
        """A strip of pieces of `free`, grown from a seed as far as it goes."""
        placed: dict[int, Floats] = {}
        bodies = np.empty((0, 3, 2))
        low, high = np.full(ANGLES, np.inf), np.full(ANGLES, -np.inf)
        folds: list[int] = []
        start = self.outlines[seed] - self.outlines[seed].mean(axis=0)
        waiting: list[tuple[float, int, int, Floats]] = [(0.0, -1, seed, start)]
        while waiting:
            _, key, piece, outline = heappop(waiting)
            if piece in placed:
                continue
            along = outline @ self.directions
            new_low, new_high = np.minimum(low, along.min(axis=0)), np.maximum(high, along.max(axis=0))
            body = outline[self.triangles[piece]]
            if not self._fits(new_high - new_low) or overlapping(body, bodies, self.touching).any():
                continue
            placed[piece], low, high = outline, new_low, new_high
            bodies = np.concatenate([bodies, body])
            folds += [key // len(self.outlines)] if key >= 0 else []
            for number, side, other, other_side in self.across[piece]:
                if other in free and other not in placed:
                    child = hinged(self.outlines[other], other_side, outline, side)
                    away = float(np.linalg.norm(child.mean(axis=0)))
                    heappush(waiting, (round(away, 6), number * len(self.outlines) + other, other, child))
        return Strip(placed, tuple(sorted(folds)))

    def _fits(self, width: Floats) -> bool:
        across = np.roll(width, -(ANGLES // 2))
        return bool(((width <= self.page[0]) & (across <= self.page[1])).any())


def upright(strip: Strip, page: Floats) -> Strip:
    """The strip turned to lie within the page, the turn that leaves most room beside it, its corner at the origin."""
    fitting: list[tuple[float, Strip]] = []
    for angle in np.arange(2 * ANGLES) * np.pi / ANGLES:
        c, s = np.cos(angle), np.sin(angle)
        turned = strip.moved(np.array([[c, s], [-s, c]]), np.zeros(2))
        size = np.ptp(turned.points, axis=0)
        excess = float(np.maximum(size - page - 1e-9, 0).max())
        fitting.append((excess * 1e9 + round(float(size.prod()), 6), turned))
    best = min(fitting, key=lambda pair: pair[0])[1]
    return best.moved(np.eye(2), -best.points.min(axis=0))


def hinged(outline: Floats, side: int, onto: Floats, onto_side: int) -> Floats:
    """The outline moved so that its side lies on another outline's side, in the opposite direction."""
    a, b = outline[side], outline[(side + 1) % len(outline)]
    c, d = onto[(onto_side + 1) % len(onto)], onto[onto_side]
    here, there = complex(*(b - a)), complex(*(d - c))
    turn = there / abs(there) / (here / abs(here))
    matrix = np.array([[turn.real, -turn.imag], [turn.imag, turn.real]])
    return (outline - (a + b) / 2) @ matrix.T + (c + d) / 2


def overlapping(bodies: Floats, others: Floats, touching: float) -> Bools:
    """(n,): whether triangle n of `others` (n, 3, 2) reaches into one of `bodies` (m, 3, 2) by more than `touching`.

    By separating axes; all triangles counter-clockwise.
    """
    if not len(others):
        return np.zeros(0, np.bool_)
    apart = np.maximum(_separation(bodies, others), _separation(others, bodies).T)
    return np.asarray((apart < -touching).any(axis=0))


def _separation(a: Floats, b: Floats) -> Floats:
    """(m, n): the largest distance of a triangle of `b` to the outside of a side of one of `a`; negative inside."""
    along = np.roll(a, -1, axis=1) - a
    outward = np.stack([along[..., 1], -along[..., 0]], axis=-1) / np.linalg.norm(along, axis=-1, keepdims=True)
    level = np.einsum("msk,msk->ms", outward, a)
    return (np.einsum("nck,msk->mnsc", b, outward).min(axis=-1) - level[:, None]).max(axis=-1)
