"""The parts list: one row for each printed part and each rod."""

import csv
import io
import json
from dataclasses import asdict, dataclass, fields

from drkid.export.colour import CONNECTOR_COLOUR, class_colour
from drkid.kit import class_id


@dataclass(frozen=True)
class Row:
    """A line of the parts list; what does not apply is None and an empty cell."""

    part: str
    file: str
    count: int
    spare: int = 0
    volume_mm3: float | None = None
    mass_g: float | None = None
    colour: str | None = None
    diameter: float | None = None
    length: float | None = None


def piece_row(file: str, class_index: int, count: int, volume_mm3: float, density_g_cm3: float) -> Row:
    """A printed piece."""
    mass = volume_mm3 * density_g_cm3 / 1000
    return Row(f"piece {class_id(class_index)}", file, count, 0, volume_mm3, mass, class_colour(class_index))


def connector_row(name: str, file: str, count: int, volume_mm3: float, density_g_cm3: float) -> Row:
    """A printed connector part."""
    return Row(name, file, count, 0, volume_mm3, volume_mm3 * density_g_cm3 / 1000, CONNECTOR_COLOUR)


def rod_row(diameter_mm: float, length_mm: float, count: int) -> Row:
    """Metal rods, cut to length."""
    return Row("rod", "", count, diameter=diameter_mm, length=length_mm)


def bom_csv(rows: list[Row]) -> str:
    """The rows as CSV with a header."""
    text = io.StringIO()
    writer = csv.DictWriter(text, [f.name for f in fields(Row)], lineterminator="\n")
    writer.writeheader()
    for row in rows:
        writer.writerow({key: "" if value is None else value for key, value in asdict(row).items()})
    return text.getvalue()


def bom_json(rows: list[Row]) -> str:
    """The same rows as one JSON list."""
    return json.dumps([asdict(row) for row in rows], indent=1) + "\n"
