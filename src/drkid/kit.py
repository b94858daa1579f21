"""Kit and its parts: the values that the stages fill, in the order in which data visits them."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from drkid.curved_patch import CurvedPatch
from drkid.mesh import Floats, Ints, TriMesh
from drkid.progress import Progress, StageProgress, nobody
from drkid.solid import Solid
from drkid.spec import ConnectorKind, KitSpec, Unit

VolumeKind = Literal["labels", "mask", "density"]
Handedness = Literal["any", "left", "right"]
Status = Literal["converged", "stalled"]
Firmness = Literal["stiff", "soft", "may snap through"]
Verdict = Literal["closes", "closes with strain", "does not close"]

BRIDGE = "widest bridge, as it lies on its plate"  # what a finding of it is about
WALL = "thinnest wall"  # the same
FINDING_TOLERANCE = 1e-6  # mm or degrees: what rounding may take from a dimension


def class_id(index: int) -> str:
    """The letters A, B, …, Z, AA, AB, … of classes 0, 1, 2, and so on."""
    letters = ""
    index += 1
    while index:
        index, digit = divmod(index - 1, 26)
        letters = chr(ord("A") + digit) + letters
    return letters


@dataclass(frozen=True)
class Source:
    """Where a surface comes from: enough to find and cut out the same object again.

    `voxel_size` is (x, y, z) in `voxel_unit`; both are None for a mesh without a unit.
    """

    name: str
    sha256: str
    voxel_size: tuple[float, float, float] | None = None
    voxel_unit: Unit | None = None
    label: int | None = None
    threshold: float | None = None
    component: int | None = None


@dataclass(frozen=True, eq=False)
class LabelVolume:
    """A volume as read: `values` with axes (x, y, z), voxel `spacing` along them in `unit`."""

    values: NDArray[np.generic]
    spacing: tuple[float, float, float]
    unit: Unit | None
    kind: VolumeKind
    name: str
    sha256: str
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Surface:
    """M_i: one closed, manifold, outward, connected surface in the source's unit.

    `max_displacement_voxels` bounds how far smoothing moved it (0 for a mesh, or unsmoothed);
    `touches_border` says that the object was cut off by the end of the volume and closed there;
    `notes` are sentences that a user should read.
    """

    mesh: TriMesh
    source: Source
    components: int = 1
    cavities_filled: int = 0
    debris_dropped: int = 0
    touches_border: bool = False
    max_displacement_voxels: float = 0.0
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Simplified:
    """M_s: the surface with the wanted number of vertices; the energy of the Voronoi tessellation per iteration.

    `target` is M_i at the height of M_s's vertices: those lie outside it where it is convex, so that faces straddle it.
    """

    mesh: TriMesh
    energy: tuple[float, ...]
    notes: tuple[str, ...] = ()
    target: TriMesh | None = None


@dataclass(frozen=True)
class Outcome:
    """Why a solver stopped, in a word and in a sentence."""

    status: Status
    message: str


@dataclass(frozen=True)
class Convergence:
    """One recorded iteration; errors in percent of the mean edge, the energy in the mesh's unit squared."""

    iteration: int
    energy: float
    error_max_percent: float
    error_mean_percent: float


@dataclass(frozen=True)
class Rigidity:
    """How stiff the assembled shell is; movements are those of the most moved vertex, in percent of the mean edge.

    `softest` is the least singular value of the rigidity matrix apart from the rigid motions, `stiffness_percent` the
    same of that of a round shell of as many faces. `sway_percent` is what play of 0.5 % of the mean edge in every
    length allows along that mode (100: or more). At `fold_percent` along one of the softest modes the shell gives way
    to a second state, if play or force lets every length give by `barrier_percent` of the mean edge: the mode that
    snaps through, or else the one with the lowest barrier; None where there is none near. `second_state_percent` is
    how far the second state is, where there is one that play alone may reach.
    """

    firmness: Firmness
    softest: float
    stiffness_percent: float
    sway_percent: float
    fold_percent: float | None = None
    barrier_percent: float | None = None
    second_state_percent: float | None = None


