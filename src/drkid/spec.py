"""KitSpec: every parameter with unit, default, limits and help. Flags, JSON Schema and documents come from it."""

from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal, cast, get_args

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from drkid.errors import SpecError
from drkid.process import PROCESSES, ProcessPreset, is_process_file, read_process

Method = Literal["pressure", "palette"]
Thickening = Literal["bisector", "flippable", "mean_normal", "perpendicular"]
ConnectorKind = Literal["hinge", "snap", "box", "none"]
Retention = Literal["detent", "glue"]
Unit = Literal["angstrom", "nm", "um", "mm"]
Paper = Literal["a4", "a3", "a2", "a1", "a0", "letter", "tabloid"]
Printer = Literal[
    "bambu-a1", "bambu-a1-mini", "bambu-x1", "creality-k1", "ender-3", "formlabs-form3", "formlabs-form4",
    "prusa-core-one", "prusa-mini", "prusa-mk4", "prusa-xl", "ultimaker-s5",
]  # fmt: skip

PRINTERS: dict[Printer, tuple[float, float, float]] = {
    "bambu-a1": (256.0, 256.0, 256.0),
    "bambu-a1-mini": (180.0, 180.0, 180.0),
    "bambu-x1": (256.0, 256.0, 256.0),
    "creality-k1": (220.0, 220.0, 250.0),
    "ender-3": (220.0, 220.0, 250.0),
    "formlabs-form3": (145.0, 145.0, 185.0),
    "formlabs-form4": (200.0, 125.0, 210.0),
    "prusa-core-one": (250.0, 220.0, 270.0),
    "prusa-mini": (180.0, 180.0, 180.0),
    "prusa-mk4": (250.0, 210.0, 220.0),
    "prusa-xl": (360.0, 360.0, 360.0),
    "ultimaker-s5": (330.0, 240.0, 300.0),
}
"""Build volumes X, Y, Z in mm, as their makers state them."""
PatchKind = Literal["flat", "curved"]
CurvedKind = Literal["canonical", "published"]
Merge = Literal[2, 5, 6, 7]

DEFAULT_FACES = 172  # the size of the paper's printed mitochondrion (table 1, M4)
PRESSURE_CLASSES = 7  # of the same print
MOST_WALKED_FACES = 800  # up to here exactness is sought, beyond it a tolerance is kept
EXACT_TOLERANCE, LARGE_TOLERANCE, PRESSURE_TOLERANCE = 0.1, 1.0, 1.5  # in percent of the mean edge

UNIVERSAL = (35.0, 41.0)
"""Two edge lengths in mm of which every organic shape can be built: ratio 1.17, room for every process's connectors."""

UNIVERSAL_BEVEL = (100.0, 117.0)
"""Concave and convex bends in degrees that pieces of given lengths are bevelled for: they then fit any shape."""

FOLLOWING = ("bisector", "flippable")  # thickenings whose bevels follow the bends of the surface
LEAST_RATIO, MOST_RATIO = 1.03, 1.6  # of given lengths: nearer ones are one length to a hand, others make slivers
MOST_CLASSES = {2: 4, 3: 10}  # of a palette of two or three lengths
DEPTHS, PUBLISHED_CLASSES = 2, 6  # curved shapes a class of triangles; the paper's number of curved classes
MULTISETS = {1: "ssl", 2: "ssl,sll", 3: "sss,ssl,sll", 4: "sss,ssl,sll,lll"}  # of two lengths, by number of classes


def _split_commas(value: object) -> object:
    """'16,16,15' or '220x220x250' as a list: how a triple is typed on a command line."""
    return value.lower().replace("x", ",").split(",") if isinstance(value, str) else value


def _lengths(value: object) -> object:
    """'30,35.1' or 'universal' as lengths in mm."""
    if not isinstance(value, str):
        return value
    if value.strip().lower() == "universal":
        return UNIVERSAL
    try:
        return [float(word) for word in value.split(",")]
    except ValueError:
        message = "the word universal, or two or three lengths in mm such as 30,35.1"
        raise ValueError(message) from None


