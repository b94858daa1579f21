"""NumPy's own format: z, y, x, without spacing."""

import zipfile
from pathlib import Path

import numpy as np

from drkid.volume.stored import Stored

FAULTS: tuple[type[Exception], ...] = (OSError, EOFError, ValueError, MemoryError, SyntaxError, zipfile.BadZipFile)


def read(path: Path) -> Stored:
    """The array; pickled objects are refused."""
    values = np.lib.format.open_memmap(path, mode="r")
    return Stored(np.array(values), "", None, None)
