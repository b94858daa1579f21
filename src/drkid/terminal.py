"""What the command line says: progress lines, tables, errors."""

import json
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.table import Table

from drkid.errors import DrkidError

if TYPE_CHECKING:
    from pathlib import Path

    from drkid.inspection import Inspection
    from drkid.kit import AssemblyFigures, Kit, Metrics, Rigidity
    from drkid.verification import Verification

MOST_ROWS = 30  # of labels or components that a table shows
EXACT_PERCENT = 1e-6  # of the mean edge: what is left is rounding


def _out() -> Console:
    return Console(highlight=False)


def _err() -> Console:
    return Console(stderr=True, highlight=False)


def _plain(text: str) -> str:
    """Text in which rich sees no markup."""
    return text.replace("[", "\\[")


def tell_error(error: DrkidError) -> None:
    """What was wrong, wanted and found, and what to try, on standard error."""
    console = _err()
    console.print(f"[bold red]error:[/] {_plain(error.problem)}", soft_wrap=True)
    for name, text in (("wanted", error.wanted), ("found", error.found), ("try", error.remedy)):
        if text:
            console.print(f"  [dim]{name}:[/] {_plain(text)}", soft_wrap=True)


def tell_interrupted() -> None:
    """After Ctrl-C."""
    _err().print("interrupted; nothing was written")


def show_json(document: object) -> None:
    """A document for machines, alone on standard output."""
    print(json.dumps(document, indent=1))


