"""The protocol that every solver follows, and the one driver that runs any of them."""

from dataclasses import dataclass
from typing import Protocol, TypeVar

from drkid.kit import Convergence, Outcome
from drkid.mesh import Floats, Ints, TriMesh
from drkid.progress import Progress


@dataclass(frozen=True, eq=False)
class Candidate:
    """A mesh with its classes: `face_class` (F,) into `class_lengths` (k, 3); `error` is the largest, a length."""

    mesh: TriMesh
    face_class: Ints
    class_lengths: Floats
    error: float


class State(Protocol):
    """What a solver carries from step to step."""

    @property
    def iteration(self) -> int:
        """Iterations done so far."""
        ...

    @property
    def best(self) -> Candidate:
        """The best candidate so far."""
        ...

    @property
    def history(self) -> tuple[Convergence, ...]:
        """What was recorded since the step before."""
        ...


S = TypeVar("S", bound=State)


class Solver(Protocol[S]):
    """A small object with `init`, `step` and `finished`; the loop is the driver's."""

    def init(self, mesh: TriMesh) -> S:
        """The state before the first step."""
        ...

    def step(self, state: S) -> S:
        """The state after one step, which may be many iterations."""
        ...

    def finished(self, state: S) -> Outcome | None:
        """Why to stop, or None to go on."""
        ...

    def fraction(self, state: S) -> float:
        """How far the solver is, in [0, 1], for a progress bar."""
        ...


@dataclass(frozen=True, eq=False)
class Solution:
    """The best candidate, why the solver stopped, after how many iterations, and what was recorded on the way."""

    best: Candidate
    outcome: Outcome
    iterations: int
    convergence: tuple[Convergence, ...]


def run(solver: Solver[S], mesh: TriMesh, progress: Progress) -> Solution:
    """Step until the solver is finished; an interruption of the process passes through."""
    state = solver.init(mesh)
    convergence = list(state.history)
    while (outcome := solver.finished(state)) is None:
        state = solver.step(state)
        convergence.extend(state.history)
        percent = 100 * state.best.error / state.best.mesh.mean_edge
        progress(f"iteration {state.iteration}, largest error {percent:.3g} %", solver.fraction(state))
    return Solution(state.best, outcome, state.iteration, tuple(convergence))