@dataclass(frozen=True, eq=False)
class Decomposition:
    """M_f and its classes: `face_class` (F,) into `class_lengths` (k, 3), ascending edge lengths.

    `face_errors` (F,) is the Euclidean distance of a face's ascending edge lengths to its class's.
    `scale_mm_per_unit` is the printed scale where lengths that are given in mm fix it. `rigidity` is None where it was
    not measured.
    """

    mesh: TriMesh
    face_class: Ints
    class_lengths: Floats
    face_errors: Floats
    iterations: int
    convergence: tuple[Convergence, ...]
    outcome: Outcome
    notes: tuple[str, ...] = ()
    scale_mm_per_unit: float | None = None
    rigidity: Rigidity | None = None


@dataclass(frozen=True, eq=False)
class CurvedFigures:
    """What curved patches cost and bring; lengths in the decomposition's unit, breaks in degrees.

    `threshold_percent` is the paper's T: the largest distance of a patch to its class in (w, x, y, z), of the mean
    edge. `gap` (E,) is the widest gap of the boundary curves at each joint. Tangent breaks are the angles between the
    tangent planes along the joints; `flat` is the same of the flat triangles. `surface` is the assembled surface.
    """

    threshold_percent: float
    gap: Floats
    flat_break_mean: float
    flat_break_p95: float
    break_mean: float
    break_p95: float
    surface: TriMesh


@dataclass(frozen=True, eq=False)
class MergedClass:
    """A shape of merged pieces, in its part frame: a polygon in space, and the triangles that fill it.

    `corners` (n, 3) go round the outline counter-clockwise from outside; `inner` (m, 3) are points within; `faces`
    (f, 3) index both, corners first. `side_face` (n,) is the face at each side. `achiral` where the shape is its own
    mirror image; corner i is then the image of corner `mirror[i]`.
    """

    corners: Floats
    inner: Floats
    faces: Ints
    side_face: Ints
    mirror: tuple[int, ...] = ()

    @property
    def achiral(self) -> bool:
        """Whether the shape is its own mirror image."""
        return bool(self.mirror)


@dataclass(frozen=True)
class MergedPiece:
    """Faces that are one piece: its class, and the mesh's vertex at each corner and inner point of the class."""

    faces: tuple[int, ...]
    class_index: int
    vertices: tuple[int, ...]
    inner: tuple[int, ...] = ()


def piece_of_face(pieces: tuple[MergedPiece, ...], faces: int) -> Ints:
    """(F,): the piece that each face belongs to."""
    out = np.full(faces, -1, np.int64)
    for number, piece in enumerate(pieces):
        out[list(piece.faces)] = number
    return out


@dataclass(frozen=True, eq=False)
class Patches:
    """What pieces are made of where they are not flat triangles; lengths in the decomposition's unit.

    Curved: the decomposition by curved classes, a patch for each. Merged: the shapes, the pieces, and `misfit` (P,),
    how far the farthest corner of each lies from its shape's. `allowance` is the gap or the tolerance that was kept:
    where the size of the print was found only afterwards, it was not known in millimetres before.
    """

    decomposition: Decomposition
    curved: tuple[CurvedPatch, ...] = ()
    figures: CurvedFigures | None = None
    merged: tuple[MergedClass, ...] = ()
    pieces: tuple[MergedPiece, ...] = ()
    misfit: Floats | None = None
    notes: tuple[str, ...] = ()
    allowance: float | None = None