def _distinct(lengths: tuple[float, ...]) -> tuple[float, ...]:
    if len(lengths) not in MOST_CLASSES:
        message = f"two or three lengths in mm, not {len(lengths)}"
        raise ValueError(message)
    near = any(b < LEAST_RATIO * a for a, b in pairwise(lengths))
    if near or lengths[-1] > MOST_RATIO * lengths[0]:
        message = (
            f"ascending lengths, each at least {LEAST_RATIO:g} times the one before "
            f"and none more than {MOST_RATIO:g} times the first"
        )
        raise ValueError(message)
    return lengths


def letters_of(words: tuple[str, ...]) -> str:
    """The letters that name the lengths of a palette, ascending: 'sl' or 'abc'."""
    return "sl" if set("".join(words)) <= set("sl") else "abc"


def multiset_words(text: str) -> tuple[str, ...]:
    """Words such as 'ssl,sll' or 'aab,abc,bcc': each once, its letters and the words in ascending order of length.

    Raises:
        ValueError: a word is not three letters of s and l or of a, b, c; says what is wanted.
    """
    words = [word.strip().lower() for word in text.split(",") if word.strip()]
    letters = letters_of(tuple(words))
    if not words or any(len(word) != 3 or not set(word) <= set(letters) for word in words):
        message = "words of three letters, all of s and l or all of a, b and c, separated by commas"
        raise ValueError(message)
    ranks = sorted({tuple(sorted(letters.index(c) for c in word)) for word in words})
    return tuple("".join(letters[i] for i in rank) for rank in ranks)


def _multisets(text: str) -> str:
    words = multiset_words(text)
    missing = sorted(set(letters_of(words)) - set("".join(words)))
    if missing:
        message = f"words in which each length occurs; {' and '.join(missing)} does not"
        raise ValueError(message)
    return ",".join(words)


def _number_as_text(value: object) -> object:
    return str(value) if isinstance(value, int) else value


def _spares(text: str) -> str:
    """'5%' or '12', without spaces."""
    word = text.replace(" ", "")
    try:
        sound = 0 <= float(word.removesuffix("%")) < float("inf") if word.endswith("%") else int(word) >= 0
    except ValueError:
        sound = False
    if not sound:
        message = "a whole number of spares of each part, or a percentage such as 5%"
        raise ValueError(message)
    return word


Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Bend = Annotated[float, Field(ge=0, le=130)]
Bends = Annotated[tuple[Bend, Bend], BeforeValidator(_split_commas)]
Lengths = Annotated[tuple[Positive, ...], BeforeValidator(_lengths), AfterValidator(_distinct)]
Multisets = Annotated[str, AfterValidator(_multisets)]
Triple = Annotated[tuple[Positive, Positive, Positive], BeforeValidator(_split_commas)]
Spares = Annotated[str, BeforeValidator(_number_as_text), AfterValidator(_spares)]
Price = Annotated[float | None, Field(ge=0, allow_inf_nan=False)]


def _field(default: object, group: str, text: str, **limits: Any) -> Any:
    return Field(default=default, description=text, json_schema_extra={"group": group}, **limits)


