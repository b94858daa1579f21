"""The commands of the command line; the flags of a kit come from KitSpec. No geometry."""

import inspect
import json
import time
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Group, Parameter

from drkid.errors import KitFolderError, SpecError
from drkid.spec import KitSpec
from drkid.terminal import StageLines, show_inspection, show_json, show_kit, show_picture, show_verification

PALETTE = {"palette", "like", "multisets"}  # lengths and triangles from outside
MOST_EXPLODED = 10.0  # times the distance to the middle; pieces are specks beyond it
STALLED = 3  # exit status: the kit is written, but the asked tolerance was not reached
NOT_AS_STATED = 1  # exit status of `check` for a kit whose files do not bear out its numbers
ALIASES = {"bed_mm": "--bed"}  # shorter names of flags
TYPED_AS_TEXT = ("spacing", "bed_mm", "palette", "bevel_degrees", "spares")  # lists, which a person types as one word
NOT_TYPED = ("process_values",)  # written to kit.json and read from it, but no flag
FROM_PROCESS = {  # what kit.json has because of its process
    "process_values",
    "clearance_mm",
    "rod_clearance_mm",
    "rod_diameter_mm",
    "knuckles",
    "min_wall_mm",
    "knuckle_wall_mm",
    "mark_depth_mm",
    "thickness_mm",
}
SCALES = {"size_mm", "mean_edge_mm", "fit"}  # one of them at a time
GROUPS = ("Input", "Mesh", "Congruence", "Pieces", "Patches", "Output")  # in the order in which help shows them

# ---- flags from KitSpec


