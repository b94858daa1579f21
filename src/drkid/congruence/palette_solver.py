"""The palette solver: few edge lengths, labelled, annealed and solved until every edge has its length exactly.

Works in units of M_s's mean edge. First some short starts; from the best of them walks set out, which repair folds and
hop until a mesh is exact, then hop, and now and then gather at the best mesh so far. Large meshes are not made exact:
they are annealed patch by patch, and no face is off by more than a tolerance. What a round does depends on the seed and
its number alone, so that the same rounds make the same kit anywhere; the clock only decides how many there are.
"""

import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import TypeVar

import numpy as np
import trimesh
from threadpoolctl import threadpool_limits

from drkid.congruence.basin_hopping import HEAT, Found, Walk, descends, judged, walked
from drkid.congruence.block_anneal import (
    HOP_BLOCKS,
    ROUNDS,
    START_BLOCKS,
    TOLERANCE,
    sparse_exactly,
    sparse_hop,
    sparse_round,
)
from drkid.congruence.fold import Descent, descended
from drkid.congruence.framework import Framework
from drkid.congruence.given_palette import palette_of
from drkid.congruence.hop import Problem, exactly, start
from drkid.congruence.labelling import first_labels
from drkid.congruence.levenberg_marquardt import Freedom
from drkid.congruence.palette import Palette, palette_of_classes
from drkid.congruence.score import Yardstick
from drkid.congruence.solver import Candidate
from drkid.congruence.target import Target
from drkid.congruence.triangle_space import ascending_lengths, clustering_error
from drkid.kit import Convergence, Outcome
from drkid.mesh import TriMesh, read_only
from drkid.spec import DEFAULT_FACES, MOST_WALKED_FACES, KitSpec

START_RATIOS = (1.17, 1.15, 1.19)  # of two lengths, tried in turn
FIRST_STARTS, STARTS, WALKS = 2, 8, 4  # the first starts give an answer at once, the others are the first round
MANY_FACES, FEW_WALKS = 300, 2  # repairs take long there, and two finish sooner than four
ROUNDS_PER_GATHERING = 15  # of the walks at the best mesh so far; until then they grow colder
UNDER_TOLERANCE = 0.9  # what is aimed at, of the tolerance asked for
LEAST_SECONDS, MOST_SECONDS = 10.0, 60.0  # for small meshes, and for those of 500 faces
SECONDS_OF_LARGE = 0.03  # a face
ALMOST = 0.99  # of a search that time would end before its start is finished
R = TypeVar("R")


