"""Minimum-norm Newton on the edge lengths alone: exact, and of quadratic convergence unless at a fold.

Each step is the smallest dx with J dx = L[labels] − len(x); the palette's free unknowns take part with a weight of
their own (Deuflhard 2004, section 4.4, on underdetermined Newton methods).
"""

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from drkid.congruence.framework import Framework
from drkid.congruence.levenberg_marquardt import Freedom, changed_lengths, palette_columns, transposed
from drkid.congruence.rigidity import edge_vectors, rigidity_matrix

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


def _step(frame: Framework, freedom: Freedom) -> Framework:
    jacobian = rigidity_matrix(frame.mesh.vertices, frame.mesh.edges)
    columns = palette_columns(frame, freedom)
    normal = jacobian @ jacobian.T + PALETTE_SHARE * columns @ columns.T
    normal[np.diag_indices_from(normal)] += 1e-12 if frame.worst < 1e-3 else 1e-9
    tension = cho_solve(cho_factor(normal, lower=True, overwrite_a=True, check_finite=False), frame.residual)
    direction, _ = edge_vectors(frame.mesh.vertices, frame.mesh.edges)
    shift = -transposed(direction, frame, tension).reshape(-1, 3)
    share = min(1.0, LONGEST_STEP * frame.wanted.mean() / max(float(np.abs(shift).max()), 1e-300))
    lengths = changed_lengths(frame, freedom, share * PALETTE_SHARE * columns.T @ tension)
    return frame.moved(frame.mesh.vertices + share * shift, lengths)
