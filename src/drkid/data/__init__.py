"""The bundled shape: one cell nucleus, so that there is something to try without a file of one's own."""

from importlib.resources import files
from pathlib import Path


def nucleus_path() -> Path:
    """The bundled nucleus: a mask as OME-TIFF, voxels of 0.26 × 0.26 × 0.29 µm (x, y, z); see README.md beside it."""
    return Path(str(files("drkid.data") / "nucleus.tif"))
