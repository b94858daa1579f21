"""The parts list: one row for each printed part and each rod."""

import csv
import io
import json
from dataclasses import asdict, dataclass, fields
from math import ceil
from typing import Any

from drkid.export.colour import CONNECTOR_COLOUR, class_colour
from drkid.export.layout import part_label, picture_file
from drkid.spec import KitSpec

ROUNDING = 1e-9  # 5 % of 40 are 2 spares, whatever the last bit says


@dataclass(frozen=True)
class Row:
    """A line of the parts list; what does not apply is None and an empty cell.

    `volume_mm3`, `mass_g`, `length` and `cost` are those of one part, in mm, g and the currency of the given price;
    `total_…` of all of them, spares included: for rods `total_length` is the stock to buy. `mould_cost` is what one
    mould for the part costs, `moulded_cost` a moulded copy; the mould pays from `break_even_count` copies on, None
    where a moulded copy costs no less. `picture` is written where the kit has documents.
    """

    part: str
    file: str
    count: int
    spare: int = 0
    volume_mm3: float | None = None
    mass_g: float | None = None
    colour: str | None = None
    diameter: float | None = None
    length: float | None = None
    total_mass_g: float | None = None
    total_length: float | None = None
    cost: float | None = None
    total_cost: float | None = None
    mould_cost: float | None = None
    moulded_cost: float | None = None
    break_even_count: int | None = None
    picture: str | None = None


@dataclass(frozen=True)
class Moulding:
    """Printing a kit of so many `parts` against moulding it, in the currency of the given prices.

    Spares and rods are left out. Moulds pay from `break_even_kits` kits on; None where a moulded kit costs no less
    than a printed one.
    """

    moulds: int
    parts: int
    moulds_cost: float
    printed_kit_cost: float
    moulded_kit_cost: float
    break_even_kits: int | None


def spare_count(spares: str, count: int) -> int:
    """How many spares of a part that is there `count` times: '5%' of them, rounded up, or so many of each."""
    if not spares.endswith("%"):
        return int(spares)
    return ceil(float(spares[:-1]) / 100 * count - ROUNDING)


def piece_row(file: str, class_index: int, count: int, volume_mm3: float, spec: KitSpec) -> Row:
    """A printed piece."""
    return _printed(f"piece {part_label(file)}", file, count, volume_mm3, class_colour(class_index), spec)


def connector_row(name: str, file: str, count: int, volume_mm3: float, spec: KitSpec) -> Row:
    """A printed connector part."""
    return _printed(name, file, count, volume_mm3, CONNECTOR_COLOUR, spec)


def rod_row(diameter_mm: float, length_mm: float, count: int, spec: KitSpec) -> Row:
    """Metal rods, cut to length."""
    spare = spare_count(spec.spares, count)
    total = (count + spare) * length_mm
    return Row("rod", "", count, spare, diameter=diameter_mm, length=length_mm, total_length=total)


def _printed(part: str, file: str, count: int, volume_mm3: float, colour: str, spec: KitSpec) -> Row:
    spare = spare_count(spec.spares, count)
    mass = volume_mm3 * spec.preset.density_g_cm3 / 1000
    cost = None if spec.price_per_kg is None else mass / 1000 * spec.price_per_kg
    return Row(
        part, file, count, spare, volume_mm3, mass, colour,
        total_mass_g=(count + spare) * mass,
        cost=cost,
        total_cost=None if cost is None else (count + spare) * cost,
        picture=picture_file(file) if spec.documents else None,
        **_moulded(cost, spec),
    )  # fmt: skip


def _moulded(cost: float | None, spec: KitSpec) -> dict[str, Any]:
    """The cells that compare a printed part of a cost with a moulded one; none where a price is not given."""
    if cost is None or spec.mould_price is None:
        return {}
    return {
        "mould_cost": spec.mould_price,
        "moulded_cost": spec.moulded_price_per_piece,
        "break_even_count": break_even(spec.mould_price, cost - spec.moulded_price_per_piece),
    }


def break_even(moulds_cost: float, saved: float) -> int | None:
    """From how many copies on moulds pay, each of which saves so much; None where it saves nothing."""
    return max(1, ceil(moulds_cost / saved - ROUNDING)) if saved > 0 else None


def moulding(rows: list[Row], spec: KitSpec) -> Moulding | None:
    """The comparison, one mould for each printed shape; None where a price is not given."""
    printed = [row for row in rows if row.file]
    costs = [row.cost for row in printed if row.cost is not None]
    if spec.mould_price is None or len(costs) < len(printed):
        return None
    printed_kit = sum(row.count * cost for row, cost in zip(printed, costs, strict=True))
    moulded_kit = sum(row.count for row in printed) * spec.moulded_price_per_piece
    moulds_cost = len(printed) * spec.mould_price
    kits = break_even(moulds_cost, printed_kit - moulded_kit)
    return Moulding(len(printed), sum(row.count for row in printed), moulds_cost, printed_kit, moulded_kit, kits)


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
