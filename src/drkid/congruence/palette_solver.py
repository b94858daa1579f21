"""The palette solver: few edge lengths, labelled, annealed and solved until every edge has its length exactly.

Works in units of M_s's mean edge. First a few starts, of which the best is kept, then rounds of hops from the best mesh
so far. The work of a round depends on the seed and its number alone, so that the same rounds make the same kit on any
machine; the clock only decides how many there are.
"""

import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar

import numpy as np
from threadpoolctl import threadpool_limits

from drkid.congruence.block_anneal import sparse_exactly, sparse_start
from drkid.congruence.framework import Framework
from drkid.congruence.hop import Problem, edges_around, exactly, hop, start
from drkid.congruence.labelling import first_labels
from drkid.congruence.palette import Palette, palette_of_classes
from drkid.congruence.palette_subset import palette_for
from drkid.congruence.score import Quality, Yardstick
from drkid.congruence.solver import Candidate
from drkid.congruence.target import Target
from drkid.congruence.triangle_space import ascending_lengths, clustering_error
from drkid.intersection import self_intersections
from drkid.kit import Convergence, Outcome
from drkid.mesh import Ints, TriMesh, read_only
from drkid.spec import KitSpec

EXACT = 1e-9  # largest edge error, of the mean edge, that counts as exact
START_RATIOS = (1.17, 1.15, 1.19)  # of two lengths, tried in turn
STARTS, TASKS_PER_ROUND = 6, 4
MOST_DENSE_FACES = 800  # beyond, the dense model takes too long: patches and sparse solves, and no hops
LEAST_RATIO = 1.03  # between neighbouring lengths of the palette: nearer ones are one length to a hand
UNIT_ERROR = 100.0  # a mesh that is not exact is the better, the smaller its largest error
WANDER = 0.7  # chance to go on from a hop that was not exact, while nothing is
SECONDS_PER_FACE = 0.06
LOCAL_SHARE = 0.3  # of the hops
R = TypeVar("R")


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


@dataclass(frozen=True, eq=False)
class PaletteState:
    """The best mesh so far, where the search stands, and what the rounds have told."""

    scale: float
    problem: Problem
    yardstick: Yardstick
    found: Found
    standing: tuple[Framework, ...]
    round: int
    began: float
    history: tuple[Convergence, ...]

    @property
    def large(self) -> bool:
        """Too large for the dense model, and so for hops."""
        return len(self.found.frame.mesh.faces) > MOST_DENSE_FACES

    @property
    def iteration(self) -> int:
        """Rounds done."""
        return self.round

    @property
    def best(self) -> Candidate:
        """The best mesh in the unit that M_s came in, with its classes."""
        return self._best

    @cached_property
    def _best(self) -> Candidate:
        frame = self.found.frame
        mesh = frame.mesh.scaled(self.scale)
        face_class = self.problem.palette.class_of(frame.labels[frame.mesh.face_edges])
        lengths = np.array([[frame.lengths[i] for i in m] for m in self.problem.palette.multisets]) * self.scale
        error = clustering_error(ascending_lengths(mesh), face_class, lengths).maximum
        return Candidate(mesh, read_only(face_class), read_only(lengths), error)