class StageLines:
    """One line per stage on standard error, with a bar where it takes long and the time it took."""

    def __init__(self, *, quiet: bool) -> None:
        """Nothing is shown where `quiet`."""
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn  # noqa: PLC0415 — slow to import

        self._bars = Progress(
            TextColumn("{task.description:<11}"),
            BarColumn(bar_width=24),
            TimeElapsedColumn(),
            TextColumn("[dim]{task.fields[what]}"),
            console=_err(),
            disable=quiet,
        )
        self._tasks: dict[str, Any] = {}

    def __enter__(self) -> "StageLines":
        """Start drawing."""
        self._bars.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Stop drawing; the lines stay."""
        self._bars.stop()

    def update(self, stage: str, what: str, fraction: float) -> None:
        """Show how far a stage is."""
        if stage not in self._tasks:
            self._tasks[stage] = self._bars.add_task(stage, total=1.0, what="")
        self._bars.update(self._tasks[stage], completed=min(fraction, 1.0), what=_plain(what))


def show_kit(kit: "Kit", folder: "Path", seconds: float) -> None:
    """The notes, then a short table: what the kit is, how good it is, and where."""
    console, metrics = _out(), kit.metrics
    for note in kit.notes:
        console.print(f"[yellow]note:[/] {_plain(note)}", soft_wrap=True)
    for finding in kit.part_set.findings:
        if not finding.is_met:
            console.print(f"[bold red]warning:[/] {_plain(str(finding))}", soft_wrap=True)
    size = " × ".join(f"{x:.0f}" for x in kit.decomposition.mesh.extents)
    distance, outcome = metrics.surface_assembled, kit.decomposition.outcome
    rows = {
        "pieces": f"{metrics.pieces} in {metrics.classes} classes, {_moulds(metrics)}",
        "error": _error(metrics.error_max_percent, metrics.error_mean_percent),
        "d_H": f"{distance.mean_percent:.2g} % mean, {distance.max_percent:.2g} % max from the input, of its box",
        "size": f"{size} mm, edges {metrics.mean_edge:.1f} mm, {kit.part_set.dimensions.thickness_mm:g} mm thick",
        "grooves": f"{metrics.groove_mean_mm:.2g} mm mean, {metrics.groove_max_mm:.2g} mm max",
        "rigidity": _rigidity(metrics.rigidity, metrics.mean_edge),
        "assembly": _assembly(metrics.assembly),
        **_cost(kit),
        "solver": f"{outcome.status}: {outcome.message}",
        "time": f"{seconds:.1f} s",
        "kit": str(folder),
    }
    _show_rows(console, rows)


def _moulds(metrics: "Metrics") -> str:
    """How many printed shapes there are."""
    connectors = metrics.unique_connector_parts
    beside = f" and {connectors} of connectors" if connectors else ""
    return f"{metrics.unique_piece_parts} moulds{beside}"


def _cost(kit: "Kit") -> dict[str, str]:
    """What printing costs, and from how many kits on moulds pay; nothing without prices."""
    from drkid.export import kit_costs  # noqa: PLC0415 — slow to import

    cost, compared = kit_costs(kit)
    if cost is None:
        return {}
    text = f"{cost:.2f} printed"
    if compared is not None:
        text += f", {compared.moulded_kit_cost:.2f} moulded; {compared.moulds} moulds for {compared.moulds_cost:.2f} "
        kits = compared.break_even_kits
        text += "never pay" if kits is None else f"pay from {kits} kits on"
    return {"cost": text}


def _rigidity(found: "Rigidity | None", mean_edge_mm: float) -> str:
    """The word, and the figures that bear it out."""
    if found is None:
        return "not measured"
    text = f"{found.firmness}: {found.stiffness_percent:.2g} % of a round shell's stiffness"
    if found.second_state_percent is not None and found.barrier_percent is not None:
        text += (
            f", a second state {found.second_state_percent / 100 * mean_edge_mm:.2g} mm away"
            f" behind {found.barrier_percent / 100 * mean_edge_mm:.2g} mm of play"
        )
    return text


def _assembly(found: "AssemblyFigures | None") -> str:
    """The verdict, the figures that bear it out, and how the last piece goes in."""
    if found is None:
        return "not tried"
    closure, building, overlap = found.closure, found.building, found.overlap
    apart = "" if overlap is None else f"{overlap.pairs or 'no'} pairs of pieces overlap; "
    last = "the last piece goes in" if building.last_goes_in else "no piece goes in last"
    return (
        f"{closure.verdict}: gaps up to {closure.gaps.max_mm:.2g} of {closure.play_mm:.2g} mm, "
        f"drift {closure.drift.max_percent:.2g} % of the box; {apart}{last}"
    )


def _error(largest_percent: float, mean_percent: float) -> str:
    if largest_percent < EXACT_PERCENT:
        return f"exact: largest {largest_percent:.1g} % of the mean edge"
    return f"T {largest_percent:.3g} % (largest), {mean_percent:.3g} % mean, of the mean edge"


def show_verification(found: "Verification") -> None:
    """One line per check, then how many passed."""
    console = _out()
    for one in found.checks:
        word = "[green]ok  [/]" if one.passed else "[bold red]FAIL[/]"
        console.print(f"{word} {_plain(one.name)}: {_plain(one.detail)}", soft_wrap=True)
    failed = sum(not one.passed for one in found.checks)
    console.print(f"{len(found.checks) - failed} of {len(found.checks)} checks passed")


def show_inspection(found: "Inspection") -> None:
    """What the file holds, its labels and components, and what `make` would take."""
    console = _out()
    console.print(f"[bold]{_plain(found.name)}[/]", soft_wrap=True)
    _show_rows(console, _contents(found))
    if found.volume is not None and len(found.volume.labels) > 1:
        table = Table("label", "voxels", "from", "to", "border", title="labels", title_justify="left", box=None)
        for label in found.volume.labels[:MOST_ROWS]:
            table.add_row(
                str(label.label),
                str(label.voxels),
                _triple(label.first),
                _triple(label.last),
                _yes(label.touches_border),
            )
        console.print(table)
        _more(console, len(found.volume.labels))
    if found.components:
        table = Table("component", "voxels", "genus", "cavities", "border", title_justify="left", box=None)
        for one in found.components[:MOST_ROWS]:
            genus = "too small" if one.genus is None else str(one.genus)
            table.add_row(str(one.component), str(one.voxels), genus, str(one.cavities), _yes(one.touches_border))
        console.print(table)
        _more(console, found.component_count)
    console.print("[bold]make would take[/]")
    _show_rows(console, _taken(found))
    _show_distances(console, found)
    for note in found.notes:
        console.print(f"[yellow]note:[/] {_plain(note)}", soft_wrap=True)
    for warning in found.warnings:
        console.print(f"[bold red]warning:[/] {_plain(warning)}", soft_wrap=True)


def _show_distances(console: Console, found: "Inspection") -> None:
    if found.distances:
        console.print("[bold]expected distance from the surface[/] of the simplified mesh, in % of the box's diagonal")
        table = Table("faces", "mean %", "max %", box=None)
        for one in found.distances:
            table.add_row(str(one.faces), f"{one.mean_percent:.2g}", f"{one.max_percent:.2g}")
        console.print(table)
    if found.recommended is not None:
        best = found.recommended
        console.print(
            f"[bold]recommended[/]  --faces {best.faces}: {best.mean_percent:.2g} % mean, {best.max_percent:.2g} % max",
            soft_wrap=True,
        )


def _contents(found: "Inspection") -> dict[str, str]:
    unit = found.unit or "units"
    rows = {"format": found.format}
    volume, mesh = found.volume, found.mesh
    if volume is not None:
        rows["voxels"] = f"{_triple(volume.shape)} {volume.dtype}, {volume.kind}"
        rows["voxel size"] = f"{_triple(volume.spacing)} {unit}"
    if volume is not None and volume.density_range is not None:
        low, high = volume.density_range
        rows["densities"] = f"{low:.4g} to {high:.4g}, Otsu's threshold {volume.otsu_threshold:.4g}"
    if mesh is not None:
        closed = "closed" if mesh.closed else "open"
        rows["mesh"] = f"{mesh.vertices} vertices, {mesh.faces} faces, {closed}; bodies in the file: {mesh.bodies}"
    return rows


def _taken(found: "Inspection") -> dict[str, str]:
    taken, unit = found.taken, found.unit or "units"
    chosen = {"label": taken.label, "threshold": taken.threshold, "component": taken.component}
    rows = {name: f"{value:g}" for name, value in chosen.items() if value is not None}
    rows["genus"] = str(taken.genus)
    rows["size"] = f"{_triple(taken.extents)} {unit}"
    rows["surface"] = f"{taken.area:.4g} {unit}², volume {taken.volume:.4g} {unit}³"
    if taken.mean_edge is not None:
        rows["pieces"] = f"{taken.faces} ({taken.vertices} vertices), mean edge {taken.mean_edge:.4g} {unit}"
    if found.thickness is not None:
        rows["thickness"] = (
            f"{found.thickness.thin:.4g} {unit} at the thinnest 1 %, {found.thickness.typical:.4g} typical"
        )
    return rows


def show_picture(path: "Path", legend: str) -> None:
    """Where a picture is, and what its colours mean."""
    console = _out()
    console.print(_plain(str(path)), soft_wrap=True)
    if legend:
        console.print(_plain(legend), soft_wrap=True)


def _show_rows(console: Console, rows: dict[str, str]) -> None:
    """Names and texts in two columns; long texts, such as paths, are never cut."""
    width = max(map(len, rows))
    for name, text in rows.items():
        console.print(f"[bold]{name:<{width}}[/]  {_plain(text)}", soft_wrap=True)


def _triple(values: "tuple[float, ...]") -> str:
    return " × ".join(f"{v:.6g}" for v in values)


def _yes(value: bool) -> str:
    return "yes" if value else "no"


def _more(console: Console, count: int) -> None:
    if count > MOST_ROWS:
        console.print(f"… and {count - MOST_ROWS} more (--json lists them)")