@dataclass(frozen=True)
class Dimensions:
    """Lengths in mm that every piece and connector of a kit shares (`fabrication`: the names and formulas).

    `pocket_width_mm` along the side, `pocket_depth_mm` into the piece, `pocket_height_mm` across the middle plane.
    Fields of the rod are 0 where the connector has none, and so are those of what else a connector may lack: where its
    full width begins behind the axis, the height of the bump that holds it, a snap's pin, a key's bend.
    """

    connector: ConnectorKind
    thickness_mm: float
    clearance_mm: float
    rod_clearance_mm: float
    min_wall_mm: float
    knuckle_wall_mm: float
    knuckle_length_mm: float
    knuckle_gap_mm: float
    knuckles: int
    rod_diameter_mm: float
    rod_length_mm: float
    barrel_diameter_mm: float
    pocket_width_mm: float
    pocket_depth_mm: float
    pocket_height_mm: float
    grip_start_mm: float = 0.0
    detent_mm: float = 0.0
    draft_degrees: float = 0.0
    pin_diameter_mm: float = 0.0
    key_bend_degrees: float = 0.0


@dataclass(frozen=True, eq=False)
class Part:
    """A printed shape of a class, in the part frame of the kit format.

    `corners` (n, 3) counter-clockwise from outside, `side_frames` (n, 4, 4) from connector to part coordinates; three
    of a triangle, more of merged ones. `solid` is all of it, whatever its faces: flat, curved or bent.
    `class_name` is A1, A2, … where bevel variants split the class A; its own letter where it is not given.
    """

    class_index: int
    handedness: Handedness
    corners: Floats
    side_frames: Floats
    solid: Solid
    class_name: str = ""

    @property
    def name(self) -> str:
        """As people read it: A, or A2 where class A has several bevels."""
        return self.class_name or class_id(self.class_index)


@dataclass(frozen=True)
class GrooveChoice:
    """What the grooves are if every class has at most so many bevel variants: moulds in all, widths in mm."""

    bevel_variants: int
    moulds: int
    mean_mm: float
    max_mm: float


@dataclass(frozen=True, eq=False)
class Connector:
    """A printed connector, `name` being its file's stem."""

    name: str
    solid: Solid


@dataclass(frozen=True)
class Finding:
    """A dimension of a class's piece or of the connector (`subject`) against what the process needs, in `unit`.

    `limit` says whether `available` must be at least or at most what is `needed`.
    """

    subject: str
    what: str
    needed: float
    available: float
    unit: Literal["mm", "degrees"]
    limit: Literal["at least", "at most"]
    remedy: str = ""

    @property
    def is_met(self) -> bool:
        """Whether the process can make it as it is."""
        slack = self.available - self.needed
        return (slack if self.limit == "at least" else -slack) >= -FINDING_TOLERANCE

    def __str__(self) -> str:
        """In one sentence."""
        unit = "°" if self.unit == "degrees" else " mm"
        text = (
            f"{self.subject}: {self.what} is {self.available:.2f}{unit}, {self.limit} {self.needed:.2f}{unit} is needed"
        )
        return text if self.is_met or not self.remedy else f"{text}; {self.remedy}"


@dataclass(frozen=True, eq=False)
class PartSet:
    """The printed shapes of a kit and how the faces use them.

    `scale_mm_per_unit` takes the decomposition's unit to mm. Face f is made from `parts[face_part[f]]`, whose
    corner 0 lies at the face's corner `face_turn[f]`. `groove_mm` (E,) is each joint's widest visible gap;
    `groove_choices` is what bevels made for this shape alone, and further variants of them, would make of it.
    `coupon` is a fit test as it lies on the bed, None where there is no connector. `cut_corners` of the shapes are cut
    off, by up to `deepest_cut_mm`, because pieces of one vertex would meet there. `patch_share` is what was left of the
    height of curved patches.

    Where bevel variants split classes, each is a class of its own: `split_class` (m,) are the decomposition's classes
    that they come from, in their order; empty where no class is split.
    """

    scale_mm_per_unit: float
    dimensions: Dimensions
    parts: tuple[Part, ...]
    connectors: tuple[Connector, ...]
    face_part: Ints
    face_turn: Ints
    groove_mm: Floats
    notes: tuple[str, ...] = ()
    findings: tuple[Finding, ...] = ()
    groove_choices: tuple[GrooveChoice, ...] = ()
    coupon: Solid | None = None
    merged: tuple[MergedPiece, ...] = ()  # class_index is then the part's number; empty where each face is a piece
    cut_corners: int = 0
    deepest_cut_mm: float = 0.0
    split_class: tuple[int, ...] = ()
    patch_share: float = 1.0

    def by_parts(self, decomposition: Decomposition) -> Decomposition:
        """The decomposition with the classes of the parts: the same one where no class is split."""
        if not self.split_class:
            return decomposition
        of_part = np.array([part.class_index for part in self.parts], np.int64)
        return replace(
            decomposition,
            face_class=of_part[self.face_part],
            class_lengths=decomposition.class_lengths[list(self.split_class)],
        )


