"""The protocol that every solver follows, and the one driver that runs any of them."""

from dataclasses import dataclass
from typing import Protocol, TypeVar

from drkid.kit import Convergence, Outcome
from drkid.mesh import Floats, Ints, TriMesh
from drkid.progress import Progress


@dataclass(frozen=True, eq=False)
class Candidate:
    """A mesh with its classes: `face_class` (F,) into `class_lengths` (k, 3); `error` is the largest, a length.

    `palette_lengths` (q,) are those that the classes are made of, ascending, where the solver has a palette.
    """

    mesh: TriMesh
    face_class: Ints
    class_lengths: Floats
    error: float
    palette_lengths: Floats | None = None

    @property
    def percent(self) -> float:
        """The largest error in percent of the mean edge."""
        return 100 * self.error / self.mesh.mean_edge


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

    def interrupted(self, state: S) -> Outcome | None:
        """What to say when the search is ended by hand; None where the best so far is no answer."""
        ...

    def told(self, state: S) -> str:
        """How far the solver is, in words."""
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
    """Step until the solver is finished.

    An interruption (Ctrl-C) ends the search of an anytime solver, whose best mesh so far is the answer; of another
    solver it passes through, and so does a second one.
    """
    progress("starting", 0.0)
    state = solver.init(mesh)
    convergence = list(state.history)
    while (outcome := solver.finished(state)) is None:
        try:
            state = solver.step(state)
        except KeyboardInterrupt:
            outcome = solver.interrupted(state)
            if outcome is None:
                raise
            break
        convergence.extend(state.history)
        progress(solver.told(state), min(solver.fraction(state), 1.0))
    return Solution(state.best, outcome, state.iteration, tuple(convergence))
