"""One-sided repair of folds: relabelling that makes a mesh solvable where Newton's method stalls.

A mesh sits at a fold where a singular value σ of its rigidity matrix J is nearly zero: the left vector y is then nearly
a self-stress, the right one v a flex. Along such a slow mode the length equations read, to second order,

    c = σ t + S t²,   c = yᵀ(L[labels] − length),   S = Σ_e y_e (|v_ab|² − (d_e · v_ab)²) / (2 length_e),

with v_ab the difference of v at the ends of edge e and d_e its unit vector (second-order rigidity; Connelly and
Whiteley 1996). There is a solution iff σ² + 4 S c ≥ 0, an inequality: what is missing to it cannot be mended by moving,
but what is beyond it costs no more than a shift along the flex. Relabellings are priced by that for the slow modes, by
the quadratic model for all others, and taken when the true merit falls.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import combinations, product
from typing import NamedTuple

import numpy as np
from numba import njit
from scipy.linalg import cho_factor, cho_solve, eigh

from drkid.congruence.framework import Framework
from drkid.congruence.levenberg_marquardt import Freedom, solve
from drkid.congruence.palette import Palette
from drkid.congruence.rigidity import edge_vectors
from drkid.congruence.sparse_solve import (
    SparseLinearisation,
    sparse_exact,
    sparse_linearised,
    sparse_smoothness,
    sparse_solve,
)
from drkid.congruence.target import Target
from drkid.mesh import Bools, Floats, Ints, TriMesh, read_only

LEVELS = (0.02, 0.014, 0.01, 0.007, 0.005, 0.0035, 0.0025)  # weights of the shape at which exactness is approached
SLOW = 0.06  # singular values below it belong to slow modes
FAST_WEIGHT = 0.15  # of the shape, at which the quadratic model prices what the fast modes do
DAMPING = 0.02  # of the quadratic model: keeps the flexes of the slow modes, which it no longer sees, in place
TRIAL_WEIGHTS, TRIAL_ITERATIONS = (0.04,), 1  # on the way from a relabelling to its true merit
FIRST_LOOK, SETTLE_ITERATIONS = 3, 8
HOPELESS = 1.1  # a merit above so many times the present one after a first look is not followed further
MOST_DENSE = 260  # vertices up to which dense matrices are quicker, or as quick and without the lock
TRIALS = 10  # relabellings tried in vain before the weight is lowered
LEAST_GAIN = 3e-3  # of the merit, that a relabelling must bring
EXACT = 1e-9  # largest edge error, of the mean length
NOISE = 0.5  # of the prices from the second round of levels on, in their spread: else it would try the same again
KICKS, KICK = 2, 1.3  # relabellings at the beginning of those rounds, and to what multiple of the merit they may lead


class SlowModes(NamedTuple):
    """Of the s slow modes: self-stresses `stress` (E, s), σ, S, misfit c, and what offset a shift by one costs.

    `stiffness` is κ = (N v)ᵀ K (N v); all (s,).
    """

    stress: Floats
    value: Floats
    curvature: Floats
    misfit: Floats
    stiffness: Floats


class FastModel(NamedTuple):
    """Price of a change D of wanted lengths by the fast modes: Dᵀ `response` D + 2 Dᵀ `residual`, in offsets².

    The vertices answer to it by `answer` D; `answer` (3V, E).
    """

    response: Floats
    residual: Floats
    answer: Floats


@dataclass(frozen=True, eq=False)
class Relabellings:
    """Proposals: edges (n, 2), the second −1 where only one changes, and the shift of each one's label, modulo q."""

    edges: Ints
    turns: Ints


@njit(cache=True)
def mode_price(misfit: float, value: float, curvature: float, stiffness: float, weight: float) -> float:
    """What a slow mode costs, in offsets²: its shift if it can be solved, else what is missing, over weight²."""
    still = (misfit / weight) ** 2
    room = value * value + 4 * curvature * misfit
    if room >= 0:
        shift = 2 * misfit / max(value + np.sqrt(room), 1e-300)
        return min(still, stiffness * shift * shift)
    shift = -value / (2 * curvature)
    missing = (misfit - value * shift / 2) / weight
    return min(still, missing * missing + stiffness * shift * shift)


