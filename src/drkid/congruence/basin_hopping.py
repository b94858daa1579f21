"""Walks over exact meshes: hop, judge, and stay or go back (basin hopping, Wales and Doye 1997).

Until there is an exact mesh, walks may repair folds instead. A walk also takes a mesh that is somewhat worse, the less
likely the worse it is and the colder the round (Metropolis et al. 1953), and one that is not quite exact: behind it may
lie the next exact mesh.
"""

from dataclasses import dataclass

import numpy as np

from drkid.congruence.fold import Descent, descended, descent_from
from drkid.congruence.framework import Framework
from drkid.congruence.hop import GLOBAL, LOCAL, OF_ONE, Problem, Ranges, edges_around, hop
from drkid.congruence.score import Quality, Yardstick
from drkid.intersection import self_intersections
from drkid.mesh import Ints

EXACT = 1e-9  # largest edge error, of the mean edge, that counts as exact
LEAST_RATIO = 1.03  # between neighbouring lengths of the palette: nearer ones are one length to a hand
UNIT_ERROR, RANK_ERROR = 100.0, 1000.0  # what the largest error of a mesh that is not exact adds, to a walk and in rank
LOCAL_SHARE, FARTHEST_SHARE = 0.85, 0.35  # of the hops; of the local ones at the place of the largest distance
LOCAL_VERTICES = (7.0, 40.0)  # of a local hop
HEAT = 0.08  # first temperature of a walk, in units of the score
TRIALS = 6  # of a fold's repair, in one step of a walk
REPAIRED_FACES = 200  # from here on hops hardly ever end exactly: what they lead to is repaired
REPAIR_STEPS = 8  # of a walk, after which such a repair is given up


@dataclass(frozen=True, eq=False)
class Found:
    """A framework with its score; `exact` ones come before others, whatever their scores."""

    frame: Framework
    exact: bool
    score: float
    quality: Quality

    @property
    def rank(self) -> tuple[bool, float]:
        """For comparison, less being better: where nothing is exact, small errors count for more than to a walk."""
        return not self.exact, self.score + (RANK_ERROR - UNIT_ERROR) * (0.0 if self.exact else self.frame.worst)


@dataclass(frozen=True, eq=False)
class Walk:
    """Where a walk stands; with a `descent` it repairs folds for so many `steps` more, without one it hops."""

    found: Found
    descent: Descent | None = None
    steps: int = REPAIR_STEPS


def judged(frame: Framework, yardstick: Yardstick) -> Found:
    """A framework with what there is to say of it; it is exact only if it also cuts itself nowhere."""
    apart = bool((frame.lengths[1:] > LEAST_RATIO * frame.lengths[:-1]).all())
    exact = frame.worst < EXACT and apart and len(self_intersections(frame.mesh)) == 0
    quality = yardstick.quality(frame.mesh)
    score = yardstick.score(quality)
    return Found(frame, exact, score if exact else score + UNIT_ERROR * max(frame.worst, EXACT), quality)


def hopped(found: Found, problem: Problem, yardstick: Yardstick, rng: np.random.Generator) -> Found | None:
    """What a hop leads to; None where it broke the mesh, or is too far from exact to be looked at."""
    try:
        frame = hop(found.frame, problem, rng, *_kind(found, problem, rng))
    except np.linalg.LinAlgError:
        return None
    return judged(frame, yardstick) if UNIT_ERROR * frame.worst < found.score else None


def _kind(found: Found, problem: Problem, rng: np.random.Generator) -> tuple[Ints | None, Ranges]:
    """Which edges may change, and how hot."""
    frame, local = found.frame, rng.random() < LOCAL_SHARE
    centre, count = _centre(found, rng), int(np.exp(rng.uniform(*np.log(LOCAL_VERTICES))))
    active = edges_around(frame, centre, count) if local else None
    if len(problem.palette.multisets) == 1:
        return active, OF_ONE
    return active, LOCAL if local else GLOBAL


def _centre(found: Found, rng: np.random.Generator) -> int:
    """The vertex of a local hop: where the distance is largest, or where lengths are amiss, or anywhere."""
    frame = found.frame
    if rng.random() < FARTHEST_SHARE:
        return int(((frame.mesh.vertices - found.quality.farthest) ** 2).sum(axis=1).argmin())
    amiss = np.bincount(frame.mesh.edges.ravel(), np.repeat(frame.residual**2, 2), len(frame.mesh.vertices)) + 1e-12
    return int(rng.choice(len(amiss), p=amiss / amiss.sum()))


def stays_or_goes(old: Found, new: Found | None, temperature: float, rng: np.random.Generator) -> Found:
    """Metropolis' rule."""
    if new is None:
        return old
    better = new.score < old.score
    return new if better or rng.random() < np.exp((old.score - new.score) / temperature) else old


def walked(
    walk: Walk, problem: Problem, yardstick: Yardstick, rng: np.random.Generator, temperature: float
) -> tuple[Walk, Found | None]:
    """One step of a walk, and the mesh that it met, if any; a repair that breaks the mesh gives way to hops."""
    try:
        if walk.descent is not None:
            return _repaired(walk, walk.descent, problem, yardstick, rng, temperature)
        new = hopped(walk.found, problem, yardstick, rng)
        if new is not None and _is_worth_repair(walk.found, new, problem, yardstick):
            return Walk(walk.found, descent_from(new.frame, problem.freedom)), new
    except np.linalg.LinAlgError:
        return Walk(walk.found), None
    return Walk(stays_or_goes(walk.found, new, temperature, rng)), new


def descends(problem: Problem) -> bool:
    """Can folds be repaired: is the system square, and can labels change alone?"""
    return problem.square and len(problem.palette.multisets) > 1


def _is_worth_repair(old: Found, new: Found, problem: Problem, yardstick: Yardstick) -> bool:
    large = len(new.frame.labels) >= 3 * REPAIRED_FACES // 2
    return large and old.exact and not new.exact and descends(problem) and yardstick.score(new.quality) < old.score


def _repaired(
    walk: Walk,
    descent: Descent,
    problem: Problem,
    yardstick: Yardstick,
    rng: np.random.Generator,
    temperature: float,
) -> tuple[Walk, Found]:
    descent = descended(descent, problem.target, problem.palette, rng, TRIALS, problem.freedom)
    new = judged(descent.best, yardstick)
    if not walk.found.exact:  # the first repair: the better of the two, until one is exact
        return Walk(min(walk.found, new, key=_rank), None if descent.exact else descent), new
    if descent.exact:
        return Walk(stays_or_goes(walk.found, new, temperature, rng)), new
    return Walk(walk.found, descent if walk.steps > 1 else None, walk.steps - 1), new


def _rank(found: Found) -> tuple[bool, float]:
    return found.rank
