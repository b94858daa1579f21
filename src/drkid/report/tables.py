"""Tables of the report as HTML; every text is escaped."""

import base64
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from html import escape
from importlib.resources import files
from typing import Any

from drkid.export.bill_of_materials import Row
from drkid.export.colour import class_colour
from drkid.export.document import DistanceDocument, KitDocument

PAPER_COLUMNS = ("", "pieces", "classes", "largest error %", "mean error %", "d(Mi, Ms) %", "d(Ms, Mf) %",
                 "d(Mi, Mf) %", "seconds", "iterations")  # fmt: skip


def table(head: Sequence[str], rows: Sequence[Sequence[object]], own: int | None = None) -> str:
    """A table; cells that are numbers stand to the right, cells of `Html` are put in as they are."""
    top = "".join(f'<th scope="col">{escape(h)}</th>' for h in head)
    kinds = [' class="own"' if i == own else "" for i in range(len(rows))]
    lines = [f"<tr{kind}>{''.join(map(_cell, row))}</tr>" for kind, row in zip(kinds, rows, strict=True)]
    return f"<table><thead><tr>{top}</tr></thead><tbody>{''.join(lines)}</tbody></table>"


class Html(str):
    """Text that is HTML already."""

    __slots__ = ()


def _cell(value: object) -> str:
    if isinstance(value, Html):
        return f"<td>{value}</td>"
    if isinstance(value, float | int):
        return f'<td class="n">{number(value)}</td>'
    return f"<td>{escape('' if value is None else str(value))}</td>"


def number(value: float) -> str:
    """A figure as people read it: whole, or with three digits that count."""
    if isinstance(value, int) or value == round(value, 9) == int(value):
        return f"{int(value)}"
    return f"{value:.4g}" if abs(value) < 1000 else f"{value:.0f}"


def swatch(colour: str) -> Html:
    """A little square of a colour."""
    return Html(f'<span class="swatch" style="background:{escape(colour)}"></span>')


def classes_table(document: KitDocument) -> str:
    """Every class: its colour, how many pieces of which file, and its sides."""
    rows = [
        (
            Html(swatch(class_colour(i)) + escape(one.id)),
            one.count,
            ", ".join(f"{part.count} × {part.file}" for part in one.parts),
            ", ".join(f"{length:.2f}" for length in one.edge_lengths),
            "one shape" if one.mirror_symmetric else "mirror images differ",
        )
        for i, one in enumerate(document.classes)
    ]
    return table(("class", "pieces", "files", "sides in mm", "mirror image"), rows)


def parts_table(rows: Sequence[Row], pictures: Mapping[str, bytes]) -> str:
    """The parts list, with those columns that say something and the pictures of the parts, PNG by file."""
    plain = [asdict(row) for row in rows]
    names = [name for name in plain[0] if any(row[name] not in (None, "") for row in plain)] if plain else []
    cells = [[_pictured(row, pictures), *(_coloured(name, row[name]) for name in names)] for row in plain]
    return table(["", *(name.replace("_", " ").replace("mm3", "mm³") for name in names)], cells)


def _pictured(row: dict[str, Any], pictures: Mapping[str, bytes]) -> Html:
    picture = pictures.get(row["file"])
    if picture is None:
        return Html("")
    data = base64.b64encode(picture).decode("ascii")
    return Html(f'<img src="data:image/png;base64,{data}" alt="{escape(row["part"])} from inside" height="72">')


def _coloured(name: str, value: Any) -> object:
    return Html(swatch(value) + escape(value)) if name == "colour" and isinstance(value, str) else value


def paper_table(document: KitDocument) -> str:
    """This kit's row, then the paper's table."""
    metrics, distances = document.metrics, document.metrics.hausdorff
    own: list[object] = [
        "this kit", metrics.pieces, metrics.classes, metrics.error_max_percent, metrics.error_mean_percent,
        _pair(distances.surface_simplified), _pair(distances.simplified_assembled),
        _pair(distances.surface_assembled), round(sum(metrics.seconds.values()), 1), metrics.iterations,
    ]  # fmt: skip
    text = (files("drkid.report") / "paper_table.toml").read_text(encoding="utf-8")
    theirs = [
        [
            f"paper, {row['model']}", row["faces_final"], row["classes"], row["tolerance_percent"],
            row["error_mean_percent"], *("{:.3g} / {:.3g}".format(*row[f"{pair}_percent"]) for pair in
            ("surface_simplified", "simplified_assembled", "surface_assembled")), row["seconds"], row["iterations"],
        ]
        for row in tomllib.loads(text)["row"]
    ]  # fmt: skip
    return table(PAPER_COLUMNS, [own, *theirs], own=0)


def _pair(distance: DistanceDocument) -> str:
    return f"{distance.mean_percent:.3g} / {distance.max_percent:.3g}"


def metrics_table(document: KitDocument) -> str:
    """Every figure of kit.json, with its name there."""
    plain = document.metrics.model_dump(mode="json", exclude_none=True)
    return table(("figure", "value"), list(_flat("", plain)))


def _flat(path: str, value: Any) -> list[tuple[str, object]]:
    if not isinstance(value, dict):
        return [(path, value)]
    inner = value.items()
    return [row for name, one in inner for row in _flat(f"{path} {name}".strip().replace("_", " "), one)]
