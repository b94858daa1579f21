"""KitSpec: every parameter with unit, default, limits and help. Flags, JSON Schema and documents come from it."""

from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from drkid.errors import SpecError

Process = Literal["fdm", "sla", "polyjet", "injection"]
Method = Literal["pressure", "palette"]
Thickening = Literal["bisector", "mean_normal", "perpendicular"]
ConnectorKind = Literal["hinge", "box", "none"]
Unit = Literal["angstrom", "nm", "um", "mm"]

DEFAULT_FACES = 172  # the size of the paper's printed mitochondrion (table 1, M4)


@dataclass(frozen=True)
class ProcessPreset:
    """What a manufacturing process can do; lengths in mm.

    `clearance_mm` lies between connector and pocket, `rod_clearance_mm` around the rod (radial);
    `rods_mm` are the stock diameters, ascending.
    """

    clearance_mm: float
    rod_clearance_mm: float
    min_wall_mm: float
    knuckle_wall_mm: float
    knuckle_length_mm: float
    knuckle_gap_mm: float
    min_hole_mm: float
    engrave_width_mm: float
    mark_depth_mm: float
    rods_mm: tuple[float, ...]
    density_g_cm3: float
    max_wall_mm: float | None = None


PROCESSES: dict[Process, ProcessPreset] = {
    "fdm": ProcessPreset(0.20, 0.15, 1.2, 1.0, 3.0, 0.40, 2.0, 0.6, 0.4, (1.75, 2.0, 3.0), 1.24),
    "sla": ProcessPreset(0.15, 0.10, 1.0, 0.8, 2.0, 0.30, 0.5, 0.4, 0.4, (1.0, 1.5, 2.0), 1.18),
    "polyjet": ProcessPreset(0.15, 0.10, 1.0, 0.8, 2.0, 0.30, 1.0, 0.5, 0.5, (1.0, 1.5, 2.0), 1.18),
    "injection": ProcessPreset(0.08, 0.05, 1.2, 0.8, 2.0, 0.15, 0.0, 0.5, 0.3, (1.0, 1.5, 2.0), 1.04, 3.5),
}


def _split_commas(value: object) -> object:
    """'16,16,15' or '220x220x250' as a list: how a triple is typed on a command line."""
    return value.lower().replace("x", ",").split(",") if isinstance(value, str) else value


Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Triple = Annotated[tuple[Positive, Positive, Positive], BeforeValidator(_split_commas)]


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

    faces: int | None = _field(
        None, "Mesh", f"Number of pieces: faces of the simplified mesh ({DEFAULT_FACES} when neither is given).", ge=4
    )
    vertices: int | None = _field(None, "Mesh", "Number of vertices of the simplified mesh, in place of --faces.", ge=4)
    lloyd_iterations: int = _field(5, "Mesh", "Lloyd iterations of the Voronoi remeshing.", ge=0, le=1000)
    newton_iterations: int = _field(30, "Mesh", "Quasi-Newton (L-BFGS) iterations that follow.", ge=0, le=10000)

    classes: int = _field(7, "Congruence", "Number k of classes of identical pieces.", ge=1)
    method: Method = _field("pressure", "Congruence", "Solver that makes the pieces of a class alike.")
    tolerance_percent: float = _field(
        1.5, "Congruence", "Largest error of a piece that counts as converged, in percent of the mean edge.", gt=0
    )
    seconds: float | None = _field(
        None, "Congruence", "Time for the palette solver; by the number of faces when not given.", gt=0
    )
    rounds: int | None = _field(
        None, "Congruence", "Rounds of the palette solver in place of a time: the same rounds make the same kit.", ge=1
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

    process: Process = _field("fdm", "Pieces", "Manufacturing process: sets clearances, walls and rods.")
    size_mm: float | None = _field(
        None,
        "Pieces",
        "Longest side of the printed object; the smallest that fits when not given.",
        gt=0,
    )
    thickness_mm: float | None = _field(None, "Pieces", "Thickness of the pieces.", gt=0)
    thickening: Thickening = _field(
        "bisector", "Pieces", "How the sides are bevelled: bisector cannot collide, mean_normal is the paper's."
    )
    connector: ConnectorKind = _field("hinge", "Pieces", "What joins two pieces: hinge (with a rod), box key, none.")
    clearance_mm: float | None = _field(None, "Pieces", "Gap between connector and pocket.", ge=0)
    rod_clearance_mm: float | None = _field(None, "Pieces", "Gap around the rod, radial.", ge=0)
    rod_diameter_mm: float | None = _field(None, "Pieces", "Diameter of the hinge's metal rod.", gt=0)
    knuckles: int = _field(2, "Pieces", "Knuckles of a hinge, even: both halves are then one part.", ge=2, le=12)
    min_wall_mm: float | None = _field(None, "Pieces", "Thinnest wall of a piece.", gt=0)
    knuckle_wall_mm: float | None = _field(None, "Pieces", "Wall of the hinge around its rod.", gt=0)
    mark_depth_mm: float | None = _field(None, "Pieces", "Depth of engraved marks.", ge=0)
    swing_degrees: float = _field(
        5.5, "Pieces", "Swing that every joint keeps to either side, so that it can be assembled.", ge=0, le=30
    )
    bed_mm: Triple = _field((220.0, 220.0, 250.0), "Pieces", "Build volume X,Y,Z of the printer.")

    @model_validator(mode="after")
    def _consistent(self) -> "KitSpec":
        if self.faces is not None and self.vertices is not None:
            message = "faces and vertices are both given: give one, the other follows from it"
            raise ValueError(message)
        if self.faces is not None and self.faces % 2:
            message = f"faces is {self.faces}: a closed surface of triangles has an even number of them"
            raise ValueError(message)
        if self.knuckles % 2:
            message = f"knuckles is {self.knuckles}: an even number makes both halves of a hinge the same part"
            raise ValueError(message)
        if self.faces is not None and self.classes > self.faces:
            message = f"classes is {self.classes}, more than the {self.faces} faces"
            raise ValueError(message)
        return self

    @property
    def preset(self) -> ProcessPreset:
        """The manufacturing process's own values."""
        return PROCESSES[self.process]

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