@njit(cache=True)
def modes_price(modes: SlowModes, added: Floats, weight: float) -> float:
    """Sum over the slow modes, their misfits changed by `added` (s,)."""
    total = 0.0
    for i in range(len(added)):
        misfit = modes.misfit[i] + added[i]
        total += mode_price(misfit, modes.value[i], modes.curvature[i], modes.stiffness[i], weight)
    return total


@njit(cache=True)
def _fits(faces: Ints, edge_faces: Ints, labels: Ints, allowed: Bools, pair: Ints) -> bool:
    """Are the faces of these edges allowed?"""
    for edge in pair:
        if edge < 0:
            continue
        for face in edge_faces[edge]:
            a, b, c = faces[face]
            if not allowed[labels[a], labels[b], labels[c]]:
                return False
    return True


@njit(cache=True)
def _turn(labels: Ints, pair: Ints, turns: Ints, sign: int, size: int) -> None:
    """Shift the labels of these edges, modulo the palette's size."""
    for i in range(len(pair)):
        if pair[i] >= 0:
            labels[pair[i]] = (labels[pair[i]] + sign * turns[i]) % size


@njit(cache=True)
def _price(fast: FastModel, modes: SlowModes, pair: Ints, change: Floats, weight: float) -> float:
    """Price of these edges' changes of wanted length (2,)."""
    added, total = np.zeros(len(modes.value)), 0.0
    for i in range(len(pair)):
        if pair[i] < 0:
            continue
        total += 2 * change[i] * fast.residual[pair[i]]
        for j in range(len(pair)):
            if pair[j] >= 0:
                total += change[i] * change[j] * fast.response[pair[i], pair[j]]
        for s in range(len(added)):
            added[s] += change[i] * modes.stress[pair[i], s]
    return total + modes_price(modes, added, weight)


@njit(cache=True, nogil=True)
def _prices(  # noqa: PLR0913, PLR0917 — a kernel over plain arrays
    fast: FastModel,
    modes: SlowModes,
    faces: Ints,
    edge_faces: Ints,
    labels: Ints,
    lengths: Floats,
    allowed: Bools,
    edges: Ints,
    turns: Ints,
    weight: float,
) -> Floats:
    """(n,): change of the modelled merit by each proposal, infinite where a face would not be allowed."""
    prices, change = np.full(len(edges), np.inf), np.zeros(2)
    before = modes_price(modes, np.zeros(len(modes.value)), weight)
    for n in range(len(edges)):
        pair = edges[n]
        for i in range(2):
            change[i] = -lengths[labels[pair[i]]]
        _turn(labels, pair, turns[n], int(np.int64(1)), len(lengths))
        for i in range(2):
            change[i] += lengths[labels[pair[i]]]
        if _fits(faces, edge_faces, labels, allowed, pair):
            prices[n] = _price(fast, modes, pair, change, weight) - before
        _turn(labels, pair, turns[n], int(np.int64(-1)), len(lengths))
    return prices


def relabellings(mesh: TriMesh, size: int) -> Relabellings:
    """Every change of one edge, of two in a face, and of two across an edge."""
    sides, (first, second) = mesh.face_edges, mesh.edge_faces.T
    pairs = [sides[:, [a, b]] for a, b in combinations(range(3), 2)]
    for a, b in product(range(3), repeat=2):
        across = np.stack([sides[first, a], sides[second, b]], axis=1)
        own = np.arange(len(mesh.edges))[:, None]
        pairs.append(across[(across != own).all(axis=1)])
    pair = np.unique(np.sort(np.concatenate(pairs), axis=1), axis=0)
    alone = np.stack([np.arange(len(mesh.edges)), np.full(len(mesh.edges), -1)], axis=1)
    turns = range(1, size)
    edges = [alone for _ in turns] + [pair for _ in product(turns, repeat=2)]
    shifts = [(t, 0) for t in turns] + list(product(turns, repeat=2))
    rows = [np.tile(np.array(shift, np.int64), (len(e), 1)) for e, shift in zip(edges, shifts, strict=True)]
    return Relabellings(read_only(np.concatenate(edges)), read_only(np.concatenate(rows)))


