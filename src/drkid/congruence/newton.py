"""Minimum-norm Newton on the edge lengths alone: exact, and of quadratic convergence unless at a fold.

Each step is the smallest dx with J dx = L[labels] − len(x); the palette's free unknowns take part with a weight of
their own (Deuflhard 2004, section 4.4, on underdetermined Newton methods).
"""

import numpy as np
from numba import njit

from drkid.congruence.cholesky import cholesky_solve
from drkid.congruence.framework import Framework
from drkid.congruence.levenberg_marquardt import Freedom, changed_lengths, palette_columns
from drkid.congruence.linearisation import add_transposed, directions
from drkid.mesh import Floats, Ints

ITERATIONS = 14
EXACT = 1e-12  # largest edge error, of the mean length, at which nothing is left to gain
PATIENCE, LEAST_FACTOR = 4, 0.3  # it gives up where so many iterations bring less than this factor
PALETTE_SHARE = 0.3  # weight of the palette's unknowns against the vertices'
LONGEST_STEP = 0.5  # of the mean length


def exact(frame: Framework, freedom: Freedom = "all") -> Framework:
    """The best framework on the way; `worst` tells whether it is exact.

    Raises:
        numpy.linalg.LinAlgError: the mesh is degenerate.
    """
    best, errors = frame, [frame.worst]
    for _ in range(ITERATIONS):
        frame = _step(frame, freedom)
        errors.append(frame.worst)
        if frame.worst < best.worst:
            best = frame
        stuck = len(errors) > PATIENCE + 1 and errors[-1] > LEAST_FACTOR * errors[-1 - PATIENCE]
        if best.worst < EXACT or stuck:
            break
    return best


@njit(cache=True, _nrt=False)
def _add_shared(direction: Floats, edges: Ints, e: int, f: int, out: Floats) -> None:
    """Add what edges e and f share to J Jᵀ: the cosine between them, by the vertex where they meet."""
    cosine = 0.0
    for r in range(3):
        cosine += direction[e, r] * direction[f, r]
    for p in range(2):
        for q in range(2):
            if edges[e, p] == edges[f, q]:
                out[e, f] += cosine if p == q else -cosine


@njit(cache=True, nogil=True)
def _tension_and_shift(
    vertices: Floats, edges: Ints, columns: Floats, residual: Floats, share: float, damping: float
) -> tuple[Floats, Floats]:
    """Edge tensions t (E,) and the shift −Jᵀ t (V, 3) of the minimum-norm Newton step.

    (J Jᵀ + share P Pᵀ + damping I) t = residual, with the palette's `columns` P (E, p).

    Raises:
        numpy.linalg.LinAlgError: an edge has no length, or the system is singular.
    """
    direction, count = directions(vertices, edges), len(edges)
    normal = np.zeros((count, count))
    for e in range(count):
        for f in range(count):
            for p in range(columns.shape[1]):
                normal[e, f] += share * columns[e, p] * columns[f, p]
            _add_shared(direction, edges, e, f, normal)
        normal[e, e] += damping
    tension = residual.copy()
    cholesky_solve(normal, tension.reshape(1, -1))
    shift = np.zeros(vertices.size)
    add_transposed(direction, edges, tension, -1.0, shift)
    return tension, shift.reshape(-1, 3)


def _step(frame: Framework, freedom: Freedom) -> Framework:
    columns = palette_columns(frame, freedom)
    damping = 1e-12 if frame.worst < 1e-3 else 1e-9
    tension, shift = _tension_and_shift(
        np.array(frame.mesh.vertices), np.array(frame.mesh.edges), columns, frame.residual, PALETTE_SHARE, damping
    )
    share = min(1.0, LONGEST_STEP * frame.wanted.mean() / max(float(np.abs(shift).max()), 1e-300))
    lengths = changed_lengths(frame, freedom, share * PALETTE_SHARE * columns.T @ tension)
    return frame.moved(frame.mesh.vertices + share * shift, lengths)
