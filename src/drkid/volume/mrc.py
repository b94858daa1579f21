"""MRC and CCP4 maps (Cheng et al., "MRC2014", J. Struct. Biol. 192, 2015): z, y, x unless MAPC, MAPR, MAPS say else."""

import warnings
import zlib
from pathlib import Path
from typing import Any

import mrcfile
import numpy as np

from drkid.volume.stored import Stored

FAULTS: tuple[type[Exception], ...] = (OSError, EOFError, ValueError, TypeError, MemoryError, zlib.error)


def read(path: Path) -> Stored:
    """The map; its spacing is cell size over sampling, in ångström. Odd headers are read as far as they make sense."""
    with warnings.catch_warnings(record=True, action="always") as caught, mrcfile.open(path, permissive=True) as file:
        header: Any = file.header
        if file.data is None or header is None:
            raise ValueError("; ".join(str(warning.message) for warning in caught) or "no data")
        values = np.array(file.data)
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
