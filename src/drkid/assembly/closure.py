"""Virtual assembly: whether the printed parts, joined by their hinges alone, make the closed shell."""

from dataclasses import dataclass

import numpy as np

from drkid.assembly.breadth_first import chained
from drkid.assembly.hinge_framework import HingeFramework
from drkid.assembly.relaxation import relaxed
from drkid.assembly.tolerance import Response
from drkid.kit import Closure, Drift, Gaps, ToleranceBudget, Verdict
from drkid.mesh import Floats, Ints
from drkid.rigid_fit import rigid_fit

ROUNDING_MM = 1e-3  # a gap that no clearance is needed for: printed lengths are rounded
STRAIN_PLAYS = 2.0  # times the play: 0.8 mm of FDM, of which the parts have to give half, about 1 % of a side of 35 mm
NINETY_FIVE = 1.614  # 95th percentile of the length of a normal deviate in space, of its root mean square


@dataclass(frozen=True)
class Play:
    """What a joint has to give, in mm: both halves' slip in their pockets, and both bores' around the rod."""

    slip_mm: float
    rod_mm: float
    accuracy_mm: float


@dataclass(frozen=True, eq=False)
class Joining:
    """The shell as the hinges join it.

    `closure` sums up `placements` (P, 4, 4), fitted to M_f, the widest gap of each hinge `gaps_mm` (J,), and what 95
    of 100 prints stay below there that scatter, `scatter_mm` (J,).
    """

    closure: Closure
    placements: Floats
    gaps_mm: Floats
    scatter_mm: Floats


def joined(
    framework: HingeFramework,
    corners: tuple[Floats, ...],
    targets: tuple[Floats, ...],
    names: Ints,
    moulds: Ints,
    play: Play,
) -> Joining:
    """Join the pieces by their hinges alone, relax, and compare with the clearances and with M_f.

    `corners[p]` (n, 3) are piece p's in its part frame, `targets[p]` the vertices of M_f that they belong at. `names`
    (P,) is a face of each piece, `moulds` (J, 2) numbers the mould and side of either side of each joint.

    The verdict goes by the largest gap: up to the slip of both halves in their pockets it *closes*, the rod's clearance
    being left for turning; up to `STRAIN_PLAYS` times that it *closes with strain*, parts and hinges giving; beyond,
    or where no rest was found, it *does not close*.

    Raises:
        ValueError: the pieces are not all connected.
    """
    chain = chained(framework)
    rest = relaxed(framework, chain)
    gaps = _widest(rest.gaps)
    placed = _points(rest.placements, corners)
    wanted = np.concatenate(targets)
    motion = rigid_fit(placed, wanted)
    fitted = placed @ motion[:3, :3].T + motion[:3, 3]
    response = Response(framework, rest.placements)
    scatter = NINETY_FIVE * response.scattered(play.accuracy_mm).max(axis=1)
    alike = response.shared(moulds, play.accuracy_mm)
    risk = int(np.argmax(np.round(gaps + scatter, 9)))
    closure = Closure(
        verdict=_verdict(float(gaps.max()), play.slip_mm, rest.settled),
        play_mm=play.slip_mm,
        gaps=_summary(gaps),
        chain=_summary(_widest(framework.gaps(chain))),
        drift=_drift(fitted, wanted),
        budget=ToleranceBudget(
            slip_mm=play.slip_mm,
            rod_mm=play.rod_mm,
            accuracy_mm=play.accuracy_mm,
            joint=(int(names[framework.pieces[risk, 0]]), int(names[framework.pieces[risk, 1]])),
            gap_mm=float(gaps[risk]),
            scatter_mm=float(scatter[risk]),
            reserve_mm=float(play.slip_mm + play.rod_mm - gaps[risk] - scatter[risk]),
            shared_mm=float(NINETY_FIVE * alike.max()),
        ),
        iterations=rest.iterations,
        settled=rest.settled,
    )
    return Joining(closure, motion @ rest.placements, gaps, scatter)


def _verdict(gap_mm: float, play_mm: float, settled: bool) -> Verdict:
    if not settled or gap_mm > max(STRAIN_PLAYS * play_mm, ROUNDING_MM):
        return "does not close"
    return "closes" if gap_mm <= max(play_mm, ROUNDING_MM) else "closes with strain"


def _widest(gaps: Floats) -> Floats:
    return np.linalg.norm(gaps, axis=-1).max(axis=-1)


def _summary(gaps: Floats) -> Gaps:
    return Gaps(float(gaps.mean()), float(np.percentile(gaps, 95)), float(gaps.max()))


def _points(placements: Floats, corners: tuple[Floats, ...]) -> Floats:
    return np.concatenate([c @ m[:3, :3].T + m[:3, 3] for c, m in zip(corners, placements, strict=True)])


def _drift(points: Floats, wanted: Floats) -> Drift:
    off = np.linalg.norm(points - wanted, axis=1)
    percent = 100 / float(np.linalg.norm(np.ptp(wanted, axis=0)))
    return Drift(float(off.mean()), float(off.max()), float(off.mean()) * percent, float(off.max()) * percent)
