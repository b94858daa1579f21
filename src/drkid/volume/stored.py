"""A volume as its file stores it, and the way from there to axes (x, y, z)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drkid.errors import InputError
from drkid.spec import Unit

Spacing = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Stored:
    """What a reader returns.

    `axes` names the array's axes by letters; empty where the format names none and z, y, x is meant.
    `spacing` is along (x, y, z) and may hold anything a header holds; None where the file has none.
    """

    values: NDArray[np.generic]
    axes: str
    spacing: Spacing | None
    unit: Unit | None
    notes: tuple[str, ...] = ()


def along_xyz(stored: Stored, name: str) -> NDArray[np.generic]:
    """The values with axes (x, y, z), in the machine's byte order, without axes of length 1.

    Raises:
        InputError: it is no volume of real numbers.
    """
    values, kept = stored.values, [axis for axis, size in enumerate(stored.values.shape) if size != 1]
    axes = "".join(stored.axes[axis] for axis in kept) if stored.axes else "zyx"
    if values.dtype.kind not in "biuf" or len(kept) != 3 or set(axes) != set("xyz") or not values.size:
        axes = f", axes {stored.axes}" if stored.axes else ""
        raise InputError(
            f"{name} is not a three-dimensional volume of numbers",
            wanted="one value at every x, y, z: no time steps, channels or colours",
            found=f"shape {' × '.join(map(str, values.shape))}{axes}, {values.dtype}",
            remedy="save one time step and channel as a stack of slices",
        )
    values = values.reshape([values.shape[axis] for axis in kept]).transpose([axes.index(axis) for axis in "xyz"])
    return values.astype(values.dtype.newbyteorder("="), copy=False)
