"""kit.json, version 1: the document as pydantic models, from which its JSON Schema comes."""

from math import dist
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

Matrix = Annotated[list[float], Field(min_length=16, max_length=16, description="4×4, row-major, column vectors")]
Point = tuple[float, float, float]
Face = Annotated[int, Field(ge=0, description="face of assembled.ply")]
Vertex = Annotated[int, Field(ge=0, description="vertex of assembled.ply")]


class Model(BaseModel):
    """Strict about its own names, so that a misspelt field does not pass."""

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True, allow_inf_nan=False)


class SourceDocument(Model):
    """Where the surface comes from, and the scale at which it is printed."""

    name: str
    sha256: str
    label: int | None = None
    threshold: float | None = None
    component: int | None = None
    voxel_size: Point | None = Field(default=None, description="x, y, z in voxel_unit")
    voxel_unit: str | None = None
    scale_mm_per_unit: float = Field(gt=0)


class SideDocument(Model):
    """A side of a part: where its connector sits."""

    connector_frame: Matrix = Field(description="from connector to part coordinates")


class PartDocument(Model):
    """A printed shape of a class."""

    file: str
    handedness: Literal["any", "left", "right"]
    count: int = Field(ge=1)
    corners: list[Point] = Field(description="in the part frame, counter-clockwise from outside")
    sides: list[SideDocument]

    @property
    def side_lengths(self) -> list[float]:
        """Of the sides in the order of the corners at which they start."""
        return [dist(a, b) for a, b in zip(self.corners, [*self.corners[1:], self.corners[0]], strict=True)]


class ClassDocument(Model):
    """A class of congruent pieces."""

    id: str
    count: int = Field(ge=1)
    edge_lengths: list[float] = Field(description="ascending, of the printed part")
    mirror_symmetric: bool
    parts: list[PartDocument]


class PieceDocument(Model):
    """A part at its place."""

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True, serialize_by_alias=True)

    face: Face | None = None
    faces: list[Face] | None = Field(default=None, description="of a merged kit, in place of face")
    class_: Annotated[str, Field(alias="class")]
    part: str
    corners: list[Vertex] = Field(min_length=3, description="vertex of assembled.ply at each corner of the part")
    transform: Matrix = Field(description="from part to world, proper rigid")

    @property
    def covered(self) -> list[int]:
        """The faces of M_f that the piece covers; none where it names none."""
        if self.faces is not None:
            return self.faces
        return [] if self.face is None else [self.face]

    @property
    def first_face(self) -> int:
        """The first of them, by which steps and joints name the piece; −1 where it names none."""
        return self.covered[0] if self.covered else -1


class JointDocument(Model):
    """An edge between two pieces."""

    faces: tuple[Face, Face]
    edge: tuple[Vertex, Vertex]
    dihedral_degrees: float = Field(description="inner angle, more than 180 where concave")
    connector: list[str] = Field(description="the half in each of `faces`, or the one key; empty for none")
    groove_mm: float | None = Field(default=None, ge=0, description="widest visible gap between the two pieces")


class HardwareDocument(Model):
    """Connector parts by file, rods by diameter and length."""

    file: str | None = None
    name: str | None = None
    diameter: float | None = None
    length: float | None = None
    count: int = Field(ge=1)


class StepDocument(Model):
    """A step of the assembly."""

    step: int = Field(ge=1)
    face: Face
    joins: list[Face] = Field(description="every neighbour that is already placed")


class DistanceDocument(Model):
    """Symmetric distance of two surfaces, percent of the diagonal of surface.ply's bounding box."""

    mean_percent: float = Field(ge=0)
    max_percent: float = Field(ge=0)


class HausdorffDocument(Model):
    """The three pairs of surfaces."""

    surface_simplified: DistanceDocument
    simplified_assembled: DistanceDocument
    surface_assembled: DistanceDocument


class DihedralDocument(Model):
    """Of |180° − inner angle|, and the share of joints above 181°."""

    mean_degrees: float
    p95_degrees: float
    concave_percent: float


class GrooveChoiceDocument(Model):
    """The same kit if every class had at most so many bevel variants, made for this shape alone."""

    bevel_variants: int = Field(ge=1)
    moulds: int = Field(ge=1, description="of pieces, in all")
    mean_mm: float
    max_mm: float


