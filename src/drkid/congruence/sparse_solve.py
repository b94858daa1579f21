"""Levenberg–Marquardt and minimum-norm Newton with sparse matrices, for meshes of hundreds to thousands of faces.

The same iterations as `levenberg_marquardt` and `newton`, whose dense factorisations grow with the cube of the faces.
What an edge error costs is a parameter: squares, or the `penalty` on what exceeds a tolerance.
Normal matrices are factorised in symmetric mode under a minimum-degree ordering (George and Liu 1989); the palette's
few unknowns enter by a Schur complement, in Newton by the Woodbury identity (Golub and Van Loan 2013, section 2.1.4).
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.sparse import coo_array, csc_array, csr_array, eye_array
from scipy.sparse.linalg import splu

from drkid.congruence.framework import BETA, Framework
from drkid.congruence.levenberg_marquardt import (
    EASIER,
    HARDER,
    LEAST_GAIN,
    Freedom,
    changed_lengths,
    first_damping,
    palette_columns,
)
from drkid.congruence.newton import EXACT, ITERATIONS, LEAST_FACTOR, LONGEST_STEP, PALETTE_SHARE, PATIENCE
from drkid.congruence.rigidity import edge_vectors
from drkid.congruence.target import Target
from drkid.mesh import Floats, TriMesh

TRIALS = 8  # of larger damping: a penalty is far stiffer than squares are


class Factor(Protocol):
    """A factorised matrix."""

    def solve(self, rhs: Floats, /) -> Floats:
        """The inverse times `rhs` (n,) or (n, m)."""
        ...


class Misfit(Protocol):
    """What the errors of a framework's edges cost: a convex function of its residuals."""

    def value(self, frame: Framework, /) -> float:
        """The cost."""
        ...

    def slope(self, frame: Framework, /) -> tuple[Floats, csr_array]:
        """Half the gradient (E,) and half the Hessian (E, E) by the residuals."""
        ...


@dataclass(frozen=True)
class Squares:
    """The sum of the squared residuals."""

    def value(self, frame: Framework, /) -> float:
        """|len(x) − L[labels]|²."""
        return float(frame.residual @ frame.residual)

    def slope(self, frame: Framework, /) -> tuple[Floats, csr_array]:
        """The residuals and the identity."""
        return frame.residual, csr_array(eye_array(len(frame.residual), format="csr"))


SQUARES = Squares()


@dataclass(frozen=True, eq=False)
class SparseLinearisation:
    """The merit at a framework, half its gradient (3V,) and Gauss–Newton Hessian (3V, 3V) by the vertices; J (E, 3V).

    `force` (E,) and `response` (E, E) are the misfit's half gradient and half Hessian by the residuals.
    """

    merit: float
    gradient: Floats
    hessian: csc_array
    jacobian: csr_array
    force: Floats
    response: csr_array


def factorised(matrix: csc_array) -> Factor:
    """LU of a symmetric positive definite matrix.

    Raises:
        numpy.linalg.LinAlgError: it is singular or not finite.
    """
    if not np.isfinite(matrix.data).all():
        raise np.linalg.LinAlgError("the matrix is not finite")
    try:
        return splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError as error:
        raise np.linalg.LinAlgError(str(error)) from error


def sparse_jacobian(frame: Framework) -> csr_array:
    """J (E, 3V), the rigidity matrix of `rigidity.rigidity_matrix`."""
    direction, _ = edge_vectors(frame.mesh.vertices, frame.mesh.edges)
    columns = (3 * frame.mesh.edges[:, :, None] + np.arange(3)).ravel()
    shape = (len(frame.labels), 3 * len(frame.mesh.vertices))
    values = np.concatenate([-direction, direction], axis=1).ravel()
    return csr_array((values, columns, np.arange(0, len(columns) + 1, 6)), shape=shape)


def sparse_smoothness(mesh: TriMesh, beta: float = BETA) -> csr_array:
    """K = I + β² ΛᵀΛ (V, V), as `target.smoothness`."""
    count, (a, b) = len(mesh.vertices), mesh.edges.T
    rows, columns = np.concatenate([a, b]), np.concatenate([b, a])
    laplacian = eye_array(count, format="csr") + csr_array(
        coo_array((-1.0 / mesh.valence[rows], (rows, columns)), shape=(count, count))
    )
    return csr_array(eye_array(count, format="csr") + beta**2 * (laplacian.T @ laplacian))


def sparse_merit(
    frame: Framework, offset: Floats, stiffness: csr_array, weight: float, misfit: Misfit = SQUARES
) -> float:
    """Misfit + w² oᵀ K o."""
    return misfit.value(frame) + float(weight**2 * (offset @ (stiffness @ offset)))


