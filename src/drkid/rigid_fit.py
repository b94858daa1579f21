"""Rigid fit: the proper motion that carries points nearest to others."""

import numpy as np

from drkid.mesh import Floats


def rigid_fit(source: Floats, target: Floats) -> Floats:
    """(…, 4, 4): the rotation (det +1) and shift that carry points `source` (…, n, 3) nearest to `target`.

    Least squares, by singular value decomposition (Kabsch 1976; the sign of the last axis after Umeyama 1991).
    """
    source_middle, target_middle = source.mean(axis=-2), target.mean(axis=-2)
    covariance = np.swapaxes(source - source_middle[..., None, :], -1, -2) @ (target - target_middle[..., None, :])
    u, _, vt = np.linalg.svd(covariance)
    u[..., :, 2] *= np.sign(np.linalg.det(u @ vt))[..., None]
    motion = np.zeros((*covariance.shape[:-2], 4, 4))
    motion[..., :3, :3] = np.swapaxes(u @ vt, -1, -2)
    motion[..., :3, 3] = target_middle - np.einsum("...ij,...j->...i", motion[..., :3, :3], source_middle)
    motion[..., 3, 3] = 1.0
    return motion