class GrooveDocument(Model):
    """Visible gap between pieces at their joints."""

    mean_mm: float
    max_mm: float
    choices: list[GrooveChoiceDocument] = Field(default=[], description="what each further mould buys")


class RigidityDocument(Model):
    """How stiff the assembled shell is; movements of the most moved vertex, in percent of mean_edge."""

    firmness: Literal["stiff", "soft", "may snap through"]
    softest: float = Field(ge=0, description="least singular value of the rigidity matrix, rigid motions apart")
    stiffness_percent: float = Field(ge=0, description="softest, of that of a round shell of as many faces")
    sway_percent: float = Field(ge=0, description="what a play of 0.5 % in every length allows; 100: or more")
    fold_percent: float | None = Field(default=None, description="movement to the fold before a second state")
    barrier_percent: float | None = Field(default=None, description="give of every length that passes this fold")
    second_state_percent: float | None = Field(default=None, description="movement to a second state within the play")


class GapsDocument(Model):
    """Distance of two joined sides' axes at their ends, the larger of the two, over all hinges."""

    mean_mm: float = Field(ge=0)
    p95_mm: float = Field(ge=0)
    max_mm: float = Field(ge=0)


class DriftDocument(Model):
    """Of the joined parts' corners from the vertices of assembled.ply, after a rigid fit; percent of its diagonal."""

    mean_mm: float = Field(ge=0)
    max_mm: float = Field(ge=0)
    mean_percent: float = Field(ge=0)
    max_percent: float = Field(ge=0)


class BudgetDocument(Model):
    """What the joint most at risk has and needs, in mm."""

    slip_mm: float = Field(ge=0, description="play of both halves in their pockets")
    rod_mm: float = Field(ge=0, description="play of both bores around the rod")
    accuracy_mm: float = Field(gt=0, description="standard deviation of a printed side of this process")
    joint: tuple[Face, Face] = Field(description="the joint most at risk, by its faces")
    gap_mm: float = Field(ge=0, description="what the classes' errors open there")
    scatter_mm: float = Field(ge=0, description="what 95 of 100 prints, each side off by accuracy_mm, stay below")
    reserve_mm: float = Field(description="what is left; negative: it may not be enough")
    shared_mm: float = Field(ge=0, description="the most that errors shared by all pieces of a mould open, 95 of 100")


class ClosureDocument(Model):
    """Whether the parts, joined by their hinges alone, make the closed shell."""

    verdict: Literal["closes", "closes with strain", "does not close"]
    play_mm: float = Field(ge=0, description="gap up to which it closes; with strain up to twice that")
    gaps: GapsDocument
    chain: GapsDocument = Field(description="of parts put one to the next at the stated angles, before relaxation")
    drift: DriftDocument
    budget: BudgetDocument
    iterations: int = Field(ge=0)
    settled: bool = Field(description="whether the relaxation came to rest")


class SwingDocument(Model):
    """How far hinges turn before the pieces touch, in degrees; the least of all joints."""

    wanted_degrees: float
    inward_degrees: float = Field(description="towards a more convex shell; negative: pieces touch at their places")
    outward_degrees: float = Field(description="towards a more concave shell")
    blocked: int = Field(ge=0, description="joints that cannot turn by wanted_degrees both ways")


class BuildingDocument(Model):
    """What the order of building is like."""

    border_mean_mm: float = Field(ge=0, description="open border, over the steps")
    border_max_mm: float = Field(ge=0)
    breadth_first_mean_mm: float = Field(ge=0, description="the same in a breadth-first order")
    enclosed: int = Field(ge=0, description="pieces before the last that go in between neighbours on every side")
    bridges: int = Field(ge=0, description="pieces that close the shell around a hole")
    last_goes_in: bool = Field(description="along its outward normal, past neighbours and hinges")
    last_overlap_percent: float = Field(ge=0, description="the most it meets on its way, of its volume")
    last_candidates: int = Field(ge=1, description="pieces that were tried as the last")


class OverlapDocument(Model):
    """Pairs of pieces that reach into one another."""

    pairs: int = Field(ge=0, description="at their places")
    largest_mm3: float = Field(ge=0)
    largest_percent: float = Field(ge=0, description="of the smaller piece")
    faces: tuple[int, int] | None = Field(default=None, description="of the pair with the largest share")
    swing_degrees: float
    swung: int = Field(ge=0, description="more pairs, when one piece turns by swing_degrees about one of its hinges")
    swung_mm3: float = Field(ge=0, description="by how much at most")


