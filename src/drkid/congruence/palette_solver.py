"""The palette solver: few edge lengths, labelled, annealed and solved until every edge has its length exactly.

Works in units of M_s's mean edge. First a few starts; from the best of them walks set out, which now and then gather at
the best mesh so far. While none is exact they repair folds between hops. What a round does depends on the seed and its
number alone, so that the same rounds make the same kit anywhere; the clock only decides how many there are.
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

from drkid.congruence.basin_hopping import HEAT, Found, hopped, judged, stays_or_goes
from drkid.congruence.block_anneal import sparse_exactly, sparse_start
from drkid.congruence.fold import repair
from drkid.congruence.framework import Framework
from drkid.congruence.given_palette import palette_of
from drkid.congruence.hop import Problem, exactly, start
from drkid.congruence.labelling import first_labels
from drkid.congruence.levenberg_marquardt import Freedom
from drkid.congruence.palette import Palette
from drkid.congruence.score import Yardstick
from drkid.congruence.solver import Candidate
from drkid.congruence.target import Target
from drkid.congruence.triangle_space import ascending_lengths, clustering_error
from drkid.kit import Convergence, Outcome
from drkid.mesh import TriMesh, read_only
from drkid.spec import KitSpec

START_RATIOS = (1.17, 1.15, 1.19)  # of two lengths, tried in turn
STARTS, WALKS = 6, 4
ROUNDS_PER_GATHERING = 30  # of the walks at the best mesh so far; until then they grow colder
MOST_DENSE_FACES = 800  # beyond, the dense model takes too long: patches and sparse solves, and no hops
SECONDS_PER_FACE = 0.06
MOST_TRIALS = 120  # of a fold's repair in one round
R = TypeVar("R")


@dataclass
class Trials:
    """Counts what a repair asks before each trial: the work of a round is then the same on any machine."""

    count: int = 0

    def __call__(self) -> bool:
        """Whether the trials of this round are used up."""
        self.count += 1
        return self.count > MOST_TRIALS


@dataclass(frozen=True, eq=False)
class PaletteState:
    """The best mesh so far, where the search stands, and what the rounds have told."""

    scale: float
    problem: Problem
    yardstick: Yardstick
    found: Found
    walks: tuple[Found, ...]
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
        return Candidate(mesh, read_only(face_class), read_only(lengths), error, frame.lengths * self.scale)


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
            palette = palette_of(self.spec, unit, np.random.default_rng([self.spec.seed, 0, STARTS]), large=large)
        free: Freedom = "scale" if palette.held else "all"
        problem = Problem(
            Target(self.surface.scaled(1 / scale)),
            palette,
            free if mesh.genus == 0 else "none",
            mesh.genus == 0,
        )
        yardstick = Yardstick(unit, self.spec)

        def begin(number: int) -> Found:
            rng = np.random.default_rng([self.spec.seed, 0, number])
            first = first_frame(unit, problem.palette, number, rng)
            if large:
                return _large_start(first, problem, yardstick, rng)
            return judged(exactly(start(first, problem, rng), problem), yardstick)

        with threadpool_limits(1):
            results = _in_parallel([lambda n=n: begin(n) for n in range(1 if large else STARTS)])
        walks = sorted(results, key=_rank)[:WALKS]
        walks += walks[: WALKS - len(walks)]
        state = PaletteState(scale, problem, yardstick, walks[0], tuple(walks), 0, began, ())
        return replace(state, history=(_recorded(state),))

    def step(self, state: PaletteState) -> PaletteState:
        """One round: a hop, or the repair of a fold, in each walk; the walks gather at the best mesh now and then."""
        phase = state.round % ROUNDS_PER_GATHERING
        gathers = phase == 0 and state.round > 0 and state.found.exact
        walks = (state.found,) * WALKS if gathers else state.walks

        def walk(number: int) -> tuple[Found, Found | None]:
            rng = np.random.default_rng([self.spec.seed, state.round + 1, number])
            old = walks[number]
            if not state.found.exact and (number + state.round) % 2 == 0:
                new = _repaired(old, state, rng)
            else:
                new = hopped(old, state.problem, state.yardstick, rng)
            return stays_or_goes(old, new, HEAT * (1 - phase / ROUNDS_PER_GATHERING), rng), new

        with threadpool_limits(1):
            results = _in_parallel([lambda n=n: walk(n) for n in range(WALKS)])
        best = min([state.found, *(new for _, new in results if new is not None)], key=_rank)
        state = replace(state, found=best, walks=tuple(stays for stays, _ in results), round=state.round + 1)
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
    if palette.size == 2 and len(palette.multisets) > 1 and not palette.held:
        palette = replace(palette, ratios=(1.0, START_RATIOS[number % len(START_RATIOS)]))
    ratios = np.array(palette.ratios)
    labels = first_labels(mesh, palette, ratios * float(mesh.mean_edge / ratios.mean()), rng)
    return Framework(mesh, labels, palette.lengths(mesh.mean_edge, labels))


def _large_start(first: Framework, problem: Problem, yardstick: Yardstick, rng: np.random.Generator) -> Found:
    """A mesh too large for the dense model: annealed by patches, solved sparsely."""
    workers = os.cpu_count() or 1
    soft = sparse_start(first, problem.target, problem.palette, problem.freedom, rng, workers=workers)
    return judged(sparse_exactly(soft, problem.target, problem.freedom, square=problem.square), yardstick)


def _repaired(found: Found, state: PaletteState, rng: np.random.Generator) -> Found | None:
    """One walk's mesh with some of its folds repaired; None where that broke it."""
    problem = state.problem
    try:
        frame = repair(found.frame, problem.target, problem.palette, rng, Trials(), problem.freedom)
    except np.linalg.LinAlgError:
        return None
    return judged(frame, state.yardstick)


def _rank(found: Found) -> tuple[bool, float]:
    return found.rank


def _recorded(state: PaletteState) -> Convergence:
    best = state.best
    error = clustering_error(ascending_lengths(best.mesh), best.face_class, best.class_lengths)
    percent = 100 / best.mesh.mean_edge
    return Convergence(state.round, error.energy, error.maximum * percent, error.mean * percent)


def _in_parallel(tasks: Sequence[Callable[[], R]]) -> list[R]:
    """Results in the order of the tasks, whatever the number of processors."""
    with ThreadPoolExecutor(min(len(tasks), os.cpu_count() or 1)) as pool:
        return [future.result() for future in [pool.submit(task) for task in tasks]]
