"""read_volume: one dispatch over the readers of the formats."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from drkid.errors import InputError
from drkid.formats import VOLUME_SUFFIXES, checked_suffix, sha256_of
from drkid.kit import LabelVolume
from drkid.mesh import read_only
from drkid.spec import KitSpec, Unit
from drkid.volume import mrc, nifti, npy, nrrd, ome_zarr, tiff
from drkid.volume.label_likeness import classified
from drkid.volume.stored import Spacing, Stored, along_xyz
from drkid.voxels import Voxels, slabs

STRETCHED = 20.0  # voxels longer than this times their width are more often a wrong header than a microscope


@dataclass(frozen=True)
class _Format:
    read: Callable[[Path], Stored]
    faults: tuple[type[Exception], ...]  # what reading a broken file of this format raises


_FORMATS = {
    ".mrc": _Format(mrc.read, mrc.FAULTS),
    ".mrc.gz": _Format(mrc.read, mrc.FAULTS),
    ".map": _Format(mrc.read, mrc.FAULTS),
    ".map.gz": _Format(mrc.read, mrc.FAULTS),
    ".nii": _Format(nifti.read, nifti.FAULTS),
    ".nii.gz": _Format(nifti.read, nifti.FAULTS),
    ".tif": _Format(tiff.read, tiff.FAULTS),
    ".tiff": _Format(tiff.read, tiff.FAULTS),
    ".nrrd": _Format(nrrd.read, nrrd.FAULTS),
    ".npy": _Format(npy.read, npy.FAULTS),
    ".zarr": _Format(ome_zarr.read, ome_zarr.FAULTS),
}


def read_volume(path: Path, spec: KitSpec) -> LabelVolume:
    """A volume with axes (x, y, z), voxel spacing and unit from its header, or from `spec` where given there.

    Formats: MRC/CCP4 and NIfTI (plain or gzipped), TIFF (OME and ImageJ sizes), NRRD, npy, OME-Zarr.
    `notes` say what was odd or had to be assumed; `label_likeness.classified` says what `kind` means.

    Raises:
        InputError: the file is missing, empty, broken, of another format, not three-dimensional or not finite.
    """
    suffix = checked_suffix(path, VOLUME_SUFFIXES)
    form = _FORMATS[suffix]
    try:
        stored = form.read(path)
    except form.faults as error:
        raise _broken(path.name, suffix, error) from error
    values = along_xyz(stored, path.name)
    _refuse_non_finite(values, path.name)
    values, kind = classified(values)
    spacing, unit, notes = _spacing_and_unit(stored, spec)
    return LabelVolume(
        read_only(np.asarray(values)), spacing, unit, kind, path.name, sha256_of(path), (*stored.notes, *notes)
    )


def _broken(name: str, suffix: str, error: Exception) -> InputError:
    text = (str(error) or type(error).__name__).splitlines()[0]
    if "imagecodecs" in text:
        return InputError(
            f"{name} is compressed in a way that needs another package",
            found=text,
            remedy='pip install "drkid[codecs]", or save it uncompressed',
        )
    return InputError(
        f"{name} cannot be read",
        wanted=f"a whole {suffix}",
        found=text,
        remedy="export or download it again: it is cut off, damaged, or of another format than its name says",
    )


def _refuse_non_finite(values: Voxels, name: str) -> None:
    if values.dtype.kind != "f":
        return
    count = sum(int(np.count_nonzero(~np.isfinite(slab))) for slab in slabs(values))
    if count:
        raise InputError(
            f"{name} holds values that are no numbers",
            wanted="finite values",
            found=f"{count} of {values.size} voxels are NaN or infinite",
            remedy="replace them by 0 and save again",
        )


def _spacing_and_unit(stored: Stored, spec: KitSpec) -> tuple[Spacing, Unit | None, list[str]]:
    unit = spec.unit or stored.unit
    if spec.spacing is not None:
        return spec.spacing, unit, []
    if stored.spacing is None:
        return (1.0, 1.0, 1.0), unit, ["the file gives no voxel size: 1, 1, 1 taken (--spacing X,Y,Z --unit)"]
    notes: list[str] = []
    sizes = [size if math.isfinite(size) and size > 0 else 1.0 for size in stored.spacing]
    if sizes != list(stored.spacing):
        given = ", ".join(f"{size:g}" for size in stored.spacing)
        notes.append(f"the header's voxel size {given} makes no sense: 1 taken in its place (--spacing X,Y,Z)")
    if max(sizes) > STRETCHED * min(sizes):
        shown = " × ".join(f"{size:g}" for size in sizes)
        notes.append(f"the header's voxels are very long, {shown}: if that is wrong, --spacing X,Y,Z")
    return (sizes[0], sizes[1], sizes[2]), unit, notes