class KitSpec(BaseModel):
    """All parameters of a kit. `None` means: chosen automatically, and written into kit.json as chosen.

    Raises:
        SpecError: through `parse`, where a value is outside its limits or two parameters contradict each other.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    label: int | None = _field(None, "Input", "Label to take from a label volume; the largest one when not given.")
    threshold: float | None = _field(
        None, "Input", "Density at and above which a voxel is inside; Otsu's threshold when not given."
    )
    component: int | None = _field(
        None, "Input", "Connected component to take, 1 being the largest; the largest when not given.", ge=1
    )
    spacing: Triple | None = _field(None, "Input", "Voxel size X,Y,Z, instead of the file's.")
    unit: Unit | None = _field(None, "Input", "Unit of voxel size or mesh coordinates, instead of the file's.")
    smooth: bool = _field(True, "Input", "Remove the staircase of voxels; nothing moves by more than one voxel.")
    max_genus: int | None = _field(
        None,
        "Input",
        "Most handles that the surface may have: the smallest beyond are closed and told; all are kept when not given.",
        ge=0,
    )

    faces: int | None = _field(
        None, "Mesh", f"Number of pieces: faces of the simplified mesh ({DEFAULT_FACES} when neither is given).", ge=4
    )
    vertices: int | None = _field(None, "Mesh", "Number of vertices of the simplified mesh, in place of --faces.", ge=4)
    lloyd_iterations: int = _field(5, "Mesh", "Lloyd iterations of the Voronoi remeshing.", ge=0, le=1000)
    newton_iterations: int = _field(30, "Mesh", "Quasi-Newton (L-BFGS) iterations that follow.", ge=0, le=10000)
    adapt: float = _field(
        0.0,
        "Mesh",
        "How much shorter edges are where the surface bends more: 0 all alike, which a kit of few shapes wants; 1 "
        "each as long as the same distance from the surface allows.",
        ge=0,
        le=1,
    )

    classes: int = _field(2, "Congruence", "Number k of classes of identical pieces; 7 with --method pressure.", ge=1)
    method: Method = _field(
        "palette",
        "Congruence",
        "Solver: palette (exact, up to 10 classes), or pressure (the paper's, any number of classes).",
    )
    palette: Lengths | None = _field(
        None,
        "Congruence",
        "Two or three edge lengths in mm, such as 30,35.1, that the pieces are to have exactly; or universal "
        f"({', '.join(f'{x:g}' for x in UNIVERSAL)}), one pair for every shape.",
    )
    like: Path | None = _field(
        None, "Congruence", "Kit folder or kit.json whose edge lengths and triangles the pieces are to have."
    )
    multisets: Multisets | None = _field(
        None, "Congruence", "Triangles by their lengths, short and long: ssl,sll; of three lengths: aab,abc,bcc."
    )
    tolerance_percent: float | None = _field(
        None,
        "Congruence",
        "Largest error of a piece that counts as converged, in percent of the mean edge; when not given "
        f"{EXACT_TOLERANCE:g}, {LARGE_TOLERANCE:g} above {MOST_WALKED_FACES} faces, {PRESSURE_TOLERANCE:g} with "
        "--method pressure.",
        gt=0,
    )
    seconds: float | None = _field(
        None, "Congruence", "Time for the palette solver; by the number of faces when not given.", gt=0
    )
    rounds: int | None = _field(
        None, "Congruence", "Rounds of the palette solver in place of a time: the same rounds make the same kit.", ge=0
    )
    weight_mean: float = _field(1.0, "Congruence", "Weight of the mean distance in choosing an exact mesh.", ge=0)
    weight_max: float = _field(1.0, "Congruence", "Weight of the largest distance.", ge=0)
    weight_dihedral: float = _field(0.5, "Congruence", "Weight of dihedral angles beyond the surface's own.", ge=0)
    weight_concave: float = _field(0.25, "Congruence", "Weight of concave edges beyond the surface's own.", ge=0)
    limit: float = _field(
        0.25, "Congruence", "How far a vertex may leave the surface, in mean edges (pressure solver).", gt=0, le=2
    )
    max_iterations: int = _field(20000, "Congruence", "Iterations after which the solver stops.", ge=1)
    iterations_per_clustering: int = _field(
        100, "Congruence", "Iterations from one k-means clustering to the next (pressure solver).", ge=1
    )
    kmeans_restarts: int = _field(8, "Congruence", "Starts of k-means, of which the best is kept.", ge=1, le=1000)
    seed: int = _field(0, "Congruence", "Seed of every random choice: the same seed makes the same kit.", ge=0)

    process: str = _field(
        "fdm",
        "Pieces",
        f"Manufacturing process: sets clearances, walls and rods; {', '.join(PROCESSES)}, or a TOML file of your own.",
    )
    size_mm: float | None = _field(
        None,
        "Pieces",
        "Longest side of the printed object; the smallest that fits when neither this nor --mean-edge-mm is given.",
        gt=0,
    )
    thickness_mm: float | None = _field(None, "Pieces", "Thickness of the pieces.", gt=0)
    thickening: Thickening = _field(
        "bisector",
        "Pieces",
        "How the sides are bevelled: bisector cannot collide; flippable cannot either and is the same from both faces; "
        "mean_normal is the paper's; perpendicular is not at all.",
    )
    connector: ConnectorKind = _field(
        "hinge",
        "Pieces",
        "What joins two pieces: hinge (with a metal rod), snap (hinge without metal), box (a rigid key to glue), none.",
    )
    clearance_mm: float | None = _field(None, "Pieces", "Gap between connector and pocket.", ge=0)
    rod_clearance_mm: float | None = _field(None, "Pieces", "Gap around the rod, radial.", ge=0)
    rod_diameter_mm: float | None = _field(None, "Pieces", "Diameter of the hinge's metal rod.", gt=0)
    knuckles: int | None = _field(
        None,
        "Pieces",
        "Knuckles of a hinge, even: both halves are then one part; when not given as many as find room.",
        ge=2,
        le=12,
    )
    min_wall_mm: float | None = _field(None, "Pieces", "Thinnest wall of a piece.", gt=0)
    knuckle_wall_mm: float | None = _field(None, "Pieces", "Wall of the hinge around its rod.", gt=0)
    mark_depth_mm: float | None = _field(
        None,
        "Pieces",
        "Depth of engraved marks; when not given the process's, and none on curved and merged pieces.",
        ge=0,
    )
    swing_degrees: float = _field(
        5.5, "Pieces", "Swing that every joint keeps to either side, so that it can be assembled.", ge=0, le=30
    )
    bevel_degrees: Bends | None = _field(
        None,
        "Pieces",
        "Concave,convex bends that every side is bevelled for, so that a piece fits any shape; those of this shape "
        f"when not given, {', '.join(f'{x:g}' for x in UNIVERSAL_BEVEL)} where lengths are.",
    )
    bed_mm: Triple = _field((220.0, 220.0, 250.0), "Pieces", "Build volume X,Y,Z of the printer.")
    mean_edge_mm: float | None = _field(None, "Pieces", "Mean edge of the pieces, in place of --size-mm.", gt=0)
    fit: bool = _field(
        False, "Pieces", "Take the smallest size at which pockets and walls fit: what is done when no size is given."
    )
    retention: Retention = _field(
        "detent", "Pieces", "What holds a hinge in its pocket: detent (a bump that springs into a groove), or glue."
    )
    marks: bool = _field(True, "Pieces", "Engrave class letter and side ticks, or numbers, on the inner face.")
    process_values: ProcessPreset | None = _field(
        None, "Pieces", "What the process can do where it is a user's own: written to kit.json, read from --process."
    )
    bevel_variants: int = _field(
        1,
        "Pieces",
        "Moulds that a class is split into by the angles at which its pieces meet: more of them, narrower grooves. "
        "The kit's notes say what each further one buys.",
        ge=1,
        le=20,
    )

    documents: bool = _field(
        True, "Output", "Write what people hold and look at too: build plates, net, guide, report and fit coupon."
    )
    printer: Printer | None = _field(None, "Output", "Printer whose bed plates are packed for, in place of --bed.")
    spares: Spares = _field(
        "0", "Output", "Spare copies of each part: a number, or a percentage of its count such as 5%, rounded up."
    )
    price_per_kg: Price = _field(
        None, "Output", "Price of printing a kilogramme, in your currency: adds what each part costs."
    )
    mould_price: Price = _field(None, "Output", "Price of one injection mould, to compare printing with moulding.")
    moulded_price_per_piece: float = _field(
        0.1, "Output", "Price of one moulded piece, material and machine, for the same comparison.", ge=0
    )
    paper: Paper = _field("a4", "Output", "Paper that the net is printed on.")
    net_scale: Positive = _field(
        1.0, "Output", "Size of the paper model, 1 being the kit's own; less where a piece is larger than a page."
    )
    net_on_one_page: bool = _field(False, "Output", "Shrink the whole net onto one page.")

    patch: PatchKind = _field("flat", "Patches", "Flat triangles, or curved ones that follow the surface more closely.")
    curved: CurvedKind = _field(
        "canonical",
        "Patches",
        "Curved patches: canonical (one shape per class, any two sides of one length meet), or published (the paper's: "
        "Loop subdivision, classified by curvature, alike to some percent).",
    )
    curved_classes: int | None = _field(
        None,
        "Patches",
        f"Curved shapes in all; when not given {DEPTHS} a class of triangles (as many as there are classes: one each), "
        f"{PUBLISHED_CLASSES} with --curved published. Of two triangles, 8 to 12 canonical ones lie a quarter nearer "
        "to the surface than flat pieces.",
        ge=1,
    )
    curved_gap_mm: float | None = _field(
        None,
        "Patches",
        "Largest gap between the curved sides of canonical patches, at 95 of 100 joints; 2 clearances when not given.",
        gt=0,
    )
    subdivision_levels: int = _field(3, "Patches", "Subdivisions of a curved patch into 4 each: 3 make 64.", ge=1, le=4)
    merge: Merge | None = _field(
        None,
        "Patches",
        "Triangles merged into one piece: 2 (pairs), or 5, 6, 7 (whole stars of a vertex, and parts of stars).",
    )
    merge_tolerance_mm: float = _field(
        0.02, "Patches", "Merged pieces that differ by no more at any corner are one shape.", gt=0, le=5
    )
    merge_flat_degrees: float = _field(
        0.0, "Patches", "Merged pieces whose triangles bend by no more than this are made flat.", ge=0, le=45
    )
    merge_shift_percent: float = _field(
        5.0,
        "Patches",
        "How far vertices may leave the surface so that merged pieces need fewer shapes, in percent of the mean edge; "
        "0: not at all. Pockets keep the room that unmerged triangles leave them. Where lengths are given they stay.",
        ge=0,
        le=50,
    )

    @model_validator(mode="before")
    @classmethod
    def _implied(cls, values: object) -> object:
        """The method implies a number of classes, lengths or triangles from outside imply both."""
        if not isinstance(values, dict):
            return values
        given = cast("dict[str, object]", values)
        return _implied_by_palette(given) | _implied_by_printer(given) | given | _own_process(given)

    @model_validator(mode="after")
    def _consistent(self) -> "KitSpec":
        if self.faces is not None and self.vertices is not None:
            message = "faces and vertices are both given: give one, the other follows from it"
            raise ValueError(message)
        if self.faces is not None and self.faces % 2:
            message = f"faces is {self.faces}: a closed surface of triangles has an even number of them"
            raise ValueError(message)
        if self.knuckles is not None and self.knuckles % 2:
            message = f"knuckles is {self.knuckles}: an even number makes both halves of a hinge the same part"
            raise ValueError(message)
        if self.faces is not None and self.classes > self.faces:
            message = f"classes is {self.classes}, more than the {self.faces} faces"
            raise ValueError(message)
        contradiction = (
            _contradiction(self)
            or _contradiction_of_pieces(self)
            or _contradiction_of_output(self)
            or _patch_contradiction(self)
        )
        if contradiction:
            raise ValueError(contradiction)
        return self

    @property
    def preset(self) -> ProcessPreset:
        """The manufacturing process's own values."""
        return PROCESSES[self.process] if self.process_values is None else self.process_values

    @property
    def engraving_depth_mm(self) -> float:
        """How deep marks are: curved and merged pieces bear them only where a depth is given."""
        if self.mark_depth_mm is None and (self.merge is not None or self.patch == "curved"):
            return 0.0
        return self.preset.mark_depth_mm if self.mark_depth_mm is None else self.mark_depth_mm

    @classmethod
    def parse(cls, values: dict[str, Any]) -> "KitSpec":
        """A spec from plain values, with errors that a user understands.

        Raises:
            SpecError: a value is of the wrong kind, outside its limits, unknown, or contradicts another.
        """
        try:
            return cls.model_validate(values)
        except ValidationError as error:
            raise _reworded(error) from None

    def tolerance_for(self, faces: int) -> float:
        """`tolerance_percent`, or what stands for it on a mesh of so many faces."""
        if self.tolerance_percent is not None:
            return self.tolerance_percent
        if self.method == "pressure":
            return PRESSURE_TOLERANCE
        return EXACT_TOLERANCE if faces <= MOST_WALKED_FACES else LARGE_TOLERANCE

    def face_count(self, genus: int) -> int:
        """Faces of the simplified mesh of a genus: as asked, or from the vertices by Euler's formula."""
        if self.vertices is not None:
            return 2 * self.vertices - 4 + 4 * genus
        return self.faces if self.faces is not None else DEFAULT_FACES

    def curved_classes_for(self, triangle_classes: int) -> int:
        """`curved_classes`, or what stands for it where triangles have so many classes."""
        if self.curved_classes is not None:
            return self.curved_classes
        return PUBLISHED_CLASSES if self.curved == "published" else DEPTHS * triangle_classes

    def vertex_count(self, genus: int) -> int:
        """Vertices of the simplified mesh: as asked, or from the faces by Euler's formula F = 2V − 4 + 4g.

        Raises:
            SpecError: the faces asked for are too few for a surface of this genus.
        """
        if self.vertices is not None:
            return self.vertices
        faces = self.faces if self.faces is not None else DEFAULT_FACES
        vertices = (faces + 4 - 4 * genus) // 2
        if vertices < 4:
            raise SpecError(
                f"{faces} faces are too few for a surface with {genus} handles",
                wanted=f"at least {4 + 4 * genus} faces",
                found=f"{faces}",
                remedy="more --faces",
            )
        return vertices


