"""Tables of the report as HTML; every text is escaped."""

import tomllib
from collections.abc import Sequence
from html import escape
from importlib.resources import files
from typing import Any

from drkid.export.colour import class_colour
from drkid.export.document import ClassDocument, DistanceDocument, KitDocument

PAPER_COLUMNS = ("", "pieces", "classes", "largest error %", "mean error %", "d(Mi, Ms) %", "d(Ms, Mf) %",
                 "d(Mi, Mf) %", "seconds", "iterations")  # fmt: skip
EXACT_PERCENT = 1e-6  # an error below is rounding
LEAST_GAP_MM = 1e-3  # a gap below is none
NUMERIC = ' class="n"'


def table(head: Sequence[str], rows: Sequence[Sequence[object]], own: int | None = None) -> str:
    """A table; cells that are numbers stand to the right, cells of `Html` are put in as they are.

    `own` is the row that is marked.
    """
    figures = [any(_is_figure(row[i]) for row in rows) for i in range(len(head))]
    top = "".join(
        f'<th scope="col"{NUMERIC if figure else ""}>{escape(h)}</th>' for h, figure in zip(head, figures, strict=True)
    )
    kinds = [' class="own"' if i == own else "" for i in range(len(rows))]
    lines = [f"<tr{kind}>{''.join(map(_cell, row))}</tr>" for kind, row in zip(kinds, rows, strict=True)]
    return f"<table><thead><tr>{top}</tr></thead><tbody>{''.join(lines)}</tbody></table>"


class Html(str):
    """Text that is HTML already."""

    __slots__ = ()


class Figure(str):
    """A number that is text already."""

    __slots__ = ()


def _is_figure(value: object) -> bool:
    return isinstance(value, float | int | Figure) and not isinstance(value, bool)


def _cell(value: object) -> str:
    if isinstance(value, Html):
        return f"<td>{value}</td>"
    if isinstance(value, bool):
        return f"<td>{'yes' if value else 'no'}</td>"
    if _is_figure(value):
        return f"<td{NUMERIC}>{number(value) if isinstance(value, float | int) else value}</td>"
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
    """Every class: its colour, how many pieces of which file, and its sides, those of merged pieces in their order."""
    rows = [
        (
            Html(swatch(class_colour(i)) + escape(one.id)),
            one.count,
            ", ".join(f"{part.count} × {part.file}" for part in one.parts),
            _sides(document, one),
            "one shape" if one.mirror_symmetric else "mirror images differ",
        )
        for i, one in enumerate(document.classes)
    ]
    return table(("class", "pieces", "files", "sides in mm", "mirror image"), rows)


def _sides(document: KitDocument, one: ClassDocument) -> str:
    if document.is_merged:
        return ", ".join(f"{number}: {length:.2f}" for number, length in enumerate(one.parts[0].side_lengths, 1))
    return ", ".join(f"{length:.2f}" for length in one.edge_lengths)


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


def summary_table(document: KitDocument) -> str:
    """What the kit is and how good it is, in words."""
    metrics, found = document.metrics, document.metrics.assembly
    near, bends, groove = metrics.hausdorff.surface_assembled, metrics.dihedral, metrics.groove
    connectors = metrics.unique_connector_parts
    rows = {
        "pieces": f"{metrics.pieces} in {_many(metrics.classes, 'class', 'es')}, "
        f"{_many(metrics.unique_piece_parts, 'mould')}" + (f" and {connectors} of connectors" if connectors else ""),
        "error of a piece": ("exact: " if metrics.error_max_percent < EXACT_PERCENT else "")
        + f"{metrics.error_max_percent:.2g} % of the mean edge at most, {metrics.error_mean_percent:.2g} % in the mean",
        "distance to the surface": f"{near.mean_percent:.2g} % mean, {near.max_percent:.2g} % at most, of its box's "
        "diagonal",
        "bends at joints": f"{bends.mean_degrees:.1f}° mean, 95 of 100 below {bends.p95_degrees:.1f}°; "
        f"{bends.concave_percent:.0f} % are concave",
        "grooves": f"{groove.mean_mm:.2g} mm mean, {groove.max_mm:.2g} mm at most",
        "edges": f"{metrics.mean_edge:.1f} mm in the mean; pieces {document.spec['thickness_mm']:g} mm thick",
    }
    if metrics.rigidity is not None:
        stiff = metrics.rigidity
        rows["rigidity"] = f"{stiff.firmness}: {stiff.stiffness_percent:.2g} % of a round shell's stiffness"
    if found is not None:
        gap = found.closure.gaps.max_mm
        rows["assembly"] = (
            f"{found.closure.verdict}: gaps of {gap if gap > LEAST_GAP_MM else 0:.2g} mm at most, with "
            f"{found.closure.play_mm:.2g} mm of play; "
            + ("the last piece goes in" if found.building.last_goes_in else "no piece goes in last")
        )
    return table(("what", "how it is"), list(rows.items()))


def _many(count: int, word: str, ending: str = "s") -> str:
    return f"{count} {word}{ending if count != 1 else ''}"


def metrics_table(document: KitDocument) -> str:
    """Every figure of kit.json, with its name there."""
    plain = document.metrics.model_dump(mode="json", exclude_none=True)
    return table(("figure", "value"), list(_flat("", plain)))


def _flat(path: str, value: Any) -> list[tuple[str, object]]:
    """A row for each figure within; lists of figures stand in one row, lists of objects are numbered."""
    if isinstance(value, dict):
        named = list(value.items())
    elif isinstance(value, list) and any(isinstance(one, dict) for one in value):
        named = [(str(number), one) for number, one in enumerate(value, 1)]
    else:
        return [(path, ", ".join(map(str, value)) if isinstance(value, list) else value)]
    return [row for name, one in named for row in _flat(f"{path} {name}".strip().replace("_", " "), one)]
