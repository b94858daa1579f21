"""NRRD (Kindlmann, "Nearly raw raster data"): the fastest axis first, which is x, y, z."""

import zlib
from pathlib import Path

import nrrd
import numpy as np

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


def read(path: Path) -> Stored:
    """The array; spacing from `space directions` (their lengths) or `spacings`, unit from `space units`."""
    values, header = nrrd.read(str(path), index_order="F")
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


def _axes(count: int, kinds: list[str]) -> str:
    """x, y, z for the axes that are spatial, c for the others; the first three where the header does not say."""
    spatial = [kind in ("domain", "space") for kind in kinds]
    if len(kinds) != count or sum(spatial) != 3:
        return ("xyz" + "c" * count)[:count]
    letters = iter("xyz")
    return "".join(next(letters) if here else "c" for here in spatial)