class AssemblyDocument(Model):
    """Whether and how the kit goes together."""

    closure: ClosureDocument
    swing: SwingDocument
    building: BuildingDocument
    overlap: OverlapDocument | None = None


class CurvedDocument(Model):
    """Of curved pieces; tangent breaks are the angles between tangent planes along the joints, flat: of triangles."""

    threshold_percent: float = Field(description="T: largest distance to the class in (w, x, y, z), of the mean edge")
    gap_mean_mm: float = Field(description="widest gap between the boundary curves at a joint")
    gap_p95_mm: float
    flat_break_mean_degrees: float
    flat_break_p95_degrees: float
    break_mean_degrees: float
    break_p95_degrees: float
    surface_curved: DistanceDocument = Field(description="surface.ply and the assembled curved patches")


class MergedDocument(Model):
    """Of merged pieces: what they were, and how far the farthest corner of each lies from its shape's."""

    triangles: int
    triangle_classes: int
    single_triangles: int
    misfit_mean_mm: float
    misfit_max_mm: float


class PatchDocument(Model):
    """The curved middle surface of a class in its part frame, subdivided; corners 0, 1, 2 are the class's."""

    class_: Annotated[str, Field(alias="class")]
    vertices: list[Point]
    faces: list[tuple[int, int, int]]

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True, serialize_by_alias=True)


class MetricsDocument(Model):
    """What tables report."""

    pieces: int
    classes: int
    unique_piece_parts: int = Field(description="printed shapes, mirror images apart: the number of moulds")
    mean_edge: float
    error_max: float
    error_max_percent: float
    error_mean: float
    error_mean_percent: float
    hausdorff: HausdorffDocument
    dihedral: DihedralDocument
    groove: GrooveDocument
    genus: int
    iterations: int
    rigidity: RigidityDocument | None = None
    seconds: dict[str, float]
    assembly: AssemblyDocument | None = None
    unique_connector_parts: int | None = Field(default=None, ge=0, description="printed shapes of connectors")
    curved: CurvedDocument | None = None
    merged: MergedDocument | None = None
    cut_corners: int = Field(default=0, ge=0, description="cut off where pieces of one vertex would meet")
    deepest_cut_mm: float = Field(default=0.0, ge=0, description="farthest of these cuts behind its corner")


class FindingDocument(Model):
    """A dimension against what the process needs."""

    subject: str = Field(description="class A, connector, …")
    what: str
    needed: float
    available: float
    unit: Literal["mm", "degrees"]
    limit: Literal["at least", "at most"]
    remedy: str = ""


class ConvergenceDocument(Model):
    """A recorded iteration of the solver."""

    iteration: int
    energy: float
    error_max_percent: float
    error_mean_percent: float


class OutcomeDocument(Model):
    """Whether the asked tolerance was reached, and why the solver stopped."""

    status: Literal["converged", "stalled"]
    message: str


class KitDocument(Model):
    """A construction kit. Lengths are millimetres of the printed object, right-handed, faces counter-clockwise."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", populate_by_name=True, serialize_by_alias=True, title="drkid kit, version 1"
    )

    schema_: Literal["drkid.kit/1"] = Field(default="drkid.kit/1", alias="schema")
    drkid_version: str
    units: Literal["mm"] = "mm"
    source: SourceDocument
    spec: dict[str, Any] = Field(description="every parameter, automatic choices included; see `drkid schema spec`")
    classes: list[ClassDocument]
    pieces: list[PieceDocument]
    joints: list[JointDocument]
    hardware: list[HardwareDocument]
    assembly: list[StepDocument]
    metrics: MetricsDocument
    convergence: list[ConvergenceDocument]
    outcome: OutcomeDocument
    notes: list[str] = Field(default=[], description="what a user should know about this kit")
    findings: list[FindingDocument] = Field(default=[], description="dimensions against what the process needs")
    patches: list[PatchDocument] | None = Field(default=None, description="of curved kits: one for each class")

    @property
    def is_merged(self) -> bool:
        """Whether its pieces are merged of several faces."""
        return any(piece.faces is not None for piece in self.pieces)
