"""Names of lengths in headers, and the four that drkid knows."""

from collections.abc import Sequence

from drkid.spec import Unit

_NANOMETRES: dict[Unit, float] = {"angstrom": 0.1, "nm": 1.0, "um": 1e3, "mm": 1e6}
_NAMES: dict[str, tuple[Unit, float]] = {
    **dict.fromkeys(("angstrom", "å", "å", "a", "angstroms"), ("angstrom", 1.0)),
    **dict.fromkeys(("pm", "picometer", "picometre"), ("angstrom", 0.01)),
    **dict.fromkeys(("nm", "nanometer", "nanometre", "nanometers"), ("nm", 1.0)),
    **dict.fromkeys(("um", "µm", "μm", "micron", "microns", "micrometer", "micrometre", "micrometers"), ("um", 1.0)),
    **dict.fromkeys(("mm", "millimeter", "millimetre", "millimeters"), ("mm", 1.0)),
    **dict.fromkeys(("cm", "centimeter", "centimetre"), ("mm", 10.0)),
    **dict.fromkeys(("m", "meter", "metre"), ("mm", 1000.0)),
}


def in_known_unit(sizes: Sequence[float], names: Sequence[str]) -> tuple[tuple[float, float, float], Unit | None]:
    """Three sizes, each with a header's name of its unit, in the first one's unit; as they are where it is unknown."""
    known = [_NAMES.get(name.strip().lower().replace("\\u00b5", "µ")) for name in names]
    if any(unit is None for unit in known):
        return (sizes[0], sizes[1], sizes[2]), None
    pairs = [unit for unit in known if unit is not None]
    target = pairs[0][0]
    x, y, z = (
        size * factor if unit == target else size * factor * _NANOMETRES[unit] / _NANOMETRES[target]
        for size, (unit, factor) in zip(sizes, pairs, strict=True)
    )
    return (x, y, z), target