@dataclass(frozen=True, eq=False)
class Piece:
    """A part at its place: `vertices[i]` of the assembly lies at the part's corner i; `transform` (4, 4).

    `faces` are those of M_f that it covers: one, or all that are merged in it.
    """

    faces: tuple[int, ...]
    part: int
    vertices: tuple[int, ...]
    transform: Floats

    @property
    def face(self) -> int:
        """The first of its faces, by which steps and joints name the piece."""
        return self.faces[0]


@dataclass(frozen=True)
class Joint:
    """An edge between two pieces; the inner dihedral angle is more than 180° where concave."""

    faces: tuple[int, int]
    edge: tuple[int, int]
    dihedral_degrees: float


@dataclass(frozen=True)
class Step:
    """One step of the assembly: the face that is added and the placed neighbours it joins."""

    face: int
    joins: tuple[int, ...]


@dataclass(frozen=True)
class Gaps:
    """How far the axes of two joined sides lie apart at their ends, the farther of the two, over all hinges, in mm."""

    mean_mm: float
    p95_mm: float
    max_mm: float


@dataclass(frozen=True)
class Drift:
    """How far the corners of the joined parts lie from M_f's vertices after a rigid fit; percent of M_f's diagonal."""

    mean_mm: float
    max_mm: float
    mean_percent: float
    max_percent: float


@dataclass(frozen=True)
class ToleranceBudget:
    """What a joint needs and has, in mm, at the joint most at risk, between `joint`'s two faces.

    `slip_mm` and `rod_mm` are the play of both halves in their pockets and around the rod. `gap_mm` is what the
    classes' errors open there, `scatter_mm` what 95 of 100 prints stay below that scatter by `accuracy_mm`.
    `reserve_mm` is what is left. `shared_mm` is the most that errors of `accuracy_mm` that all pieces of a mould share
    open at any joint, again of 95 in 100.
    """

    slip_mm: float
    rod_mm: float
    accuracy_mm: float
    joint: tuple[int, int]
    gap_mm: float
    scatter_mm: float
    reserve_mm: float
    shared_mm: float


@dataclass(frozen=True)
class Closure:
    """Whether the printed parts, joined by their hinges alone, make the closed shell.

    `chain` are the gaps of parts put one to the next at the stated dihedral angles, `gaps` those after relaxation,
    which took `iterations` and `settled` if it came to rest.
    """

    verdict: Verdict
    play_mm: float
    gaps: Gaps
    chain: Gaps
    drift: Drift
    budget: ToleranceBudget
    iterations: int
    settled: bool


@dataclass(frozen=True)
class Swing:
    """How far hinges turn from their place before the pieces' bevels touch, in degrees; negative: they touch there.

    `inward_degrees` and `outward_degrees` are the least over all joints, towards a more convex and a more concave
    shell; `blocked` counts joints that cannot turn by the asked `wanted_degrees` both ways.
    """

    wanted_degrees: float
    inward_degrees: float
    outward_degrees: float
    blocked: int


@dataclass(frozen=True)
class Building:
    """What the order of building is like; lengths in mm.

    `border_mean_mm` and `border_max_mm` are of the open border over the steps, `breadth_first_mean_mm` its mean in a
    breadth-first order. `enclosed` counts pieces before the last that go in between neighbours on every side,
    `bridges` those that close the shell around a hole. The last piece goes in along its normal unless it overlaps the
    placed ones by `last_overlap_percent` of its volume; `last_candidates` were tried.
    """

    border_mean_mm: float
    border_max_mm: float
    breadth_first_mean_mm: float
    enclosed: int
    bridges: int
    last_goes_in: bool
    last_overlap_percent: float
    last_candidates: int


