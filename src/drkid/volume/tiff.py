"""TIFF stacks, with the voxel sizes of OME-TIFF and ImageJ: z, y, x."""

import logging
import re
import struct
import zlib
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import tifffile
from numpy.typing import NDArray

from drkid.spec import Unit
from drkid.volume.physical_unit import in_known_unit
from drkid.volume.stored import Spacing, Stored

FAULTS: tuple[type[Exception], ...] = (
    OSError,
    EOFError,
    ValueError,
    KeyError,
    IndexError,
    TypeError,
    MemoryError,
    struct.error,
    zlib.error,
    tifffile.TiffFileError,
    ElementTree.ParseError,
)

_STACK_AXES = "IQ"  # pages of a plain TIFF, to which tifffile gives no meaning: slices


def read(path: Path) -> Stored:
    """The first image series at full resolution.

    Raises:
        TiffFileError: the chain of pages is broken, so that slices would be missing (tifffile only logs it).
    """
    with _complaints() as complaints, tifffile.TiffFile(path) as file:
        series = file.series[0]
        values, axes = _values(path, file, series), _axes(series.axes, series.shape)
        if file.is_ome and file.ome_metadata:
            spacing, unit = _ome_spacing(file.ome_metadata)
        elif file.is_imagej and file.imagej_metadata:
            spacing, unit = _imagej_spacing(file.imagej_metadata, file.pages.first)
        else:
            spacing, unit = None, None
    broken = [text for text in complaints if "page" in text]
    if broken:
        raise tifffile.TiffFileError(broken[0])
    return Stored(values, axes, spacing, unit, tuple(f"the header is odd: {text}" for text in complaints))


def _values(path: Path, file: tifffile.TiffFile, series: Any) -> NDArray[Any]:
    """The pixels, mapped where they lie in the file one after the other and uncompressed."""
    if series.dataoffset is None:
        return np.asarray(series.asarray())
    stored = np.dtype(file.byteorder + series.dtype.char)
    return np.memmap(path, stored, "r", int(series.dataoffset), series.shape)


@contextmanager
def _complaints() -> Generator[list[str], None, None]:
    """What tifffile logs as an error meanwhile."""
    texts: list[str] = []
    handler = logging.Handler(logging.ERROR)
    handler.emit = lambda record: texts.append(record.getMessage())
    tifffile.logger().addHandler(handler)
    try:
        yield texts
    finally:
        tifffile.logger().removeHandler(handler)


def _axes(axes: str, shape: tuple[int, ...]) -> str:
    long = [axis for axis, size in zip(axes, shape, strict=True) if size != 1]
    pages = [axis for axis in long if axis in _STACK_AXES]
    if "Z" not in long and len(pages) == 1:
        axes = axes.replace(pages[0], "z")
    return axes.lower()


def _ome_spacing(metadata: str) -> tuple[Spacing | None, Unit | None]:
    """PhysicalSizeX, Y, Z of the first Pixels element (OME schema 2016-06), whose default unit is µm."""
    pixels = next((node for node in ElementTree.fromstring(metadata).iter() if node.tag.endswith("}Pixels")), None)
    if pixels is None or "PhysicalSizeX" not in pixels.attrib:
        return None, None
    sizes = [float(pixels.get(f"PhysicalSize{axis}", "nan")) for axis in "XYZ"]
    return in_known_unit(sizes, [pixels.get(f"PhysicalSize{axis}Unit", "µm") for axis in "XYZ"])


def _imagej_spacing(metadata: dict[str, Any], page: Any) -> tuple[Spacing | None, Unit | None]:
    """Pixels per unit in the resolution tags, `spacing` between slices in the description."""
    x, y = (_length_per_pixel(page, name) for name in ("XResolution", "YResolution"))
    if x is None or y is None or "unit" not in metadata or re.fullmatch(r"(?i)(pixels?|)", str(metadata["unit"])):
        return None, None
    return in_known_unit([x, y, float(metadata.get("spacing", "nan"))], [str(metadata["unit"])] * 3)


def _length_per_pixel(page: Any, name: str) -> float | None:
    tag = page.tags.get(name)
    if tag is None or not tag.value[0]:
        return None
    return float(f"{tag.value[1] / tag.value[0]:.7g}")  # a ratio of 32-bit integers
