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
ACROSS_AND_ALONG = 2.5  # directions in which an axis end errs: two across, and along the axis one for both ends


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

        A side's axis errs by a normal deviate of `accuracy` across it, at either end in either direction, and by
        half that variance along it as a whole; two sides meet, so that the differences have twice the variance.
        """
        joints = len(self.framework.pieces)
        if self._inverse is not None:
            taken = self._matrix.multiply(self._matrix @ self._inverse).sum(axis=1).reshape(joints, 2, 3).sum(axis=-1)
            return accuracy * np.sqrt(2 * np.maximum(ACROSS_AND_ALONG - taken, 0.0))
        rest = self._at_rest(self._drawn(SAMPLES)).reshape(joints, 2, 3, SAMPLES)
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

    def _axes(self) -> Floats:
        """(J, 2, 3, 3): the connector's axes of either side in the world, one a column."""
        return self.placements[self.framework.pieces][..., :3, :3] @ self.framework.frames[..., :3, :3]

    def _drawn(self, count: int) -> Floats:
        """(6J, count): deviates of unit variance across the axes, and of half of it along them, alike at both ends.

        Along an axis that is one number for both ends, whose share at each is half of what moves them as a whole.
        """
        rng = np.random.default_rng(SAMPLING_SEED)
        local = rng.standard_normal((len(self.framework.pieces), 2, 3, count))
        local[:, :, 0] = local[:, :1, 0] * np.sqrt(0.5)
        return np.einsum("jab,jebn->jean", self._axes()[:, 0], local).reshape(-1, count)

    def _mould_errors(self, moulds: Ints) -> Floats:
        """(6J, 5 moulds): what a unit error of each kind of each mould's side does to the gaps."""
        axes, joints = self._axes(), np.arange(len(moulds))
        errors = np.zeros((len(moulds), 2, 3, int(moulds.max()) + 1, 5))
        for side, sign in ((0, 1.0), (1, -1.0)):
            x, y, z = (sign * axes[:, side, :, i] for i in range(3))
            first, last = (0, 1) if side == 0 else (1, 0)  # the other side sees the axis the other way round
            for kind, (end, direction) in enumerate(((first, y), (first, z), (last, y), (last, z))):
                errors[joints, end, :, moulds[:, side], kind] += direction
            for end in (0, 1):
                errors[joints, end, :, moulds[:, side], 4] += np.sqrt(0.5) * x
        return errors.reshape(6 * len(moulds), -1)