def _implied_by_palette(given: dict[str, object]) -> dict[str, object]:
    """Method and classes for what is given of palette, like and multisets; what is wrong is found out afterwards."""
    palette, like, multisets = (given.get(name) for name in ("palette", "like", "multisets"))
    if palette is None and multisets is None and like is None:
        return {"classes": PRESSURE_CLASSES} if given.get("method") == "pressure" else {}
    if palette is None and multisets is None:
        return {"method": "palette"}  # the kit tells the classes once it is read
    if isinstance(multisets, str):
        classes = len({"".join(sorted(word.strip().lower())) for word in multisets.split(",") if word.strip()})
    else:
        commas = palette.count(",") if isinstance(palette, str) else 0
        three = commas == 2 or (isinstance(palette, list | tuple) and len(cast("list[object]", palette)) == 3)
        classes = MOST_CLASSES[3] if three else 2
    bevel = {"bevel_degrees": UNIVERSAL_BEVEL} if palette is not None and _is_bisected(given) else {}
    return {"method": "palette", "classes": max(classes, 1), **bevel}


def _implied_by_printer(given: dict[str, object]) -> dict[str, object]:
    bed = next((bed for name, bed in PRINTERS.items() if name == given.get("printer")), None)
    return {} if bed is None else {"bed_mm": bed}


