"""The command line: words and progress; the flags of a kit come from KitSpec. No geometry."""

import inspect
import json
import sys
import time
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import App, Group, Parameter
from rich.console import Console

from drkid import __version__
from drkid.errors import DrkidError, SpecError
from drkid.spec import KitSpec

if TYPE_CHECKING:
    from drkid.inspection import Inspection
    from drkid.kit import Kit
    from drkid.verification import Verification

STALLED = 3  # exit status: the kit is written, but the asked tolerance was not reached
INTERRUPTED = 130  # exit status after Ctrl-C, as shells have it
NOT_AS_STATED = 1  # exit status of `check` for a kit whose files do not bear out its numbers

app = App(
    name="drkid",
    version=__version__,
    help="Turn an organic 3D shape into a construction kit whose pieces come in very few identical shapes.",
)
out = Console()
err = Console(stderr=True)


def main() -> None:
    """Entry point: runs a command and turns errors into messages and exit statuses."""
    sys.exit(run(sys.argv[1:]))


def run(arguments: list[str]) -> int:
    """Run the command line; the exit status."""
    try:
        return int(app(arguments, result_action="return_value") or 0)
    except DrkidError as error:
        _tell(error)
        return error.exit_status
    except KeyboardInterrupt:
        err.print("interrupted; nothing was written")
        return INTERRUPTED
    except SystemExit as status:  # cyclopts has said what was wrong with the arguments
        return int(status.code or 0) if isinstance(status.code, int | None) else 2


def _tell(error: DrkidError) -> None:
    err.print(f"[bold red]error:[/] {_plain(error.problem)}", soft_wrap=True)
    for name, text in (("wanted", error.wanted), ("found", error.found), ("try", error.remedy)):
        if text:
            err.print(f"  [dim]{name}:[/] {_plain(text)}", soft_wrap=True)


def _plain(text: str) -> str:
    """Text in which rich sees no markup."""
    return text.replace("[", "\\[")


# ---- flags from KitSpec