def _spec_parameters() -> list[inspect.Parameter]:
    """One keyword for each field of KitSpec; None where it is not given."""
    found: list[inspect.Parameter] = []
    for name, field in KitSpec.model_fields.items():
        if name in NOT_TYPED:
            continue
        extra = field.json_schema_extra
        group = str(extra["group"]) if isinstance(extra, dict) else GROUPS[0]
        annotation: Any = str if name in TYPED_AS_TEXT else field.annotation
        default = "" if field.default is None else f" [default: {_shown(field.default)}]"
        option = Parameter(
            help=f"{field.description}{default}",
            group=Group(group, sort_key=GROUPS.index(group)),
            show_default=False,
            alias=ALIASES.get(name),
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
    replaced = _replaced(values, given)
    return KitSpec.parse({name: value for name, value in values.items() if name not in replaced} | given)


def _replaced(values: dict[str, Any], given: dict[str, Any]) -> set[str]:
    """Parameters of a file that no longer hold because a flag takes their place, or what follows from them changes."""
    replaced = {"vertices"} if "faces" in given else {"faces"} if "vertices" in given else set[str]()
    replaced |= _chosen_for_the_method(values, given) | _chosen_for_the_pieces(values, given)
    if "classes" in given:
        replaced.add("multisets")
    if "seconds" in given:
        replaced.add("rounds")
    replaced |= {"printer", "bed_mm"} if given.keys() & {"printer", "bed_mm"} else set()
    if given.get("method", "palette") != "palette":
        return replaced | PALETTE
    if given.keys() & {"palette", "like"}:
        replaced |= {*PALETTE, "method", "classes", "size_mm", "bevel_degrees"}
    elif "multisets" in given:
        replaced |= {"method", "classes"}
    lengths_given = any((values | given).get(name) is not None for name in ("palette", "like"))
    if lengths_given and "size_mm" in given and not given.keys() & {"faces", "vertices"}:
        replaced |= {"faces", "vertices"}
    return replaced


def _chosen_for_the_method(values: dict[str, Any], given: dict[str, Any]) -> set[str]:
    """What a file that names its method, as a kit.json does, has for that method alone, if a flag asks for another."""
    own = values.get("method")
    asked = given.get("method", "palette" if given.keys() & PALETTE else own)
    return {"classes", "tolerance_percent", "rounds"} if own not in (None, asked) else set()


def _chosen_for_the_pieces(values: dict[str, Any], given: dict[str, Any]) -> set[str]:
    """What a file has for its own process or scale, if a flag asks for another."""
    replaced = set(SCALES) if given.keys() & SCALES else set[str]()
    if "process" in values and given.get("process", values["process"]) != values["process"]:
        replaced |= FROM_PROCESS
    if given.get("connector", values.get("connector")) != values.get("connector"):
        replaced |= {"rod_diameter_mm", "knuckles", "thickness_mm"}
    return replaced


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
        drkid make mitochondrion.nii.gz --faces 172 --seconds 30 --out mito
        drkid make mitochondrion.nii.gz --method pressure --classes 7
        drkid make labels.tif --label 12 --size-mm 250 --process sla
        drkid make vesicle.mrc --palette universal --size-mm 300
        drkid make other.stl --like mito --out other
        drkid make density.mrc --threshold 0.3 --spacing 5.7,5.7,5.7 --unit angstrom
    """
    spec = _spec(spec_file, flags)
    folder = out_folder if out_folder is not None else Path(f"{_stem(source)}-kit")
    from drkid.export import kit_summary, require_writable  # noqa: PLC0415 — after the arguments are known to be good
    from drkid.pipeline import make_kit  # noqa: PLC0415

    require_writable(folder, force)
    start = time.perf_counter()
    with StageLines(quiet=as_json) as lines:
        kit = make_kit(source, spec, lines.update)
        written = kit.write(folder, force=force, progress=lines.update)
    seconds = time.perf_counter() - start
    if as_json:
        show_json({"folder": str(written), "seconds": round(seconds, 3), **kit_summary(kit)})
    else:
        show_kit(kit, written, seconds)
    return 0 if kit.decomposition.outcome.status == "converged" else STALLED


@_with_spec_flags
def inspect_source(
    source: Annotated[Input, Parameter(name="INPUT")] = None,
    /,
    *,
    for_distance_percent: Annotated[
        float | None,
        Parameter(
            help="Mean distance of the simplified mesh from the surface, in percent of the box's diagonal: recommend "
            "the number of faces that it needs."
        ),
    ] = None,
    as_json: Json = False,
    **flags: Any,
) -> int:
    """Tell what a file holds and what `make` would take of it, without making anything.

    Examples:
        drkid inspect mitochondrion.nii.gz --for-distance-percent 0.5
        drkid inspect labels.tif
        drkid inspect labels.tif --label 12 --json
    """
    spec = _spec(None, flags)
    from drkid import inspection  # noqa: PLC0415
    from drkid.data import nucleus_path  # noqa: PLC0415

    if for_distance_percent is not None and not for_distance_percent > 0:
        raise SpecError("for-distance-percent cannot be used", wanted="above 0", found=f"{for_distance_percent:g}")
    path = nucleus_path() if source is None else source
    found = inspection.inspect_source(path, spec, for_distance_percent)
    if as_json:
        show_json(found.to_dict())
    else:
        show_inspection(found)
    return 0


def schema(what: Annotated[str, Parameter(help="kit: of kit.json; spec: of the parameters.")] = "kit", /) -> int:
    """Print a JSON Schema: of kit.json, or of the parameters of a kit."""
    if what == "spec":
        document = KitSpec.model_json_schema()
    elif what == "kit":
        from drkid.export.document import KitDocument  # noqa: PLC0415

        document = KitDocument.model_json_schema(by_alias=True)
    else:
        raise SpecError(f"there is no schema of {what}", wanted="kit or spec", found=what, remedy="drkid schema kit")
    show_json(document)
    return 0


def check(kit: Annotated[Path, Parameter(name="KIT", help="A kit folder.")], /, *, as_json: Json = False) -> int:
    """Re-read a kit folder and recompute its numbers; exit status 1 where a file does not bear them out."""
    from drkid.verification import verify_kit  # noqa: PLC0415

    found = verify_kit(kit)
    if as_json:
        checks = [{"name": c.name, "passed": c.passed, "detail": c.detail} for c in found.checks]
        show_json({"kit": str(kit), "passed": found.passed, "checks": checks})
    else:
        show_verification(found)
    return 0 if found.passed else NOT_AS_STATED


def render(
    kit: Annotated[Path, Parameter(name="KIT", help="A kit folder.")],
    /,
    *,
    out: Annotated[Path | None, Parameter(name="--out", help="PNG file; named after the kit when not given.")] = None,
    explode: Annotated[float, Parameter(help="Move pieces apart by this share of their distance to the middle.")] = 0.0,
    view: Annotated[
        str,
        Parameter(
            help="broad (the longest two axes), front, back, left, right, top, bottom, corner, or AZIMUTH,ELEVATION."
        ),
    ] = "broad",
    size: Annotated[str, Parameter(help="WIDTH or WIDTHxHEIGHT in pixels.")] = "1200",
    colour: Annotated[
        Literal["class", "error", "dihedral", "distance"],
        Parameter(help="Class, or a figure of each piece: its error, its sharpest joint, its distance to the surface."),
    ] = "class",
    surface: Annotated[bool, Parameter(negative=(), help="Lay the input's surface over the pieces.")] = False,
) -> int:
    """Draw a kit folder as a PNG picture; needs neither a display nor a GPU.

    Examples:
        drkid render nucleus-kit
        drkid render nucleus-kit --explode 0.4 --view corner --out apart.png
        drkid render nucleus-kit --colour distance --surface --size 1600x900
    """
    path = out if out is not None else Path(f"{kit.resolve().name}.png")
    if path.suffix.lower() != ".png":
        raise SpecError(f"{path} cannot be written", wanted="a .png file", found=path.suffix or "no suffix")
    if not 0 <= explode <= MOST_EXPLODED:
        raise SpecError("explode cannot be used", wanted=f"0 to {MOST_EXPLODED:g}", found=f"{explode:g}")
    from drkid.report import draw_kit  # noqa: PLC0415 — after the arguments are known to be good

    picture, legend = draw_kit(kit, view=view, size=size, explode=explode, by=colour, surface=surface)
    try:
        path.write_bytes(picture)
    except OSError as error:
        raise KitFolderError(
            f"{path} cannot be written",
            wanted="a folder that exists",
            found=str(error.strerror),
            remedy="another --out",
        ) from error
    show_picture(path, legend)
    return 0


def _stem(source: Path | None) -> str:
    if source is None:
        return "nucleus"
    name = source.name
    for suffix in (".gz", ".nii", ".ome", source.suffix):
        name = name.removesuffix(suffix) or name
    return Path(name).stem or "drkid"