def _is_bisected(given: dict[str, object]) -> bool:
    return given.get("thickening", "bisector") == "bisector"


def _contradiction(spec: KitSpec) -> str:
    """What is wrong between palette, like, multisets, method and classes; empty where nothing is."""
    given = [name for name in ("palette", "like", "multisets") if getattr(spec, name) is not None]
    if given and spec.method != "palette":
        return f"{given[0]} is given and method is {spec.method}: only --method palette makes edges of given lengths"
    if spec.like is not None and len(given) > 1:
        other = next(name for name in given if name != "like")
        return f"like and {other} are both given: the kit that is named has both lengths and triangles"
    if spec.bevel_degrees is not None and spec.thickening != "bisector":
        return f"bevel_degrees is given and thickening is {spec.thickening}: only bisector follows bends"
    if spec.bevel_variants > 1 and (spec.bevel_degrees is not None or spec.thickening not in FOLLOWING):
        rule = "bevel_degrees is given" if spec.bevel_degrees is not None else f"thickening is {spec.thickening}"
        return (
            f"bevel_variants is {spec.bevel_variants} and {rule}: pieces of a class then have one bevel, whatever meets"
        )
    return _palette_contradiction(spec)


def _own_process(given: dict[str, object]) -> dict[str, object]:
    """Name and values of a process that is given by its file."""
    process = given.get("process")
    if not isinstance(process, str) or not is_process_file(process):
        return {}
    return {"process": Path(process).stem, "process_values": read_process(Path(process))}


