"""Insertion: a piece swept along its outward normal to its place, against the solids that stand around it."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np

from drkid.mesh import Floats
from drkid.solid import Solid

BLOCKED_PERCENT = 0.1  # of the piece's volume: an overlap that a hand overcomes, such as a bump that springs past
STEP_MM = 1.0
REACH_THICKNESSES = 2.0  # how far outside its place the sweep begins
MOST_CANDIDATES = 40  # that are tried as the last piece


@dataclass(frozen=True, eq=False)
class Placed:
    """Solids at their places in the world.

    `bodies[p]` is piece p's and `placements` (P, 4, 4) its motion. `halves[p]` are the connectors of p's joints, both
    halves of each: they stand with the neighbours, and the pocket, which is open inwards, comes down over them.
    """

    bodies: Sequence[Solid]
    halves: Sequence[Sequence[Solid]]
    placements: Floats
    thickness_mm: float


@dataclass(frozen=True)
class Insertion:
    """How a piece goes in last: the largest overlap on its way, in percent of its volume, and how many were tried."""

    piece: int
    overlap_percent: float
    candidates: int

    @property
    def goes_in(self) -> bool:
        """Nothing that stands is in its way."""
        return self.overlap_percent <= BLOCKED_PERCENT


def last_piece(placed: Placed, candidates: Sequence[int]) -> Insertion:
    """The first of the candidates that goes in, or else the one that is hindered least.

    Raises:
        ValueError: there is no candidate.
    """
    if not len(candidates):
        message = "no piece to go in last"
        raise ValueError(message)
    bounds = np.array([body.bounds for body in placed.bodies])
    best: Insertion | None = None
    for tried, piece in enumerate(candidates[:MOST_CANDIDATES], 1):
        found = Insertion(piece, overlap_percent(placed, piece, bounds), tried)
        if found.goes_in:
            return found
        if best is None or found.overlap_percent < best.overlap_percent:
            best = found
    assert best is not None
    return Insertion(best.piece, best.overlap_percent, min(len(candidates), MOST_CANDIDATES))


def overlap_percent(placed: Placed, piece: int, bounds: Floats) -> float:
    """Largest overlap of a piece with all others on its way in; `bounds` (P, 2, 3) are those of the bodies.

    At its place only the connectors count: that neighbours leave each other room there is the bevels' affair.
    """
    body, motion = placed.bodies[piece], placed.placements[piece]
    travel = REACH_THICKNESSES * placed.thickness_mm * motion[:3, 2]
    low = np.minimum(bounds[piece, 0], bounds[piece, 0] + travel)
    high = np.maximum(bounds[piece, 1], bounds[piece, 1] + travel)
    near = ((bounds[:, 0] <= high) & (bounds[:, 1] >= low)).all(axis=1)
    near[piece] = False
    others = [placed.bodies[i] for i in np.flatnonzero(near).tolist()]
    count = ceil(REACH_THICKNESSES * placed.thickness_mm / STEP_MM)
    worst = 0.0
    for share in np.linspace(1.0, 0.0, count + 1):
        shift = np.eye(4)
        shift[:3, 3] = share * travel
        moved = body.moved(shift)
        obstacles = [*(others if share > 0 else ()), *placed.halves[piece]]
        worst = max(worst, sum((moved & other).volume for other in obstacles))
    return 100 * worst / body.volume