@dataclass(frozen=True)
class PaletteSolver:
    """Solver of the protocol `congruence.solver.Solver`; `surface` is M_i, the target."""

    spec: KitSpec
    surface: TriMesh

    def init(self, mesh: TriMesh) -> PaletteState:
        """The starts, in parallel, and the best of them.

        Raises:
            SpecError: too many classes, or no labelling of this mesh has only allowed triangles.
        """
        began, scale = time.monotonic(), mesh.mean_edge
        unit = mesh.scaled(1 / scale)
        large = len(mesh.faces) > MOST_DENSE_FACES
        with threadpool_limits(1):
            palette = self._palette(unit, large)
        problem = Problem(
            Target(self.surface.scaled(1 / scale)),
            palette,
            "all" if mesh.genus == 0 else "none",
            mesh.genus == 0,
        )
        yardstick = Yardstick(unit, self.spec)

        def begin(number: int) -> tuple[Framework, Found]:
            rng = np.random.default_rng([self.spec.seed, 0, number])
            first = first_frame(unit, problem.palette, number, rng)
            if large:
                return _large_start(first, problem, yardstick, rng)
            soft = start(first, problem, rng)
            return soft, _judged(exactly(soft, problem), yardstick)

        with threadpool_limits(1):
            results = _in_parallel([lambda n=n: begin(n) for n in range(1 if large else STARTS)])
        softs = sorted(results, key=_rank_of_start)
        best = softs[0][1]
        state = PaletteState(
            scale, problem, yardstick, best, tuple(soft for soft, _ in softs[:TASKS_PER_ROUND]), 0, began, ()
        )
        return replace(state, history=(_recorded(state),))

    def _palette(self, unit: TriMesh, large: bool) -> Palette:
        if large:
            return palette_of_classes(self.spec.classes)
        return palette_for(unit, self.spec.classes, np.random.default_rng([self.spec.seed, 0, STARTS]))

    def step(self, state: PaletteState) -> PaletteState:
        """One round: hops from the best exact mesh, or from where each search stands while none is exact."""
        standing = (state.found.frame,) * TASKS_PER_ROUND if state.found.exact else state.standing

        def leap(number: int) -> Found:
            rng = np.random.default_rng([self.spec.seed, state.round + 1, number])
            frame = standing[number % len(standing)]
            active = _somewhere(frame, rng) if rng.random() < LOCAL_SHARE else None
            try:
                return _judged(hop(frame, state.problem, rng, active), state.yardstick)
            except np.linalg.LinAlgError:  # this hop broke the mesh: it is not taken
                return replace(state.found, frame=frame, exact=False, score=np.inf)

        with threadpool_limits(1):
            results = _in_parallel([lambda n=n: leap(n) for n in range(TASKS_PER_ROUND)])
        best = min([state.found, *results], key=_rank)
        rng = np.random.default_rng([self.spec.seed, state.round + 1, TASKS_PER_ROUND])
        wandered = tuple(
            found.frame if np.isfinite(found.score) and rng.random() < WANDER else old
            for old, found in zip(standing, results, strict=False)
        )
        state = replace(state, found=best, standing=wandered, round=state.round + 1)
        return replace(state, history=(_recorded(state),))

    def finished(self, state: PaletteState) -> Outcome | None:
        """When the rounds or the seconds are used up."""
        return None if self.fraction(state) < 1 else self._outcome(state, "")

    def interrupted(self, state: PaletteState) -> Outcome:
        """The best so far is an answer at any time."""
        return self._outcome(state, ", ended by hand")

    def _outcome(self, state: PaletteState, why: str) -> Outcome:
        percent = state.best.percent
        after = f"after {state.round} rounds in {time.monotonic() - state.began:.1f} s{why}"
        if state.found.exact:
            return Outcome("converged", f"exact: largest error {percent:.1g} % {after}")
        status = "converged" if percent <= self.spec.tolerance_percent else "stalled"
        more = "--classes" if state.large else "--seconds or --classes"
        return Outcome(status, f"not exact: largest error {percent:.3g} % {after}; more {more} may help")

    def told(self, state: PaletteState) -> str:
        """Exact or not, T, d_H and the 95th percentile of the dihedrals."""
        quality = state.found.quality
        word = "exact" if state.found.exact else f"T {state.best.percent:.2g} %"
        return (
            f"round {state.round}: {word}, d_H {quality.mean_percent:.2f}/{quality.max_percent:.1f} %, "
            f"dihedral p95 {quality.p95_degrees:.0f}°"
        )

    def fraction(self, state: PaletteState) -> float:
        """Rounds or seconds used, of those given; a large mesh is not hopped on."""
        if state.large:
            return 1.0
        if self.spec.rounds is not None:
            return state.round / self.spec.rounds
        seconds = self.spec.seconds or max(10.0, SECONDS_PER_FACE * len(state.best.mesh.faces))
        return (time.monotonic() - state.began) / seconds


def first_frame(mesh: TriMesh, palette: Palette, number: int, rng: np.random.Generator) -> Framework:
    """First labels, with lengths of the palette's ratios that keep the mean edge.

    Raises:
        SpecError: no labelling of this mesh has only allowed triangles.
    """
    if palette.size == 2 and len(palette.multisets) > 1:
        palette = replace(palette, ratios=(1.0, START_RATIOS[number % len(START_RATIOS)]))
    ratios = np.array(palette.ratios)
    labels = first_labels(mesh, palette, ratios * float(mesh.mean_edge / ratios.mean()), rng)
    return Framework(mesh, labels, palette.lengths(mesh.mean_edge, labels))


def _large_start(
    first: Framework, problem: Problem, yardstick: Yardstick, rng: np.random.Generator
) -> tuple[Framework, Found]:
    """A mesh too large for the dense model: annealed by patches, solved sparsely."""
    workers = os.cpu_count() or 1
    soft = sparse_start(first, problem.target, problem.palette, problem.freedom, rng, workers=workers)
    return soft, _judged(sparse_exactly(soft, problem.target, problem.freedom, square=problem.square), yardstick)


def _rank(found: Found) -> tuple[bool, float]:
    return found.rank


def _rank_of_start(pair: tuple[Framework, Found]) -> tuple[bool, float]:
    return pair[1].rank


def _judged(frame: Framework, yardstick: Yardstick) -> Found:
    apart = bool((frame.lengths[1:] > LEAST_RATIO * frame.lengths[:-1]).all())
    exact = frame.worst < EXACT and apart and len(self_intersections(frame.mesh)) == 0
    quality = yardstick.quality(frame.mesh)
    score = yardstick.score(quality)
    return Found(frame, exact, score if exact else score + UNIT_ERROR * frame.worst, quality)


def _somewhere(frame: Framework, rng: np.random.Generator) -> Ints:
    """Edges around a vertex, drawn by how much is amiss there."""
    amiss = np.bincount(frame.mesh.edges.ravel(), np.repeat(frame.residual**2, 2), len(frame.mesh.vertices)) + 1e-12
    return edges_around(frame, int(rng.choice(len(amiss), p=amiss / amiss.sum())))


def _recorded(state: PaletteState) -> Convergence:
    best = state.best
    error = clustering_error(ascending_lengths(best.mesh), best.face_class, best.class_lengths)
    percent = 100 / best.mesh.mean_edge
    return Convergence(state.round, error.energy, error.maximum * percent, error.mean * percent)


def _in_parallel(tasks: Sequence[Callable[[], R]]) -> list[R]:
    """Results in the order of the tasks, whatever the number of processors."""
    with ThreadPoolExecutor(min(len(tasks), os.cpu_count() or 1)) as pool:
        return [future.result() for future in [pool.submit(task) for task in tasks]]