def _contradiction_of_pieces(spec: KitSpec) -> str:
    """What is wrong between process and scale; empty where nothing is."""
    if spec.process_values is None and spec.process not in PROCESSES:
        known = ", ".join(f"'{name}'" for name in PROCESSES)
        return f"process is {spec.process}, which is not known: {known}, or the path of a .toml file that describes it"
    scales = [name for name in ("size_mm", "mean_edge_mm") if getattr(spec, name) is not None]
    scales += ["fit"] if spec.fit else []
    if len(scales) > 1:
        return f"{scales[0]} and {scales[1]} are both given: one of them sets the scale"
    lengths = next((name for name in ("palette", "like") if getattr(spec, name) is not None), None)
    if lengths is not None and scales and scales != ["size_mm"]:
        return f"{scales[0]} and {lengths} are both given: the lengths of {lengths} set the scale"
    return ""


def _contradiction_of_output(spec: KitSpec) -> str:
    """What is wrong between printer and bed, or between prices; empty where nothing is."""
    if spec.printer is not None and spec.bed_mm != PRINTERS[spec.printer]:
        return f"printer is {spec.printer} and bed_mm is another than its own: give one of them"
    if spec.mould_price is not None and spec.price_per_kg is None:
        return "mould_price is given and price_per_kg is not: moulding is compared with what printing costs"
    return ""