def slow_modes(frame: Framework, target: Target, at: SparseLinearisation) -> SlowModes:
    """The modes of J with singular values below `SLOW`, from the eigenvectors of J Jᵀ."""
    gram = (at.jacobian @ at.jacobian.T).toarray()
    squares, stress = eigh(gram, subset_by_value=(-1.0, SLOW**2), check_finite=False)
    value = np.sqrt(np.maximum(squares, 1e-18))
    flex = (at.jacobian.T @ stress) / value
    direction, length = edge_vectors(frame.mesh.vertices, frame.mesh.edges)
    points = flex.reshape(len(frame.mesh.vertices), 3, len(value))
    apart = points[frame.mesh.edges[:, 1]] - points[frame.mesh.edges[:, 0]]
    along = np.einsum("er,ers->es", direction, apart)
    bending = (np.einsum("ers,ers->es", apart, apart) - along**2) / (2 * length[:, None])
    _, normals = target.offsets(frame.mesh.vertices)
    offset = np.einsum("vr,vrs->vs", normals, points)
    return SlowModes(
        np.ascontiguousarray(stress),
        value,
        np.einsum("es,es->s", stress, bending),
        -(stress.T @ frame.residual),
        np.einsum("vs,vs->s", offset, sparse_smoothness(frame.mesh) @ offset),
    )


def fast_model(frame: Framework, at: SparseLinearisation, modes: SlowModes, weight: float) -> FastModel:
    """The quadratic model at a framework linearised at this weight, with the slow modes projected out of J.

    Raises:
        numpy.linalg.LinAlgError: the mesh is degenerate.
    """
    stress = modes.stress
    pulled = at.jacobian.T @ stress
    hessian = at.hessian.toarray() - pulled @ pulled.T
    hessian[np.diag_indices_from(hessian)] += DAMPING**2
    factor = cho_factor(hessian, lower=True, overwrite_a=True, check_finite=False)
    jacobian = at.jacobian.toarray() - stress @ pulled.T
    gradient = at.gradient - pulled @ (stress.T @ frame.residual)
    both = cho_solve(factor, np.column_stack([jacobian.T, gradient]), check_finite=False)
    misfit = -frame.residual + stress @ (stress.T @ frame.residual)
    response = np.eye(len(frame.labels)) - stress @ stress.T - jacobian @ both[:, :-1]
    residual = misfit + jacobian @ both[:, -1]
    return FastModel(np.ascontiguousarray(response) / weight**2, residual / weight**2, both[:, :-1].copy())


@dataclass(frozen=True, eq=False)
class Repair:
    """What stays the same while folds of one connectivity are repaired; `counted` is told of each trial."""

    target: Target
    palette: Palette
    freedom: Freedom
    moves: Relabellings
    counted: Callable[[], object]

    def priced(self, frame: Framework, weight: float) -> tuple[Floats, Floats]:
        """(n,): the modelled change of merit / weight² by each relabelling; and the fast model's `answer`."""
        stiffness = sparse_smoothness(frame.mesh)
        at = sparse_linearised(frame, self.target, FAST_WEIGHT, stiffness)
        modes = slow_modes(frame, self.target, at)
        fast = fast_model(frame, at, modes, FAST_WEIGHT)
        net = (frame.mesh.face_edges, frame.mesh.edge_faces, frame.labels.copy(), frame.lengths)
        prices = _prices(
            fast, modes, *net, self.palette.allowed, np.array(self.moves.edges), np.array(self.moves.turns), weight
        )
        return prices, fast.answer

    def relabelled(self, frame: Framework, move: int, answer: Floats) -> Framework:
        """The framework with one relabelling done, its vertices where the fast modes take them."""
        labels = frame.labels.copy()
        _turn(labels, np.array(self.moves.edges[move]), np.array(self.moves.turns[move]), 1, self.palette.size)
        edges = self.moves.edges[move][self.moves.edges[move] >= 0]
        shift = answer[:, edges] @ (frame.lengths[labels[edges]] - frame.wanted[edges])
        moved = frame.moved(frame.mesh.vertices + shift.reshape(-1, 3), frame.lengths)
        return replace(moved, labels=labels)

    def settled(self, frame: Framework, weight: float) -> tuple[Framework, float]:
        """The soft optimum at a weight, and its merit."""
        return self.solved(frame, weight, SETTLE_ITERATIONS)

    def solved(self, frame: Framework, weight: float, iterations: int) -> tuple[Framework, float]:
        """At most so many iterations of Levenberg–Marquardt."""
        solver = solve if len(frame.mesh.vertices) <= MOST_DENSE else sparse_solve
        return solver(frame, self.target, weight, self.freedom, iterations)

    def tried(self, other: Framework, merit: float, weight: float) -> tuple[Framework, float]:
        """The soft optimum of a relabelled framework; infinite merit where it breaks the mesh."""
        try:
            for step in TRIAL_WEIGHTS:
                other, _ = self.solved(other, step, TRIAL_ITERATIONS)
            other, value = self.solved(other, weight, FIRST_LOOK)
            return self.settled(other, weight) if value < HOPELESS * merit else (other, value)
        except np.linalg.LinAlgError:  # a refused move, like any that raises the merit
            return other, np.inf

    def improved(
        self, frame: Framework, merit: float, weight: float, heat: float, rng: np.random.Generator
    ) -> tuple[Framework, float] | None:
        """The first of the cheapest relabellings whose true merit falls below `LEAST_GAIN` under `merit`, or None."""
        prices, answer = self.priced(frame, weight)
        spread = float(np.abs(np.partition(prices, TRIALS)[:TRIALS]).mean())
        noisy = prices + heat * spread * rng.standard_normal(len(prices))
        for move in np.argsort(noisy)[:TRIALS].tolist():
            if not np.isfinite(prices[move]):
                return None
            self.counted()
            other, value = self.tried(self.relabelled(frame, move, answer), merit, weight)
            if value < (1 - LEAST_GAIN) * merit:
                return other, value
        return None


