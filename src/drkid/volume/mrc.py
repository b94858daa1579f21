"""MRC and CCP4 maps (Cheng et al., "MRC2014", J. Struct. Biol. 192, 2015): z, y, x unless MAPC, MAPR, MAPS say else."""

import warnings
import zlib
from pathlib import Path
from typing import Any

import mrcfile
import numpy as np
from numpy.typing import NDArray

from drkid.volume.stored import Stored

FAULTS: tuple[type[Exception], ...] = (OSError, EOFError, ValueError, TypeError, MemoryError, zlib.error)


def read(path: Path) -> Stored:
    """The map; its spacing is cell size over sampling, in ångström. Odd headers are read as far as they make sense."""
    with warnings.catch_warnings(record=True, action="always") as caught, _opened(path) as file:
        header: Any = file.header
        if file.data is None or header is None:
            raise ValueError("; ".join(str(warning.message) for warning in caught) or "no data")
        values = _values(path, file)
        cell = [float(header.cella[axis]) for axis in "xyz"]
        sampling = [int(header[name]) for name in ("mx", "my", "mz")]
        order = [int(header[name]) for name in ("maps", "mapr", "mapc")]
    notes = tuple(f"the header is odd: {str(warning.message).splitlines()[0]}" for warning in caught)
    x, y, z = (
        float(f"{length / samples:.7g}") if samples > 0 else 0.0  # stored as float32
        for length, samples in zip(cell, sampling, strict=True)
    )
    axes = "".join("xyz"[axis - 1] for axis in order) if sorted(order) == [1, 2, 3] else "zyx"
    return Stored(values, "t" * (values.ndim - 3) + axes[-values.ndim :], (x, y, z), "angstrom", notes)


def _opened(path: Path) -> Any:
    if path.suffix.lower() == ".gz":
        return mrcfile.open(path, permissive=True)
    return mrcfile.mmap(path, mode="r", permissive=True)


def _values(path: Path, file: Any) -> NDArray[Any]:
    """The map, mapped into memory where the file is not compressed."""
    if path.suffix.lower() == ".gz" or not isinstance(file.data, np.memmap):
        return np.array(file.data)
    return np.memmap(path, file.data.dtype, "r", int(file.data.offset), file.data.shape)