@dataclass(frozen=True)
class Overlapping:
    """Pairs of pieces that reach into one another.

    `pairs` at their places, by `largest_mm3` at most, which is `largest_percent` of the smaller piece, between `faces`;
    `swung` more, by `swung_mm3` at most, when one piece turns by `swing_degrees` about one of its hinges.
    """

    pairs: int
    largest_mm3: float
    largest_percent: float
    faces: tuple[int, int] | None
    swing_degrees: float
    swung: int
    swung_mm3: float


@dataclass(frozen=True)
class AssemblyFigures:
    """Whether and how the kit goes together."""

    closure: Closure
    swing: Swing
    building: Building
    overlap: Overlapping | None = None


@dataclass(frozen=True, eq=False)
class Assembly:
    """Pieces in the order of faces, joints in the order of edges, steps in the order of building."""

    pieces: tuple[Piece, ...]
    joints: tuple[Joint, ...]
    steps: tuple[Step, ...]
    figures: AssemblyFigures
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Distance:
    """Symmetric distance of two surfaces in percent of M_i's bounding-box diagonal."""

    mean_percent: float
    max_percent: float


@dataclass(frozen=True)
class CurvedMetrics:
    """What tables report of curved pieces; `surface_curved` is d_H of M_i and the assembled curved surface."""

    threshold_percent: float
    gap_mean_mm: float
    gap_p95_mm: float
    flat_break_mean_degrees: float
    flat_break_p95_degrees: float
    break_mean_degrees: float
    break_p95_degrees: float
    surface_curved: Distance


@dataclass(frozen=True)
class MergedMetrics:
    """What tables report of merged pieces: before and after, and how far corners lie from their shape's."""

    triangles: int
    triangle_classes: int
    single_triangles: int
    misfit_mean_mm: float
    misfit_max_mm: float


@dataclass(frozen=True)
class Metrics:
    """What tables report; lengths in mm of the printed object."""

    pieces: int
    classes: int
    unique_piece_parts: int
    mean_edge: float
    error_max: float
    error_max_percent: float
    error_mean: float
    error_mean_percent: float
    surface_simplified: Distance
    simplified_assembled: Distance
    surface_assembled: Distance
    dihedral_mean_degrees: float
    dihedral_p95_degrees: float
    concave_percent: float
    groove_mean_mm: float
    groove_max_mm: float
    genus: int
    iterations: int
    rigidity: Rigidity | None = None
    seconds: dict[str, float] = field(default_factory=dict)
    assembly: AssemblyFigures | None = None
    unique_connector_parts: int = 0
    groove_choices: tuple[GrooveChoice, ...] = ()
    curved: CurvedMetrics | None = None
    merged: MergedMetrics | None = None
    cut_corners: int = 0
    deepest_cut_mm: float = 0.0


@dataclass(frozen=True, eq=False)
class Kit:
    """A whole construction kit; every length in mm of the printed object.

    `spec` carries the automatic choices, so that the same kit can be made again from it. `writer` writes the folder,
    `documents` makes what people hold and look at: files by their names in the folder.
    """

    spec: KitSpec
    source: Source
    surface: TriMesh
    simplified: TriMesh
    decomposition: Decomposition
    part_set: PartSet
    assembly: Assembly
    metrics: Metrics
    notes: tuple[str, ...]
    writer: Callable[["Kit", Path, bool, StageProgress], Path]
    documents: Callable[["Kit", Progress], dict[str, bytes]]
    patches: Patches | None = None

    def write(self, folder: str | Path, *, force: bool = False, progress: StageProgress = nobody) -> Path:
        """Write the kit folder, whole or not at all, and return its path.

        Raises:
            KitFolderError: the folder exists and `force` is not given, or it cannot be written.
        """
        return self.writer(self, Path(folder), force, progress)
