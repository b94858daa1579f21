"""Walks over exact meshes: hop, judge, and stay or go back (basin hopping, Wales and Doye 1997).

A walk also takes a mesh that is somewhat worse, the less likely the worse it is and the colder the round (Metropolis et
al. 1953), and one that is not quite exact: the next exact mesh may lie behind it.
"""

from dataclasses import dataclass

import numpy as np

from drkid.congruence.framework import Framework
from drkid.congruence.hop import GLOBAL, LOCAL, OF_ONE, Problem, Ranges, edges_around, hop
from drkid.congruence.score import Quality, Yardstick
from drkid.intersection import self_intersections
from drkid.mesh import Ints

EXACT = 1e-9  # largest edge error, of the mean edge, that counts as exact
LEAST_RATIO = 1.03  # between neighbouring lengths of the palette: nearer ones are one length to a hand
UNIT_ERROR = 100.0  # a mesh that is not exact is the better, the smaller its largest error
LOCAL_SHARE, FARTHEST_SHARE = 0.85, 0.35  # of the hops; of the local ones at the place of the largest distance
LOCAL_VERTICES = (7.0, 40.0)  # of a local hop
HEAT = 0.08  # first temperature of a walk, in units of the score


@dataclass(frozen=True, eq=False)
class Found:
    """A framework with its score; `exact` ones come before others, whatever their scores."""

    frame: Framework
    exact: bool
    score: float
    quality: Quality

    @property
    def rank(self) -> tuple[bool, float]:
        """For comparison, less being better."""
        return not self.exact, self.score


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
