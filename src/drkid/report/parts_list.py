"""The parts list as HTML, and what printing costs against moulding."""

import base64
from collections.abc import Mapping, Sequence
from html import escape

from drkid.export.bill_of_materials import Moulding, Row
from drkid.report.tables import Figure, Html, swatch, table
from drkid.spec import KitSpec

KITS = (1, 10, 100, 1000)  # whose costs are compared, beside the number from which moulds pay


def parts_table(rows: Sequence[Row], pictures: Mapping[str, bytes], spec: KitSpec) -> str:
    """One line a part, then the sums; `pictures` are PNG by the part's file. Columns that say nothing are left out."""
    columns = {
        "picture": [_pictured(row, pictures) for row in rows],
        "part": [_described(row) for row in rows],
        "count": [row.count for row in rows],
        "spare": [row.spare for row in rows],
        "volume, mm³": [row.volume_mm3 for row in rows],
        "mass, g": [row.mass_g for row in rows],
        "cost": [_money(row.cost) for row in rows],
        "all: mass, g": [row.total_mass_g for row in rows],
        "all: cost": [_money(row.total_cost) for row in rows],
    }
    shown = {name: cells for name, cells in columns.items() if any(cell not in (None, "") for cell in cells)}
    printed = [row for row in rows if row.file]
    sums: dict[str, object] = {
        "part": "all that is printed",
        "count": sum(row.count for row in printed),
        "spare": sum(row.spare for row in printed),
        "all: mass, g": _sum([row.total_mass_g for row in printed]),
        "all: cost": _money(_sum([row.total_cost for row in printed])),
    }
    about = (
        f"Volume, mass and cost are of one part, printed solid at {spec.preset.density_g_cm3:g} g/cm³ (process "
        f"{spec.process}); “all” are all copies, spares included."
    )
    lines = list(zip(*shown.values(), strict=True))
    return _told(about, table(list(shown), [*lines, [sums.get(name) for name in shown]], own=len(lines)))


def moulding_section(compared: Moulding | None, rows: Sequence[Row], spec: KitSpec) -> str:
    """How injection moulding compares with printing: by kits, then part by part; without prices what it would take."""
    printed = [row for row in rows if row.file]
    if compared is None:
        parts = sum(row.count for row in printed)
        return (
            f"<p>A kit has {parts} parts of {len(printed)} shapes, so it would take {len(printed)} moulds. Give "
            "<code>--price-per-kg</code> and <code>--mould-price</code>, and <code>--moulded-price-per-piece</code> "
            "if you know it, and the number of kits from which moulds pay stands here.</p>"
        )
    return f"<p>{_verdict(compared)}</p>{_by_kits(compared)}{_by_part(printed, spec)}"


def _verdict(compared: Moulding) -> str:
    kits = compared.break_even_kits
    if kits is None:
        return "Moulds never pay at these prices: a moulded kit costs no less than a printed one."
    of = f"{kits} kits" if kits > 1 else "the first kit"
    return f"<strong>Moulds pay from {of} on</strong>, that is {kits * compared.parts} parts."


def _by_kits(compared: Moulding) -> str:
    kits: list[int] = sorted({*KITS, compared.break_even_kits or KITS[0]})
    ways = (("printed", 0, 0.0, compared.printed_kit_cost),
            ("moulded", compared.moulds, compared.moulds_cost, compared.moulded_kit_cost))  # fmt: skip
    head = ("", "moulds", "for them, once", "each kit", *(f"{n} kit{'s' if n > 1 else ''}" for n in kits))
    lines = [
        (name, moulds, _money(once), _money(each), *(_money(once + n * each) for n in kits))
        for name, moulds, once, each in ways
    ]
    return _told("In the currency of the prices given; spares and rods left out.", table(head, lines))


def _by_part(printed: Sequence[Row], spec: KitSpec) -> str:
    head = ("part", "in a kit", "printed, each", "moulded, each", "its mould", "the mould pays from")
    lines = [
        (
            _named(row),
            row.count,
            _money(row.cost),
            _money(row.moulded_cost),
            _money(row.mould_cost),
            "never" if row.break_even_count is None else f"{row.break_even_count} copies",
        )
        for row in printed
    ]
    price = "" if spec.price_per_kg is None else f" Printing at {spec.price_per_kg:g} a kilogramme."
    return _told(f"Each mould for itself.{price}", table(head, lines))


def _told(about: str, rows: str) -> str:
    """A table that scrolls under words that do not."""
    return f'<p class="dim">{escape(about)}</p><div class="wide">{rows}</div>'


def _named(row: Row) -> Html:
    return Html((swatch(row.colour) if row.colour else "") + escape(row.part.replace("_", " ")))


def _described(row: Row) -> Html:
    """Its name, and its file or what to cut it to."""
    about = row.file
    if row.diameter is not None and row.length is not None:
        about = f"⌀ {row.diameter:g} mm, each cut to {row.length:g} mm"
        about += "" if row.total_length is None else f"; {row.total_length:.0f} mm in all, saw cuts apart"
    return Html(f"{_named(row)}<br><small>{escape(about)}</small>")


def _pictured(row: Row, pictures: Mapping[str, bytes]) -> Html:
    picture = pictures.get(row.file)
    if picture is None:
        return Html("")
    data = base64.b64encode(picture).decode("ascii")
    return Html(f'<img src="data:image/png;base64,{data}" alt="{escape(row.part)} from inside" height="72">')


def _sum(cells: Sequence[float | None]) -> float | None:
    """Of the cells that are filled; None where none is."""
    filled = [cell for cell in cells if cell is not None]
    return sum(filled) if filled else None


def _money(value: float | None) -> Figure | None:
    """Two digits after the point, three that count where it is less than 1."""
    if value is None:
        return None
    return Figure(f"{value:,.2f}" if value >= 1 or value == 0 else f"{value:.3g}")
