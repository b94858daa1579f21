"""The paper's method: k-means and pressure vertex translation in turn (algorithms 1 and 3).

Two slips of the text are put right: the current M_f, not M_s, is remeshed in every iteration, and the threshold T is
held against the Euclidean distance. What the text leaves open is decided so:

* k-means runs anew, from random starts, every `iterations_per_clustering` iterations; between them each iteration
  reassigns every triangle to the nearest class mean. The jumps between clusterings act like annealing: without them
  the error stalls two to five times higher (see the documentation's comparison with the paper).
* The surface that a vertex may not leave is M_s.
* A step halved to the middle that is still outside is not taken.
* Of all iterations whose mesh does not cut itself, the one with the smallest largest error is the result.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from drkid.congruence.kmeans import cluster
from drkid.congruence.local_operators import collapse_towards_classes, flip_towards_classes, flip_towards_valence_six
from drkid.congruence.pressure_iteration import ENERGY, MAXIMUM, MEAN, iterate
from drkid.congruence.solver import Candidate
from drkid.congruence.triangle_space import ascending_lengths, clustering_error
from drkid.intersection import self_intersections
from drkid.kit import Convergence, Outcome
from drkid.mesh import Floats, Ints, TriMesh, read_only
from drkid.spec import KitSpec

NEARBY_TRIANGLES = 24  # of M_s, by centroid: covers a reach of well over one edge around a vertex
STALLED_AFTER = 8000  # iterations without a better mesh


@dataclass(frozen=True, eq=False)
class PressureState:
    """The mesh of the last iteration, the best one, and how far the solver is."""

    mesh: TriMesh
    reference: TriMesh
    best: Candidate
    iteration: int
    improved_at: int
    history: tuple[Convergence, ...]


@dataclass(frozen=True)
class PressureSolver:
    """Solver of the protocol `congruence.solver.Solver`; lengths are in the mesh's unit."""

    spec: KitSpec

    def init(self, mesh: TriMesh) -> PressureState:
        """The first iteration's remeshing: valences, then collapses and flips that lower the clustering distance."""
        reference = mesh
        mesh, _ = flip_towards_valence_six(mesh)
        means, _ = cluster(ascending_lengths(mesh), self.spec.classes, self._rng(0), self.spec.kmeans_restarts)
        mesh, _ = collapse_towards_classes(mesh, means)
        mesh, _ = flip_towards_classes(mesh, means)
        means, labels = cluster(ascending_lengths(mesh), self.spec.classes, self._rng(0), self.spec.kmeans_restarts)
        return PressureState(mesh, reference, _candidate(mesh, labels, means), 0, 0, (_recorded(mesh, labels, means),))

    def step(self, state: PressureState) -> PressureState:
        """Cluster anew, then iterate pressure until the next clustering is due or the tolerance is met."""
        count = min(self.spec.iterations_per_clustering, self.spec.max_iterations - state.iteration)
        restarts = self.spec.kmeans_restarts if state.iteration == 0 else 1
        means, _ = cluster(ascending_lengths(state.mesh), self.spec.classes, self._rng(state.iteration), restarts)
        centres = state.reference.corners.mean(axis=1)
        near = min(NEARBY_TRIANGLES, len(centres))
        nearby = np.asarray(cKDTree(centres).query(state.mesh.vertices, k=near)[1], np.int64)
        mean_edge = state.mesh.mean_edge
        vertices, means, labels, last, history = iterate(
            state.mesh.vertices,
            state.mesh.edges,
            state.mesh.face_edges,
            means,
            state.reference.corners,
            nearby,
            self.spec.limit * state.reference.mean_edge,
            self._tolerance_percent(state) / 100 * mean_edge,
            count,
        )
        iteration = state.iteration + len(history)
        found = _candidate(state.mesh.moved(vertices), labels, means)
        better = found.error < state.best.error and len(self_intersections(found.mesh)) == 0
        return replace(
            state,
            mesh=state.mesh.moved(last),
            best=found if better else state.best,
            iteration=iteration,
            improved_at=iteration if better else state.improved_at,
            history=_history(history, state.iteration, mean_edge),
        )

    def finished(self, state: PressureState) -> Outcome | None:
        """Converged at the tolerance; stalled where nothing improves any more or the iterations are used up."""
        percent = 100 * state.best.error / state.best.mesh.mean_edge
        wanted = self._tolerance_percent(state)
        if percent <= wanted:
            return Outcome("converged", f"largest error {percent:.3g} % after {state.iteration} iterations")
        if state.iteration >= self.spec.max_iterations:
            why = "the iterations are used up"
        elif state.iteration - state.improved_at >= STALLED_AFTER:
            why = f"no better mesh in the last {STALLED_AFTER} iterations"
        else:
            return None
        return Outcome(
            "stalled",
            f"largest error {percent:.3g} % instead of {wanted:g} % after {state.iteration} iterations: {why}",
        )

    def _tolerance_percent(self, state: PressureState) -> float:
        return self.spec.tolerance_for(len(state.mesh.faces))

    def interrupted(self, state: PressureState) -> None:  # noqa: ARG002 — the protocol's signature
        """A mesh half-way is no answer: nothing is kept."""
        return

    def told(self, state: PressureState) -> str:
        """Iterations and the largest error."""
        return f"iteration {state.iteration}, largest error {state.best.percent:.3g} %"

    def fraction(self, state: PressureState) -> float:
        """Iterations done, of the most that are allowed."""
        return state.iteration / self.spec.max_iterations

    def _rng(self, iteration: int) -> np.random.Generator:
        return np.random.default_rng([self.spec.seed, iteration])


def _candidate(mesh: TriMesh, labels: Ints, means: Floats) -> Candidate:
    error = clustering_error(ascending_lengths(mesh), labels, means).maximum
    return Candidate(mesh, read_only(labels), read_only(means), error)


def _recorded(mesh: TriMesh, labels: Ints, means: Floats) -> Convergence:
    error = clustering_error(ascending_lengths(mesh), labels, means)
    return Convergence(0, error.energy, 100 * error.maximum / mesh.mean_edge, 100 * error.mean / mesh.mean_edge)


def _history(rows: Floats, start: int, mean_edge: float) -> tuple[Convergence, ...]:
    percent = 100 / mean_edge
    return tuple(
        Convergence(start + i + 1, row[ENERGY], row[MAXIMUM] * percent, row[MEAN] * percent)
        for i, row in enumerate(rows.tolist())
    )
