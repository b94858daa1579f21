"""Tolerances: what errors of manufacturing open at each hinge once the shell has come to rest.

Linear propagation (Gauss): gaps r change by errors ε at the axes' ends and by the pieces' small motions x, which make
|ε + J x|² least, so that r changes by (1 − H) ε with H = J (JᵀJ)⁻¹ Jᵀ, the motions of the whole left out.
"""

import numpy as np
from scipy.sparse import csc_array, csr_array

from drkid.assembly.hinge_framework import HingeFramework
from drkid.assembly.relaxation import arm_length, factorised, jacobian
from drkid.mesh import Floats, Ints

DAMPING = 1e-10  # of the normal matrix's mean diagonal: leaves out the motions of the whole
MOST_EXACT = 300  # pieces up to which (JᵀJ)⁻¹ is written out and H is exact; it takes time as their cube
SAMPLES, SAMPLING_SEED = 100, 20_240  # beyond: prints that are drawn, good to 7 %


class Response:
    """How the gaps of a framework at rest answer to errors at the axes' ends."""

    def __init__(self, framework: HingeFramework, placements: Floats) -> None:
        """Linearised about `placements` (P, 4, 4)."""
        self.framework, self.placements = framework, placements
        self._matrix = csr_array(jacobian(framework, placements, arm_length(framework)))
        normal = csc_array(self._matrix.T @ self._matrix)
        small = framework.count <= MOST_EXACT
        shift = DAMPING * float(normal.diagonal().mean())
        self._inverse = np.linalg.inv(normal.toarray() + shift * np.eye(normal.shape[0])) if small else None
        self._factors = None if small else factorised(normal, DAMPING)

    def scattered(self, accuracy: float) -> Floats:
        """(J, 2): root mean square gap at each axis end where every printed side errs on its own.

        Each end of a side errs by a normal deviate of `accuracy` in each direction; two sides meet, so that their
        differences have twice the variance.
        """
        joints = len(self.framework.pieces)
        if self._inverse is not None:
            taken = self._matrix.multiply(self._matrix @ self._inverse).sum(axis=1).reshape(joints, 2, 3).sum(axis=-1)
            return accuracy * np.sqrt(2 * np.maximum(3.0 - taken, 0.0))
        drawn = np.random.default_rng(SAMPLING_SEED).standard_normal((6 * joints, SAMPLES))
        rest = self._at_rest(drawn).reshape(joints, 2, 3, SAMPLES)
        return accuracy * np.sqrt(2 * (rest**2).sum(axis=2).mean(axis=-1))

    def shared(self, moulds: Ints, accuracy: float) -> Floats:
        """(J, 2): root mean square gap where all sides from one mould err alike; `moulds` (J, 2) numbers its sides.

        Each side of a mould errs as in `scattered`, in its own connector coordinates, so that an error meets itself all
        around the shell.
        """
        rest = self._at_rest(self._mould_errors(moulds)).reshape(len(moulds), 2, 3, -1)
        return accuracy * np.sqrt((rest**2).sum(axis=(2, 3)))

    def _at_rest(self, errors: Floats) -> Floats:
        """(1 − H) ε for each column; one by one where factors are used, which do not gain by many."""
        pull = self._matrix.T @ errors
        if self._factors is None:
            return errors - self._matrix @ (self._inverse @ pull)
        moved = np.column_stack([self._factors.solve(column) for column in pull.T])
        return errors - self._matrix @ moved

    def _mould_errors(self, moulds: Ints) -> Floats:
        """(6J, 6 moulds): what a unit error of each end in each direction of each mould's side does to the gaps."""
        axes = self.placements[self.framework.pieces][..., :3, :3] @ self.framework.frames[..., :3, :3]
        joints = np.arange(len(moulds))
        errors = np.zeros((len(moulds), 2, 3, int(moulds.max()) + 1, 2, 3))
        for side, sign in ((0, 1.0), (1, -1.0)):
            for end in (0, 1):
                own = end if side == 0 else 1 - end  # the other side sees the axis the other way round
                for direction in range(3):
                    errors[joints, own, :, moulds[:, side], end, direction] += sign * axes[:, side, :, direction]
        return errors.reshape(6 * len(moulds), -1)
