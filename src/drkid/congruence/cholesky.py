"""Solving with a Cholesky factor (Golub and Van Loan 2013, sections 3.1 and 4.2)."""

import numpy as np
from numba import njit

from drkid.mesh import Floats


@njit(cache=True, fastmath={"reassoc", "contract"}, _nrt=False)
def _substitute(lower: Floats, columns: Floats) -> None:
    """Solve L Lᵀ x = b in place for every row b of `columns` (m, n) (Golub and Van Loan 2013, section 3.1)."""
    for i in range(len(lower)):
        row = lower[i]
        for b in columns:
            total = 0.0
            for j in range(i):
                total += row[j] * b[j]
            b[i] = (b[i] - total) / row[i]
    for i in range(len(lower) - 1, -1, -1):
        row = lower[i]
        for b in columns:
            b[i] /= row[i]
            for j in range(i):
                b[j] -= b[i] * row[j]


@njit(cache=True, nogil=True)
def cholesky_solve(matrix: Floats, columns: Floats) -> None:
    """Solve A x = b in place for every row b of `columns` (m, n), A (n, n) being symmetric and positive definite.

    Raises:
        numpy.linalg.LinAlgError: A is not positive definite.
    """
    _substitute(np.linalg.cholesky(matrix), columns)  # pyright: ignore[reportArgumentType] — float64 of float64
