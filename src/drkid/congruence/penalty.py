"""Penalty method: the smoothest mesh whose faces are off by hardly more than a tolerance.

Where a mesh cannot be exact, least squares leave large errors in few places, at folds. Minimising

    w² oᵀ K o + τ² Σ_f (a s_f + s_f^p),   s_f = |r_f|² / τ²,

with r_f the three edge errors of face f, for growing powers p lets every face be off by about the tolerance τ and none
by much more: the largest error falls to a half or a third, and the slack goes into smoothness (Nocedal and Wright 2006,
section 17.1; for the powers, Pólya's algorithm of best uniform approximation, Boggs 1974).
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array, diags_array

from drkid.congruence.framework import Framework
from drkid.congruence.levenberg_marquardt import Freedom
from drkid.congruence.sparse_solve import sparse_solve
from drkid.congruence.target import Target
from drkid.mesh import Floats

SHARE_OF_SQUARES = 0.05  # a: what is well within the tolerance is still drawn to zero, gently
POWERS, ITERATIONS = (2, 4, 8), 8  # straight to the last power takes three times as many iterations
NEAR = 1.05  # the largest error is to be no more than so many times the tolerance
MORE, LESS = 6, 0.96  # solves at the last power until it is, each for a tolerance smaller by this factor


@dataclass(frozen=True)
class Penalty:
    """The misfit τ² Σ_f (a s_f + s_f^p) of `sparse_solve`; `tolerance` τ is a length."""

    tolerance: float
    power: int

    def value(self, frame: Framework, /) -> float:
        """The penalty."""
        share = self._share(frame)
        return float(self.tolerance**2 * (SHARE_OF_SQUARES * share + share**self.power).sum())

    def slope(self, frame: Framework, /) -> tuple[Floats, csr_array]:
        """Half the gradient (E,) and half the Hessian (E, E) by the residuals.

        The half Hessian of a face's term is c I + 2 c' r_f r_fᵀ / τ², with c = a + p s^(p−1) and c' its derivative.
        """
        share, sides, edges = self._share(frame), frame.mesh.face_edges, len(frame.labels)
        first = SHARE_OF_SQUARES + self.power * share ** (self.power - 1)
        second = self.power * (self.power - 1) * share ** (self.power - 2)
        of_edge = np.bincount(sides.ravel(), np.repeat(first, 3), edges)
        rows = frame.residual[sides] * (np.sqrt(2 * second) / self.tolerance)[:, None]
        starts = np.arange(0, 3 * len(sides) + 1, 3)
        outer = csr_array((rows.ravel(), sides.ravel(), starts), shape=(len(sides), edges))
        return of_edge * frame.residual, csr_array(outer.T @ outer + diags_array(of_edge))

    def _share(self, frame: Framework) -> Floats:
        return (frame.residual[frame.mesh.face_edges] ** 2).sum(axis=1) / self.tolerance**2


def within_tolerance(
    frame: Framework, target: Target, weight: float, freedom: Freedom, tolerance: float, *, beta: float
) -> Framework:
    """The framework whose faces are off by about `tolerance`, of the mean wanted length, or as little as was found.

    Args:
        frame: near the best that least squares give.
        target: the surface to stay near.
        weight: w, of the shape against the errors.
        freedom: which of the palette's lengths may change.
        tolerance: in the mean wanted length; the largest error ends a few percent above or below it.
        beta: of K, how much smoothness counts against closeness.

    Raises:
        numpy.linalg.LinAlgError: the mesh is degenerate beyond what damping mends.
    """
    length = tolerance * float(frame.wanted.mean())
    tightened = [(POWERS[-1], length * LESS**i) for i in range(MORE)]
    for number, (power, aim) in enumerate([(power, length) for power in POWERS] + tightened):
        if number >= len(POWERS) and largest_error(frame) <= NEAR * length:
            break
        frame, _ = sparse_solve(frame, target, weight, freedom, ITERATIONS, misfit=Penalty(aim, power), beta=beta)
    return frame


def largest_error(frame: Framework) -> float:
    """Of all faces, the largest norm of the three edge errors."""
    return float(np.sqrt((frame.residual[frame.mesh.face_edges] ** 2).sum(axis=1).max()))