def sparse_linearised(
    frame: Framework, target: Target, weight: float, stiffness: csr_array, misfit: Misfit = SQUARES
) -> SparseLinearisation:
    """Merit, gradient, Gauss–Newton Hessian and J at a framework whose K is `stiffness`."""
    count = len(frame.mesh.vertices)
    offset, normals = target.offsets(frame.mesh.vertices)
    rows = np.arange(0, 3 * count + 1, 3)
    along = csr_array((weight * normals.ravel(), np.arange(3 * count), rows), shape=(count, 3 * count))
    jacobian, (force, response) = sparse_jacobian(frame), misfit.slope(frame)
    return SparseLinearisation(
        sparse_merit(frame, offset, stiffness, weight, misfit),
        np.asarray(jacobian.T @ force + weight * (along.T @ (stiffness @ offset)), np.float64),
        csc_array(jacobian.T @ (response @ jacobian) + along.T @ stiffness @ along),
        jacobian,
        force,
        response,
    )


def sparse_solve(
    frame: Framework,
    target: Target,
    weight: float,
    freedom: Freedom = "all",
    iterations: int = 6,
    *,
    misfit: Misfit = SQUARES,
    beta: float = BETA,
) -> tuple[Framework, float]:
    """As `levenberg_marquardt.solve`: the framework after at most so many iterations, and its merit, which never rises.

    Raises:
        numpy.linalg.LinAlgError: the mesh is degenerate beyond what damping mends.
    """
    stiffness = sparse_smoothness(frame.mesh, beta)
    at, damping = sparse_linearised(frame, target, weight, stiffness, misfit), first_damping(weight)
    for _ in range(iterations):
        for _ in range(TRIALS):
            tried = _damped_step(frame, at, freedom, damping)
            value = sparse_merit(tried, target.offsets(tried.mesh.vertices)[0], stiffness, weight, misfit)
            if value < at.merit:
                break
            damping *= HARDER
        else:
            break
        gain, frame = at.merit - value, tried
        if gain < LEAST_GAIN * value:
            return frame, value
        at, damping = sparse_linearised(frame, target, weight, stiffness, misfit), EASIER * damping
    return frame, at.merit


def _damped_step(frame: Framework, at: SparseLinearisation, freedom: Freedom, damping: float) -> Framework:
    factor = factorised(_with_diagonal(at.hessian, damping))
    columns = palette_columns(frame, freedom)
    answered = at.response @ columns
    coupling = -(at.jacobian.T @ answered)
    both = factor.solve(np.column_stack([coupling, at.gradient]))
    schur = columns.T @ answered - coupling.T @ both[:, :-1]
    schur[np.diag_indices_from(schur)] += 1e-9
    step = np.asarray(np.linalg.solve(schur, columns.T @ at.force + coupling.T @ both[:, -1]), np.float64)
    shift = -both[:, -1] - both[:, :-1] @ step
    return frame.moved(frame.mesh.vertices + shift.reshape(-1, 3), changed_lengths(frame, freedom, step))


def _with_diagonal(matrix: csc_array, added: float) -> csc_array:
    return csc_array(matrix + added * eye_array(matrix.shape[0], format="csc"))


def sparse_exact(frame: Framework, freedom: Freedom = "all") -> Framework:
    """As `newton.exact`: the best framework on the way; `worst` tells whether it is exact.

    Raises:
        numpy.linalg.LinAlgError: the mesh is degenerate.
    """
    best, errors = frame, [frame.worst]
    for _ in range(ITERATIONS):
        frame = _newton_step(frame, freedom)
        errors.append(frame.worst)
        if frame.worst < best.worst:
            best = frame
        stuck = len(errors) > PATIENCE + 1 and errors[-1] > LEAST_FACTOR * errors[-1 - PATIENCE]
        if best.worst < EXACT or stuck:
            break
    return best


def _newton_step(frame: Framework, freedom: Freedom) -> Framework:
    jacobian, columns = sparse_jacobian(frame), palette_columns(frame, freedom)
    regular = 1e-12 if frame.worst < 1e-3 else 1e-9
    factor = factorised(_with_diagonal(csc_array(jacobian @ jacobian.T), regular))
    both = factor.solve(np.column_stack([columns, frame.residual]))
    inner = np.eye(columns.shape[1]) / PALETTE_SHARE + columns.T @ both[:, :-1]
    tension = both[:, -1] - both[:, :-1] @ np.linalg.solve(inner, columns.T @ both[:, -1])
    shift = -(jacobian.T @ tension).reshape(-1, 3)
    share = min(1.0, LONGEST_STEP * frame.wanted.mean() / max(float(np.abs(shift).max()), 1e-300))
    lengths = changed_lengths(frame, freedom, share * PALETTE_SHARE * columns.T @ tension)
    return frame.moved(frame.mesh.vertices + share * shift, lengths)
