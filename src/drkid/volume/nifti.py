"""NIfTI-1 and -2: x, y, z."""

import zlib
from pathlib import Path
from typing import Any

import nibabel as nib
import numpy as np
from nibabel.filebasedimages import ImageFileError
from nibabel.nifti1 import Nifti1Image
from nibabel.spatialimages import HeaderDataError
from numpy.typing import NDArray

from drkid.volume.physical_unit import in_known_unit
from drkid.volume.stored import Stored

FAULTS: tuple[type[Exception], ...] = (
    OSError,
    EOFError,
    ValueError,
    MemoryError,
    OverflowError,
    zlib.error,
    ImageFileError,
    HeaderDataError,
)


def read(path: Path) -> Stored:
    """The image in the order of its voxels: orientation and origin in space are not applied."""
    image = nib.load(path)
    if not isinstance(image, Nifti1Image):
        message = f"it is {type(image).__name__}, not NIfTI"
        raise ImageFileError(message)
    values = _values(image.dataobj)
    sizes = [float(f"{size:.7g}") for size in (*image.header.get_zooms(), 1.0, 1.0)[:3]]  # stored as float32
    name = str(image.header.get_xyzt_units()[0])
    notes = [] if name != "unknown" else ["the header names no unit: millimetres taken (--unit)"]
    if image.affine is not None and np.linalg.det(image.affine[:3, :3]) < 0:
        notes.append("the header's affine mirrors the voxel axes: the kit is the mirror image of it")
    spacing, unit = in_known_unit(sizes, ["mm" if name == "unknown" else name] * 3)
    return Stored(values, ("xyzt" + "c" * values.ndim)[: values.ndim], spacing, unit, tuple(notes))


def _values(proxy: Any) -> NDArray[Any]:
    """Stored numbers, mapped where the file is not compressed; numbers that the header scales as float32, not 64."""
    return np.asanyarray(proxy) if (proxy.slope, proxy.inter) == (1, 0) else proxy.get_scaled(np.float32)