def _palette_contradiction(spec: KitSpec) -> str:
    size = None if spec.palette is None else len(spec.palette)
    if spec.multisets is not None:
        words = multiset_words(spec.multisets)
        if size not in (None, len(letters_of(words))):
            return f"multisets {spec.multisets} name {len(letters_of(words))} lengths, palette gives {size}"
        if len(words) != spec.classes:
            return f"classes is {spec.classes}, multisets {spec.multisets} are {len(words)}: give one, not both"
    elif size is not None and spec.classes > MOST_CLASSES[size]:
        return f"classes is {spec.classes}: {size} lengths make {MOST_CLASSES[size]} kinds of triangles at most"
    return ""


_OF_CURVED = ("curved", "curved_classes", "curved_gap_mm", "subdivision_levels")
_OF_MERGED = ("merge_tolerance_mm", "merge_flat_degrees", "merge_shift_percent")


def _patch_contradiction(spec: KitSpec) -> str:
    """What is wrong between patch, merge and what only one kind of pieces has; empty where nothing is."""
    if spec.patch == "flat" and (name := _changed(spec, _OF_CURVED)):
        return f"{name} is given and patch is flat: only --patch curved has curved pieces"
    if spec.curved == "published" and spec.curved_gap_mm is not None:
        return "curved_gap_mm is given and curved is published: only canonical patches keep to a gap"
    return _merge_contradiction(spec)


def _merge_contradiction(spec: KitSpec) -> str:
    name = _changed(spec, _OF_MERGED)
    if spec.merge is None:
        kinds = ", ".join(map(str, get_args(Merge)))
        return f"{name} is given and merge is not: only --merge (one of {kinds}) merges pieces" if name else ""
    if spec.patch == "curved":
        return f"patch is curved and merge is {spec.merge}: give one, merged pieces are made of flat triangles"
    if spec.bevel_variants > 1:
        return (
            f"bevel_variants is {spec.bevel_variants} and merge is {spec.merge}: every merged shape has bevels of its "
            "own already; a lesser --merge-tolerance-mm makes more shapes"
        )
    return ""


def _changed(spec: KitSpec, names: tuple[str, ...]) -> str:
    """The first of these parameters that is not what it is where nothing is given; empty where all are."""
    fields = type(spec).model_fields
    return next((name for name in names if getattr(spec, name) != fields[name].default), "")


def _reworded(error: ValidationError) -> SpecError:
    first = error.errors(include_url=False)[0]
    message = first["msg"].removeprefix("Value error, ")
    if not first["loc"]:
        return SpecError(message, remedy="drkid make --help")
    name = ".".join(str(part) for part in first["loc"])
    field = KitSpec.model_fields.get(str(first["loc"][0]))
    found = repr(first["input"])
    if first["type"] == "extra_forbidden":
        return SpecError(f"there is no parameter {name}", remedy="drkid make --help")
    remedy = f"{name}: {field.description}" if field is not None and field.description else "drkid make --help"
    return SpecError(f"{name} cannot be used", wanted=message, found=found, remedy=remedy)