def _spec_parameters() -> list[inspect.Parameter]:
    """One keyword for each field of KitSpec; None where it is not given."""
    found: list[inspect.Parameter] = []
    for order, (name, field) in enumerate(KitSpec.model_fields.items()):
        extra = field.json_schema_extra
        group = str(extra["group"]) if isinstance(extra, dict) else "Parameters"
        annotation: Any = str if name in ("spacing", "bed_mm") else field.annotation
        default = "" if field.default is None else f" [default: {_shown(field.default)}]"
        option = Parameter(
            help=f"{field.description}{default}", group=Group(group, sort_key=10 + order // 100), show_default=False
        )
        found.append(
            inspect.Parameter(
                name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=Annotated[annotation | None, option]
            )
        )
    return found


def _shown(value: object) -> str:
    return ",".join(f"{v:g}" for v in value) if isinstance(value, tuple) else str(value)


def _with_spec_flags(command: Callable[..., int]) -> Callable[..., int]:
    """Give a command, in place of its `**flags`, one flag for each parameter of a kit."""
    own = [p for p in inspect.signature(command).parameters.values() if p.kind is not inspect.Parameter.VAR_KEYWORD]
    parameters = [*own, *_spec_parameters()]
    command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    command.__annotations__ = {p.name: p.annotation for p in parameters} | {"return": int}
    return command


def _spec(file: Path | None, flags: dict[str, Any]) -> KitSpec:
    """Parameters of a file, then what was given on the command line over them."""
    values = {} if file is None else _spec_file(file)
    given = {name: value for name, value in flags.items() if value is not None}
    if "vertices" in given and "faces" not in given:
        values.pop("faces", None)
    if "faces" in given and "vertices" not in given:
        values.pop("vertices", None)
    return KitSpec.parse(values | given)


def _spec_file(path: Path) -> dict[str, Any]:
    try:
        text = path.read_text(encoding="utf-8")
        values = tomllib.loads(text) if path.suffix.lower() == ".toml" else json.loads(text)
    except (OSError, ValueError) as error:
        raise SpecError(
            f"{path} cannot be read",
            wanted="a kit.json, or a JSON or TOML file of parameters",
            found=str(error),
            remedy="drkid schema spec",
        ) from error
    if not isinstance(values, dict):
        raise SpecError(
            f"{path} holds no parameters", wanted="an object of names and values", found=type(values).__name__
        )
    return values["spec"] if isinstance(values.get("spec"), dict) else values


# ---- commands

Input = Annotated[
    Path | None,
    Parameter(
        help="Segmented volume (.mrc .map .nii .tif .nrrd .npy .zarr, gzipped too) or closed mesh (.stl .ply .obj .off "
        ".glb .3mf); the bundled cell nucleus when not given."
    ),
]
Json = Annotated[bool, Parameter(name="--json", negative=(), help="Print JSON for machines instead of text.")]
SpecFile = Annotated[
    Path | None,
    Parameter(help="Parameters from a kit.json (makes the same kit again), JSON or TOML; flags override."),
]


@app.command
@_with_spec_flags
def make(
    source: Annotated[Input, Parameter(name="INPUT")] = None,
    /,
    *,
    out_folder: Annotated[
        Path | None, Parameter(name="--out", help="Folder to write; named after the input when not given.")
    ] = None,
    force: Annotated[bool, Parameter(negative=(), help="Replace a kit folder that exists.")] = False,
    as_json: Json = False,
    spec_file: Annotated[SpecFile, Parameter(name="--spec")] = None,
    **flags: Any,
) -> int:
    """Make a kit: classes of identical pieces with pockets and hinges, ready to print.

    Examples:
        drkid make
        drkid make mitochondrion.nii.gz --faces 172 --classes 7 --out mito
        drkid make labels.tif --label 12 --size-mm 250 --process sla
        drkid make density.mrc --threshold 0.3 --spacing 5.7,5.7,5.7 --unit angstrom
    """
    spec = _spec(spec_file, flags)
    folder = out_folder if out_folder is not None else Path(f"{_stem(source)}-kit")
    from drkid.export import require_writable  # noqa: PLC0415 — after the arguments are known to be good
    from drkid.pipeline import make_kit  # noqa: PLC0415

    require_writable(folder, force)
    start = time.perf_counter()
    with StageLines(quiet=as_json) as lines:
        kit = make_kit(source, spec, lines.update)
        lines.update("export", "", 0.0)
        written = kit.write(folder, force=force)
        lines.update("export", "", 1.0)
    _report(kit, written, time.perf_counter() - start, as_json)
    return 0 if kit.decomposition.outcome.status == "converged" else STALLED


@app.command(name="inspect")
@_with_spec_flags
def inspect_(
    source: Annotated[Input, Parameter(name="INPUT")] = None, /, *, as_json: Json = False, **flags: Any
) -> int:
    """Tell what a file holds and what `make` would take of it, without making anything.

    Examples:
        drkid inspect labels.tif
        drkid inspect labels.tif --label 12 --json
    """
    spec = _spec(None, flags)
    from drkid.data import nucleus_path  # noqa: PLC0415
    from drkid.inspection import inspect_source  # noqa: PLC0415

    found = inspect_source(nucleus_path() if source is None else source, spec)
    if as_json:
        print(json.dumps(found.to_dict(), indent=1))
    else:
        _show_inspection(found)
    return 0


@app.command
def schema(what: Annotated[str, Parameter(help="kit: of kit.json; spec: of the parameters.")] = "kit", /) -> int:
    """Print a JSON Schema: of kit.json, or of the parameters of a kit."""
    if what == "spec":
        document = KitSpec.model_json_schema()
    elif what == "kit":
        from drkid.export.document import KitDocument  # noqa: PLC0415

        document = KitDocument.model_json_schema(by_alias=True)
    else:
        raise SpecError(f"there is no schema of {what}", wanted="kit or spec", found=what, remedy="drkid schema kit")
    print(json.dumps(document, indent=1))
    return 0


@app.command
def check(kit: Annotated[Path, Parameter(name="KIT", help="A kit folder.")], /, *, as_json: Json = False) -> int:
    """Re-read a kit folder and recompute its numbers; exit status 1 where a file does not bear them out."""
    from drkid.verification import verify_kit  # noqa: PLC0415

    found = verify_kit(kit)
    if as_json:
        checks = [{"name": c.name, "passed": c.passed, "detail": c.detail} for c in found.checks]
        print(json.dumps({"kit": str(kit), "passed": found.passed, "checks": checks}, indent=1))
    else:
        _show_verification(found)
    return 0 if found.passed else NOT_AS_STATED


def _stem(source: Path | None) -> str:
    if source is None:
        return "nucleus"
    name = source.name
    for suffix in (".gz", ".nii", ".ome", source.suffix):
        name = name.removesuffix(suffix) or name
    return Path(name).stem or "drkid"


# ---- words


class StageLines:
    """One line per stage on standard error, with a bar where it takes long and the time it took."""

    def __init__(self, *, quiet: bool) -> None:
        """Nothing is shown where `quiet`."""
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn  # noqa: PLC0415

        self._bars = Progress(
            TextColumn("{task.description:<11}"),
            BarColumn(bar_width=24),
            TimeElapsedColumn(),
            TextColumn("[dim]{task.fields[what]}"),
            console=err,
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
        self._bars.update(self._tasks[stage], completed=min(fraction, 1.0))
        if what or fraction < 1:
            self._bars.update(self._tasks[stage], what=_plain(what))


def _report(kit: "Kit", folder: Path, seconds: float, as_json: bool) -> None:
    metrics, outcome = kit.metrics, kit.decomposition.outcome
    if as_json:
        from drkid.export.kit_document import kit_document  # noqa: PLC0415

        document = kit_document(kit).model_dump(mode="json", by_alias=True, exclude_none=True)
        summary = {name: document[name] for name in ("source", "spec", "metrics", "outcome", "notes")}
        print(json.dumps({"folder": str(folder), "seconds": round(seconds, 3), **summary}, indent=1))
        return
    from rich.table import Table  # noqa: PLC0415

    size = " × ".join(f"{x:.0f}" for x in kit.decomposition.mesh.extents)
    table = Table(show_header=False, box=None, padding=(0, 2, 0, 0))
    for name, text in (
        ("pieces", f"{metrics.pieces} in {metrics.classes} classes, {metrics.unique_piece_parts} moulds"),
        ("error", f"max {metrics.error_max_percent:.3g} %, mean {metrics.error_mean_percent:.3g} % of the mean edge"),
        (
            "distance",
            f"{metrics.surface_assembled.mean_percent:.2g} % mean, {metrics.surface_assembled.max_percent:.2g} % max "
            "from the input (of its box's diagonal)",
        ),
        ("size", f"{size} mm, edges {metrics.mean_edge:.1f} mm, {kit.part_set.dimensions.thickness_mm:g} mm thick"),
        ("grooves", f"{metrics.groove_mean_mm:.2g} mm mean, {metrics.groove_max_mm:.2g} mm max"),
        ("solver", f"{outcome.status}: {outcome.message}"),
        ("time", f"{seconds:.1f} s"),
        ("kit", str(folder)),
    ):
        table.add_row(f"[bold]{name}", _plain(text))
    for note in kit.notes:
        out.print(f"[yellow]note:[/] {_plain(note)}", soft_wrap=True, highlight=False)
    out.print(table)


def _show_verification(found: "Verification") -> None:
    for one in found.checks:
        word = "[green]ok  [/]" if one.passed else "[bold red]FAIL[/]"
        out.print(f"{word} {_plain(one.name)}: {_plain(one.detail)}", soft_wrap=True, highlight=False)
    failed = sum(not one.passed for one in found.checks)
    out.print(f"{len(found.checks) - failed} of {len(found.checks)} checks passed")


def _show_inspection(found: "Inspection") -> None:
    raise NotImplementedError