@dataclass(frozen=True, eq=False)
class PaletteState:
    """The best mesh so far, where the search stands, and what the rounds have told."""

    scale: float
    problem: Problem
    yardstick: Yardstick
    found: Found
    walks: tuple[Walk, ...]
    round: int
    began: float
    history: tuple[Convergence, ...]
    round_seconds: float = 0.0

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
        """The starts, in parallel, and the best of them; of a large mesh no more than first labels.

        Raises:
            SpecError: too many classes, or no labelling of this mesh has only allowed triangles.
        """
        scale, large = mesh.mean_edge, _is_large(mesh)
        unit = mesh.scaled(1 / scale)
        _compile()
        began = time.monotonic()
        with threadpool_limits(1):
            palette = palette_of(self.spec, unit, np.random.default_rng([self.spec.seed, 0, STARTS]), large=large)
        free: Freedom = "scale" if palette.held else "all"
        target = Target(self.surface.scaled(1 / scale))
        problem = Problem(target, palette, free if mesh.genus == 0 else "none", mesh.genus == 0)
        yardstick = Yardstick(unit, self.spec)
        with threadpool_limits(1):
            walks = self._begun(range(1 if large else FIRST_STARTS), problem, yardstick)
        state = PaletteState(scale, problem, yardstick, walks[0].found, walks, 0, began, ())
        return replace(state, history=(_recorded(state),))

    def _begun(self, numbers: range, problem: Problem, yardstick: Yardstick) -> tuple[Walk, ...]:
        """Starts of these numbers, the best first, each with a repair where that is to follow."""
        unit = yardstick.reference

        def begin(number: int) -> Walk:
            rng = np.random.default_rng([self.spec.seed, 0, number])
            first = first_frame(unit, problem.palette, number, rng)
            if _is_large(unit):
                return Walk(judged(first, yardstick))
            soft = start(first, problem, rng)
            found = judged(exactly(soft, problem), yardstick)
            return Walk(found, Descent(soft, found.frame) if descends(problem) else None)

        return tuple(sorted(_in_parallel([lambda n=n: begin(n) for n in numbers]), key=_rank_of_walk))

    def step(self, state: PaletteState) -> PaletteState:
        """One round: the other starts or a step of each walk, or a weight or a hop of a large mesh."""
        began = time.monotonic()
        with threadpool_limits(1):
            after = self._large_step(state) if _is_large(state.found.frame.mesh) else self._walked(state)
        after = replace(after, round=state.round + 1, round_seconds=time.monotonic() - began)
        return replace(after, history=(_recorded(after),))

    def _walked(self, state: PaletteState) -> PaletteState:
        if state.round == 0:
            more = self._begun(range(FIRST_STARTS, STARTS), state.problem, state.yardstick)
            count = FEW_WALKS if len(state.found.frame.mesh.faces) > MANY_FACES else WALKS
            walks = tuple(sorted((*state.walks, *more), key=_rank_of_walk)[:count])
            return replace(state, found=walks[0].found, walks=walks)
        phase = state.round % ROUNDS_PER_GATHERING
        gathers = state.found.exact and phase == 0
        walks = tuple(Walk(state.found) for _ in state.walks) if gathers else state.walks
        temperature = HEAT * (1 - phase / ROUNDS_PER_GATHERING)

        def step(number: int) -> tuple[Walk, Found | None]:
            rng = np.random.default_rng([self.spec.seed, state.round + 1, number])
            return walked(walks[number], state.problem, state.yardstick, rng, temperature)

        results = _in_parallel([lambda n=n: step(n) for n in range(len(walks))])
        met = [new for _, new in results if new is not None]
        found = min([state.found, *met], key=_rank)
        if found.exact and not state.found.exact:  # the first one: all go on from there
            return replace(state, found=found, walks=(Walk(found),) * len(walks))
        return replace(state, found=found, walks=tuple(walk for walk, _ in results))

    def _large_step(self, state: PaletteState) -> PaletteState:
        """A weight of the start, the last with the true solve; afterwards hops, of which better ones stay."""
        rng, problem, workers = (
            np.random.default_rng([self.spec.seed, state.round + 1]),
            state.problem,
            os.cpu_count() or 1,
        )
        target, palette, freedom, frame = problem.target, problem.palette, problem.freedom, state.walks[0].found.frame
        if state.round < ROUNDS:
            blocks = replace(START_BLOCKS, workers=workers)
            frame = sparse_round(frame, state.round, target, palette, freedom, rng, blocks)
        else:
            blocks = replace(HOP_BLOCKS, workers=workers)
            frame = sparse_hop(frame, target, palette, freedom, rng, blocks)
        if state.round >= ROUNDS - 1:
            wanted = UNDER_TOLERANCE / 100 * self.spec.tolerance_for(len(frame.mesh.faces))
            square = problem.square and state.round < ROUNDS
            frame = sparse_exactly(frame, target, freedom, square=square, tolerance=min(TOLERANCE, wanted))
        found = judged(frame, state.yardstick)
        if state.round >= ROUNDS:
            found = min(found, state.found, key=_rank)
        return replace(state, found=found, walks=(Walk(found),))

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
        status = "converged" if percent <= self.spec.tolerance_for(len(state.best.mesh.faces)) else "stalled"
        remedy = "more --seconds or --classes may help"
        if genus := state.best.mesh.genus:
            remedy += f", though a surface of genus {genus} has {6 * genus} lengths more than freedoms"
        return Outcome(status, f"not exact: largest error {percent:.3g} % {after}; {remedy}")

    def told(self, state: PaletteState) -> str:
        """Exact or not, T, d_H and the 95th percentile of the dihedrals."""
        quality = state.found.quality
        word = "exact" if state.found.exact else f"T {state.best.percent:.2g} %"
        return (
            f"round {state.round}: {word}, d_H {quality.mean_percent:.2f}/{quality.max_percent:.1f} %, "
            f"dihedral p95 {quality.p95_degrees:.0f}°"
        )

    def fraction(self, state: PaletteState) -> float:
        """Rounds or seconds used, of those given; the start of a large mesh is always finished.

        A hop of a large mesh is not begun where one as long as the last round would end too late.
        """
        large = _is_large(state.found.frame.mesh)
        started = state.round / ROUNDS if large else 1.0
        if self.spec.rounds is not None:
            used = state.round / self.spec.rounds if self.spec.rounds else 1.0
        else:
            seconds = self.spec.seconds or default_seconds(len(state.found.frame.mesh.faces))
            used = (time.monotonic() - state.began + (state.round_seconds if large else 0.0)) / seconds
        return used if started >= 1 else min(max(used, started), ALMOST)


@cache
def _compile() -> None:
    """Compile, or load what is compiled, before the clock runs: the first search ever is then no worse."""
    ball = trimesh.creation.icosahedron()
    mesh = TriMesh(np.asarray(ball.vertices, np.float64), np.asarray(ball.faces, np.int64))
    problem = Problem(Target(mesh), palette_of_classes(2), "all", square=True)
    rng = np.random.default_rng(0)
    with threadpool_limits(1):
        soft = start(first_frame(mesh, problem.palette, 0, rng), problem, rng)
        descended(Descent(soft, soft), problem.target, problem.palette, rng, 1)
        judged(exactly(soft, problem), Yardstick(mesh, KitSpec()))


def default_seconds(faces: int) -> float:
    """Time for a mesh of so many faces where none is given."""
    share = np.clip((faces - DEFAULT_FACES) / (500 - DEFAULT_FACES), 0, 1)
    return max(LEAST_SECONDS + share * (MOST_SECONDS - LEAST_SECONDS), SECONDS_OF_LARGE * faces)


def _is_large(mesh: TriMesh) -> bool:
    return len(mesh.faces) > MOST_WALKED_FACES


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


def _rank(found: Found) -> tuple[bool, float]:
    return found.rank


def _rank_of_walk(walk: Walk) -> tuple[bool, float]:
    return walk.found.rank


def _recorded(state: PaletteState) -> Convergence:
    best = state.best
    error = clustering_error(ascending_lengths(best.mesh), best.face_class, best.class_lengths)
    percent = 100 / best.mesh.mean_edge
    return Convergence(state.round, error.energy, error.maximum * percent, error.mean * percent)


def _in_parallel(tasks: Sequence[Callable[[], R]]) -> list[R]:
    """Results in the order of the tasks, whatever the number of processors."""
    with ThreadPoolExecutor(min(len(tasks), os.cpu_count() or 1)) as pool:
        return [future.result() for future in [pool.submit(task) for task in tasks]]
