"""NRRD (Kindlmann, "Nearly raw raster data"): the fastest axis first, which is x, y, z."""

import zlib
from pathlib import Path
from typing import Any

import nrrd
import numpy as np
from numpy.typing import NDArray

from drkid.volume.physical_unit import in_known_unit
from drkid.volume.stored import Spacing, Stored

FAULTS: tuple[type[Exception], ...] = (
    OSError,
    EOFError,
    ValueError,
    KeyError,
    IndexError,
    MemoryError,
    zlib.error,
    nrrd.NRRDError,
)

_RAW_TYPES = {
    **dict.fromkeys(("signed char", "int8", "int8_t"), "i1"),
    **dict.fromkeys(("uchar", "unsigned char", "uint8", "uint8_t"), "u1"),
    **dict.fromkeys(("short", "short int", "int16", "int16_t"), "i2"),
    **dict.fromkeys(("ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t"), "u2"),
    **dict.fromkeys(("int", "signed int", "int32", "int32_t"), "i4"),
    **dict.fromkeys(("uint", "unsigned int", "uint32", "uint32_t"), "u4"),
    "float": "f4",
    "double": "f8",
}
"""Names of the format's types, and NumPy's; rarer ones are left to pynrrd."""


def read(path: Path) -> Stored:
    """The array; spacing from `space directions` (their lengths) or `spacings`, unit from `space units`."""
    values, header = _loaded(path)
    lengths: list[float] = []
    if "space directions" in header:
        lengths = [float(np.linalg.norm(row)) for row in header["space directions"] if row is not None]
        lengths = [length for length in lengths if np.isfinite(length)]
    elif "spacings" in header:
        lengths = [float(size) for size in header["spacings"] if np.isfinite(size)]
    names = [str(name) for name in header.get("space units", header.get("units", []))][:3]
    spacing: Spacing | None = None
    unit = None
    if len(lengths) >= 3:
        spacing, unit = in_known_unit(lengths[:3], names if len(names) == 3 else [""] * 3)
    kinds = [str(kind) for kind in header.get("kinds", [])]
    return Stored(values, _axes(values.ndim, kinds), spacing, unit)


def _loaded(path: Path) -> tuple[NDArray[Any], dict[str, Any]]:
    """Array and header; raw data that follow the header are mapped into memory and not read."""
    with path.open("rb") as file:
        header: dict[str, Any] = nrrd.read_header(file)
        offset = file.tell()
    moved = {"data file", "datafile", "line skip", "lineskip", "byte skip", "byteskip"} & header.keys()
    name = _RAW_TYPES.get(str(header.get("type")))
    if str(header.get("encoding")) != "raw" or moved or name is None:
        return nrrd.read(str(path), index_order="F")
    order = ">" if str(header.get("endian", "little")) == "big" else "<"
    shape = tuple(int(size) for size in header["sizes"])
    return np.memmap(path, np.dtype(order + name), "r", offset, shape, "F"), header


def _axes(count: int, kinds: list[str]) -> str:
    """x, y, z for the axes that are spatial, c for the others; the first three where the header does not say."""
    spatial = [kind in ("domain", "space") for kind in kinds]
    if len(kinds) != count or sum(spatial) != 3:
        return ("xyz" + "c" * count)[:count]
    letters = iter("xyz")
    return "".join(next(letters) if here else "c" for here in spatial)
