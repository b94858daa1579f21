"""NumPy's own format: z, y, x, without spacing."""

import zipfile
from pathlib import Path

import numpy as np

from drkid.volume.stored import Stored

FAULTS: tuple[type[Exception], ...] = (OSError, EOFError, ValueError, MemoryError, SyntaxError, zipfile.BadZipFile)


def read(path: Path) -> Stored:
    """The array, mapped into memory and not read; pickled objects are refused."""
    return Stored(np.lib.format.open_memmap(path, mode="r"), "", None, None)
