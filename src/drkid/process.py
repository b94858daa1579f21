"""What manufacturing processes can do: four that are known, and those that a user describes in a TOML file."""

import tomllib
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from drkid.errors import SpecError

Length = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Extent = Annotated[float, Field(gt=0, allow_inf_nan=False)]

BASE = "based_on"  # in a file: the known process whose values stand for those that the file does not name


class ProcessPreset(BaseModel):
    """What a manufacturing process can do; lengths in mm.

    Raises:
        ValidationError: a value is missing, unknown or outside its limits.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    clearance_mm: Length = Field(description="gap between connector and pocket")
    rod_clearance_mm: Length = Field(description="gap around a rod or pin, radial")
    min_wall_mm: Extent = Field(description="thinnest wall")
    knuckle_wall_mm: Extent = Field(description="wall of a hinge around its rod")
    knuckle_length_mm: Extent = Field(description="length of a knuckle along the rod")
    knuckle_gap_mm: Extent = Field(description="gap between knuckles")
    min_hole_mm: Length = Field(description="narrowest hole that stays open")
    engrave_width_mm: Extent = Field(description="narrowest groove of a mark")
    mark_depth_mm: Length = Field(description="depth of a mark")
    rods_mm: Annotated[tuple[Extent, ...], Field(min_length=1)] = Field(description="diameters of rods in stock")
    density_g_cm3: Extent = Field(description="density of the material")
    detent_mm: Length = Field(description="height of the bump that holds a hinge in its pocket")
    accuracy_mm: Length = Field(description="standard deviation of where a printed side lies")
    overhang_degrees: Annotated[float, Field(ge=0, le=90)] = Field(
        description="steepest lean from upright that prints without support"
    )
    max_wall_mm: Extent | None = Field(default=None, description="thickest wall")
    draft_degrees: Annotated[float, Field(ge=0, le=10)] = Field(default=0.0, description="draft of walls in a mould")
    max_undercut_mm: Length | None = Field(
        default=None, description="deepest undercut that springs off a mould; no mould where not given"
    )
    longest_bridge_mm: Extent | None = Field(
        default=None, description="widest overhang that prints without support; any where not given"
    )


def _known(  # noqa: PLR0913, PLR0917 — a row of the table below
    clearance: float,
    rod_clearance: float,
    wall: float,
    knuckle: tuple[float, float, float],
    hole: float,
    engraving: tuple[float, float],
    rods: tuple[float, ...],
    density: float,
    detent: float,
    accuracy: float,
    **others: Any,
) -> ProcessPreset:
    return ProcessPreset(
        clearance_mm=clearance,
        rod_clearance_mm=rod_clearance,
        min_wall_mm=wall,
        knuckle_wall_mm=knuckle[0],
        knuckle_length_mm=knuckle[1],
        knuckle_gap_mm=knuckle[2],
        min_hole_mm=hole,
        engrave_width_mm=engraving[0],
        mark_depth_mm=engraving[1],
        rods_mm=rods,
        density_g_cm3=density,
        detent_mm=detent,
        accuracy_mm=accuracy,
        **{"overhang_degrees": 90.0} | others,
    )


_THIN_RODS = (1.0, 1.5, 2.0)
_LAYERED = {"overhang_degrees": 45.0, "longest_bridge_mm": 10.0}
_MOULD = {"max_wall_mm": 3.5, "draft_degrees": 1.0, "max_undercut_mm": 0.3}

# The accuracy is half of what makers of machines state as theirs.
PROCESSES: dict[str, ProcessPreset] = {
    "fdm": _known(0.20, 0.15, 1.2, (1.0, 3.0, 0.40), 2.0, (0.6, 0.4), (1.75, 2.0, 3.0), 1.24, 0.30, 0.1, **_LAYERED),
    "sla": _known(0.15, 0.10, 1.0, (0.8, 2.0, 0.30), 0.5, (0.4, 0.4), _THIN_RODS, 1.18, 0.25, 0.05),
    "polyjet": _known(0.15, 0.10, 1.0, (0.8, 2.0, 0.30), 1.0, (0.5, 0.5), _THIN_RODS, 1.18, 0.25, 0.05),
    "injection": _known(0.08, 0.05, 1.2, (0.8, 2.0, 0.15), 0.0, (0.5, 0.3), _THIN_RODS, 1.04, 0.20, 0.025, **_MOULD),
}


def is_process_file(name: str) -> bool:
    """Whether a process is named by its TOML file."""
    return name.lower().endswith(".toml")


def read_process(path: Path) -> ProcessPreset:
    """A user's own process: names and values of `ProcessPreset` in TOML, `based_on` a known one for the others.

    Raises:
        SpecError: the file cannot be read, or a value is unknown, missing or outside its limits.
    """
    try:
        values = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise SpecError(
            f"the process {path} cannot be read",
            wanted="a TOML file such as: based_on = 'fdm', then clearance_mm = 0.25",
            found=getattr(error, "strerror", None) or str(error),
            remedy=f"one of {', '.join(PROCESSES)}, or the path of such a file",
        ) from error
    base = values.pop(BASE, None)
    if base is not None and base not in PROCESSES:
        raise SpecError(
            f"{path}: {BASE} names no known process", wanted=f"one of {', '.join(PROCESSES)}", found=repr(base)
        )
    known = {} if base is None else PROCESSES[str(base)].model_dump()
    try:
        return ProcessPreset.model_validate(known | values)
    except ValidationError as error:
        raise _reworded(path, error) from None


def _reworded(path: Path, error: ValidationError) -> SpecError:
    first = error.errors(include_url=False)[0]
    name = str(first["loc"][0])
    field = ProcessPreset.model_fields.get(name)
    meaning = "" if field is None else f" ({field.description})"
    if first["type"] == "extra_forbidden":
        return SpecError(f"{path}: a process has no {name}", wanted=", ".join(ProcessPreset.model_fields), found=name)
    if first["type"] == "missing":
        return SpecError(
            f"{path}: {name}{meaning} is missing",
            wanted=f"a value, or {BASE} = 'fdm' for all that are not given",
            found="nothing",
        )
    return SpecError(f"{path}: {name}{meaning} cannot be used", wanted=first["msg"], found=repr(first["input"]))
