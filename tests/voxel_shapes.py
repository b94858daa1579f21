"""Solids as voxels, with what is known of them exactly."""

import numpy as np

from drkid.kit import LabelVolume
from drkid.mesh import Bools, Floats


def places(shape: tuple[int, int, int], spacing=(1.0, 1.0, 1.0)) -> Floats:
    """(x, y, z, 3): where the voxels' centres are."""
    return np.moveaxis(np.indices(shape), 0, -1) * np.asarray(spacing)


def ellipsoid(shape, centre, radii, spacing=(1.0, 1.0, 1.0)) -> Bools:
    return np.asarray((((places(shape, spacing) - centre) / radii) ** 2).sum(axis=-1) < 1)


def ball(size: int = 27, radius: float = 9.0) -> Bools:
    centre = (size - 1) / 2 + np.array((0.2, -0.1, 0.3))
    return ellipsoid((size, size, size), centre, np.full(3, radius))


def ring(size: int = 36, major: float = 11.0, minor: float = 4.0) -> Bools:
    x, y, z = np.moveaxis(places((size, size, 14)) - ((size - 1) / 2, (size - 1) / 2, 6.5), -1, 0)
    return np.asarray((np.hypot(x, y) - major) ** 2 + z**2 < minor**2)


def volume_of(values, spacing=(1.0, 1.0, 1.0), kind="mask", unit="um") -> LabelVolume:
    return LabelVolume(np.asarray(values), spacing, unit, kind, "made.npy", "0" * 64)