@dataclass(frozen=True, eq=False)
class Descent:
    """Where a repair stands: a soft framework at one of `LEVELS`, and the most exact one met, which is what counts.

    `heat` is the noise on the prices, `kicks` how many relabellings may make it worse first.
    """

    frame: Framework
    best: Framework
    level: int = 0
    heat: float = 0.0
    kicks: int = 0

    @property
    def exact(self) -> bool:
        """Has an exact framework been met?"""
        return self.best.worst < EXACT


def descent_from(frame: Framework, freedom: Freedom = "all") -> Descent:
    """The beginning of a repair; never less exact than Newton's method makes what came.

    Raises:
        numpy.linalg.LinAlgError: the mesh is degenerate from the start.
    """
    return Descent(frame, min(frame, sparse_exact(frame, freedom), key=lambda one: one.worst))


def descended(
    descent: Descent,
    target: Target,
    palette: Palette,
    rng: np.random.Generator,
    trials: int,
    freedom: Freedom = "all",
) -> Descent:
    """Relabel at one level after the other until the mesh is exact or the trials are used up; then it can go on.

    It ends where a relabelling was taken or a level is done, so after a few trials more. From the second round of
    levels on the prices are noisy and it starts with kicks: it would try the same again otherwise.

    Raises:
        numpy.linalg.LinAlgError: the mesh has become degenerate.
    """
    left = Trials(trials)
    task = Repair(target, palette, freedom, relabellings(descent.frame.mesh, palette.size), left.count)
    while not descent.exact and left.number > 0:
        descent = _relabelled_at(task, descent, left, rng)
        solved = sparse_exact(descent.frame, freedom)
        descent = replace(descent, best=min(descent.best, solved, key=lambda one: one.worst))
    return descent


@dataclass
class Trials:
    """How many are left."""

    number: int

    def count(self) -> None:
        """One less."""
        self.number -= 1


def _relabelled_at(task: Repair, descent: Descent, left: Trials, rng: np.random.Generator) -> Descent:
    """Relabelled at the descent's level until nothing tried helps, then on to the next; or cut short."""
    weight, kicks = LEVELS[descent.level], descent.kicks
    frame, merit = task.settled(descent.frame, weight)
    while left.number > 0:
        found = task.improved(frame, KICK * merit if kicks > 0 else merit, weight, descent.heat, rng)
        kicks = max(kicks - 1, 0)
        if found is None:
            return _next_level(replace(descent, frame=frame))
        frame, merit = found
    return replace(descent, frame=frame, kicks=kicks)


def _next_level(descent: Descent) -> Descent:
    if descent.level + 1 < len(LEVELS):
        return replace(descent, level=descent.level + 1, kicks=0)
    return replace(descent, level=0, heat=NOISE, kicks=KICKS)
