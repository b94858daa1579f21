"""Levenberg–Marquardt on the true mesh: edge lengths against the palette, vertices against the target.

Minimises |len(x) − L[labels]|² + w² oᵀ K o over the vertices x and, as far as they are free, the palette's lengths L,
which enter by a small Schur complement (Nocedal and Wright 2006, section 10.3).
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from drkid.congruence.framework import Framework
from drkid.congruence.rigidity import edge_vectors
from drkid.congruence.target import Target
from drkid.mesh import Floats

Freedom = Literal["all", "scale", "none"]
"""Which of the palette's lengths may change: each of them, all by one factor, or none."""

FIRST_DAMPING = 1e-6
LEAST_GAIN = 1e-3  # of the merit in one iteration, below which it ends
TRIALS = 5  # of larger damping, until the merit falls


@dataclass(frozen=True, eq=False)
class Linearisation:
    """The merit at a framework, half its gradient by the vertices (3V,), and what it was made of."""

    merit: float
    gradient: Floats
    hessian: Floats
    direction: Floats
    offset: Floats


def palette_columns(frame: Framework, freedom: Freedom) -> Floats:
    """(E, p): derivative of the wanted lengths by the palette's p free unknowns."""
    if freedom == "all":
        return np.eye(len(frame.lengths))[frame.labels]
    return frame.wanted[:, None] if freedom == "scale" else np.zeros((len(frame.labels), 0))


def changed_lengths(frame: Framework, freedom: Freedom, step: Floats) -> Floats:
    """The palette's lengths after a step of its free unknowns."""
    if freedom == "all":
        return frame.lengths + step
    return frame.lengths * (1 + step[0]) if freedom == "scale" else frame.lengths


def transposed(direction: Floats, frame: Framework, values: Floats) -> Floats:
    """Jᵀ v (3V,) or (3V, p) for v (E,) or (E, p), without making J."""
    columns = values.reshape(len(values), -1)
    out = np.zeros((len(frame.mesh.vertices), 3, columns.shape[1]))
    force = direction[:, :, None] * columns[:, None, :]
    np.add.at(out, frame.mesh.edges[:, 1], force)
    np.subtract.at(out, frame.mesh.edges[:, 0], force)
    return out.reshape(3 * len(out), *values.shape[1:])


def length_hessian(frame: Framework, direction: Floats) -> Floats:
    """JᵀJ (3V, 3V)."""
    size = 3 * len(frame.mesh.vertices)
    block = (direction[:, :, None] * direction[:, None, :]).ravel()
    weights = np.concatenate([block, block, -block, -block])
    return np.bincount(frame.hessian_index, weights, size * size).reshape(size, size).astype(np.float64, copy=False)


def offset_hessian(frame: Framework, normals: Floats) -> Floats:
    """NᵀKN (3V, 3V)."""
    outer = normals.reshape(-1, 1) * normals.reshape(1, -1)
    return outer * np.repeat(np.repeat(frame.stiffness, 3, axis=0), 3, axis=1)


def merit(frame: Framework, offset: Floats, weight: float) -> float:
    """|len(x) − L[labels]|² + w² oᵀ K o."""
    return float(frame.residual @ frame.residual + weight**2 * offset @ frame.stiffness @ offset)


def linearised(
    frame: Framework, target: Target, weight: float, offsets: tuple[Floats, Floats] | None = None
) -> Linearisation:
    """Merit, half its gradient and Gauss–Newton Hessian by the vertices; `offsets` where they are known already."""
    direction, _ = edge_vectors(frame.mesh.vertices, frame.mesh.edges)
    offset, normals = target.offsets(frame.mesh.vertices) if offsets is None else offsets
    pull = (weight**2 * normals * (frame.stiffness @ offset)[:, None]).ravel()
    return Linearisation(
        merit(frame, offset, weight),
        transposed(direction, frame, frame.residual) + pull,
        length_hessian(frame, direction) + weight**2 * offset_hessian(frame, normals),
        direction,
        offset,
    )


def solve(
    frame: Framework, target: Target, weight: float, freedom: Freedom = "all", iterations: int = 6
) -> tuple[Framework, float]:
    """The framework after at most so many iterations, and its merit, which never rises.

    Raises:
        numpy.linalg.LinAlgError: the mesh is degenerate beyond what damping mends.
    """
    at, damping = linearised(frame, target, weight), FIRST_DAMPING
    for _ in range(iterations):
        for _ in range(TRIALS):
            tried = _step(frame, at, freedom, damping)
            offsets = target.offsets(tried.mesh.vertices)
            value = merit(tried, offsets[0], weight)
            if value < at.merit:
                break
            damping = max(30 * damping, 1e-4)
        else:
            break
        gain, frame = at.merit - value, tried
        if gain < LEAST_GAIN * value:
            return frame, value
        at, damping = linearised(frame, target, weight, offsets), 0.2 * damping
    return frame, at.merit


def _step(frame: Framework, at: Linearisation, freedom: Freedom, damping: float) -> Framework:
    hessian = at.hessian.copy()
    hessian[np.diag_indices_from(hessian)] += damping
    factor = cho_factor(hessian, lower=True, overwrite_a=True, check_finite=False)
    columns = palette_columns(frame, freedom)
    coupling = -transposed(at.direction, frame, columns)
    both = cho_solve(factor, np.column_stack([coupling, at.gradient]), check_finite=False)
    schur = columns.T @ columns - coupling.T @ both[:, :-1]
    schur[np.diag_indices_from(schur)] += 1e-9
    step = np.asarray(np.linalg.solve(schur, columns.T @ frame.residual + coupling.T @ both[:, -1]), np.float64)
    shift = -both[:, -1] - both[:, :-1] @ step
    return frame.moved(frame.mesh.vertices + shift.reshape(-1, 3), changed_lengths(frame, freedom, step))
