"""Levenberg–Marquardt on the true mesh: edge lengths against the palette, vertices against the target.

Minimises |len(x) − L[labels]|² + w² oᵀ K o over the vertices x and, as far as they are free, the palette's lengths L,
which enter by a small Schur complement (Nocedal and Wright 2006, section 10.3).
"""

from typing import Literal

import numpy as np
from numba import njit

from drkid.congruence.cholesky import cholesky_solve
from drkid.congruence.framework import Framework
from drkid.congruence.linearisation import Slope, Springs, Trial, add_transposed, slope_at, tried_at
from drkid.congruence.target import Target
from drkid.mesh import Floats

Freedom = Literal["all", "scale", "none"]
"""Which of the palette's lengths may change: each of them, all by one factor, or none."""

FIRST_DAMPING, MOST_FIRST_DAMPING = 3e-5, 0.03  # over w²: the weaker the shape holds, the shorter the steps that help
HARDER, EASIER = 4.0, 0.4  # factors of the damping after a step that failed, and after one that did not
LEAST_GAIN = 1e-3  # of the merit in one iteration, below which it ends
TRIALS = 8  # of larger damping, until the merit falls


def palette_basis(lengths: Floats, freedom: Freedom) -> Floats:
    """(p, q): derivative of the palette's lengths by each of their p free unknowns."""
    if freedom == "all":
        return np.eye(len(lengths))
    return lengths[None].copy() if freedom == "scale" else np.zeros((0, len(lengths)))


def palette_columns(frame: Framework, freedom: Freedom) -> Floats:
    """(E, p): derivative of the wanted lengths by the palette's p free unknowns."""
    return palette_basis(frame.lengths, freedom).T[frame.labels]


def changed_lengths(frame: Framework, freedom: Freedom, step: Floats) -> Floats:
    """The palette's lengths after a step of its free unknowns."""
    if freedom == "all":
        return frame.lengths + step
    return frame.lengths * (1 + step[0]) if freedom == "scale" else frame.lengths


@njit(cache=True)
def first_damping(weight: float) -> float:
    """Damping of the first step at a weight of the shape: with less of it about every other step was refused."""
    return min(FIRST_DAMPING / max(weight * weight, 1e-300), MOST_FIRST_DAMPING)


@njit(cache=True, nogil=True)
def _schur_step(known: Floats, columns: Floats, coupling: Floats, both: Floats, residual: Floats) -> Floats:
    """(p,): the step of the palette's unknowns; `known` is the gradient, `both` holds the solutions for both."""
    count = len(columns)
    schur, right = np.empty((count, count)), np.empty(count)
    for p in range(count):
        right[p] = np.dot(columns[p], residual) + np.dot(both[p], known)
        for q in range(count):
            schur[p, q] = np.dot(columns[p], columns[q]) - np.dot(coupling[p], both[q])
        schur[p, p] += 1e-9
    cholesky_solve(schur, right.reshape(1, -1))
    return right


@njit(cache=True, nogil=True)
def _damped_step(at: Trial, slope: Slope, springs: Springs, damping: float) -> tuple[Floats, Floats]:
    """Vertices and lengths after one step."""
    hessian, size, count = slope.hessian.copy(), len(slope.gradient), len(springs.basis)
    columns, coupling = np.empty((count, len(springs.labels))), np.zeros((count + 1, size))
    for p in range(count):
        for e in range(len(springs.labels)):
            columns[p, e] = springs.basis[p, springs.labels[e]]
        add_transposed(slope.direction, springs.edges, columns[p], -1.0, coupling[p])
    for i in range(size):
        hessian[i, i] += damping
        coupling[count, i] = slope.gradient[i]
    both = coupling.copy()
    cholesky_solve(hessian, both)
    vertices, lengths = at.vertices.copy(), at.lengths.copy()
    step = _schur_step(slope.gradient, columns, coupling, both, at.residual)
    for i in range(size):
        vertices[i // 3, i % 3] -= both[count, i]
        for p in range(count):
            vertices[i // 3, i % 3] -= step[p] * both[p, i]
    for p in range(count):
        for q in range(len(lengths)):
            lengths[q] += step[p] * springs.basis[p, q]
    return vertices, lengths


@njit(cache=True, nogil=True)
def _damped_least_squares(
    vertices: Floats, lengths: Floats, springs: Springs, iterations: int
) -> tuple[Floats, Floats, float]:
    """Vertices, lengths and merit after at most so many iterations of Levenberg–Marquardt; the merit never rises.

    Raises:
        numpy.linalg.LinAlgError: the mesh is degenerate beyond what damping mends.
    """
    slots = np.zeros(len(vertices), np.int64)
    at, damping = tried_at(vertices, lengths, springs, slots), first_damping(springs.weight)
    for _ in range(iterations):
        slope, fallen, tried = slope_at(at, springs), False, at
        for _trial in range(TRIALS):
            moved, free = _damped_step(at, slope, springs, damping)
            tried = tried_at(moved, free, springs, slots)
            fallen = tried.merit < at.merit
            if fallen:
                break
            damping *= HARDER
        if not fallen:
            break
        gain, at, damping = at.merit - tried.merit, tried, EASIER * damping
        if gain < LEAST_GAIN * at.merit:
            break
    return at.vertices, at.lengths, at.merit


def springs_of(frame: Framework, target: Target, weight: float, freedom: Freedom) -> Springs:
    """What the kernels need of a framework, in arrays of their own: read-only ones would be compiled for again."""
    return Springs(
        np.array(frame.mesh.edges),
        np.array(frame.labels),
        np.array(frame.stiffness),
        target.surface,
        float(weight),
        palette_basis(frame.lengths, freedom),
    )


def solve(
    frame: Framework, target: Target, weight: float, freedom: Freedom = "all", iterations: int = 6
) -> tuple[Framework, float]:
    """The framework after at most so many iterations, and its merit, which never rises.

    Raises:
        numpy.linalg.LinAlgError: the mesh is degenerate beyond what damping mends.
    """
    springs = springs_of(frame, target, weight, freedom)
    vertices, lengths, value = _damped_least_squares(
        np.array(frame.mesh.vertices), frame.lengths.copy(), springs, iterations
    )
    return frame.moved(vertices, lengths), value
