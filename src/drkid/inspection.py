"""inspect_source: what a file holds and what `make` would take from it, without making anything."""

import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from drkid.errors import InputError, SpecError
from drkid.expected_distance import ExpectedDistance, expected_distances, faces_for_distance
from drkid.formats import is_mesh_path, sha256_of, suffix_of
from drkid.kit import LabelVolume, Surface, VolumeKind
from drkid.mesh import Floats, TriMesh
from drkid.spec import KitSpec, Unit
from drkid.surface import extract_surface
from drkid.volume import read_volume
from drkid.voxels import (
    FEWEST_VOXELS,
    Components,
    Foreground,
    Voxels,
    components,
    foreground,
    label_boxes,
    label_counts,
    otsu_threshold,
    voxel_object,
)
from drkid.wall_thickness import even_edge, require_walls, wall_thickness

COMPONENTS_LISTED = 10
THIN_SHARE = 0.01  # of the area that has a wall opposite

Triple = tuple[float, float, float]
Index = tuple[int, int, int]


@dataclass(frozen=True)
class LabelFacts:
    """One label: voxels, and the first and last index of its bounding box."""

    label: int
    voxels: int
    first: Index
    last: Index
    touches_border: bool


@dataclass(frozen=True)
class VolumeFacts:
    """`labels` for label volumes and masks; `density_range` and `otsu_threshold` for densities."""

    shape: tuple[int, ...]
    dtype: str
    kind: VolumeKind
    spacing: Triple
    labels: tuple[LabelFacts, ...] = ()
    density_range: tuple[float, float] | None = None
    otsu_threshold: float | None = None


@dataclass(frozen=True)
class MeshFacts:
    """The chosen body of a mesh file once it is welded; it is closed, or it would have been refused."""

    vertices: int
    faces: int
    bodies: int
    closed: bool
    extents: Triple


@dataclass(frozen=True)
class ComponentFacts:
    """One component of what is inside; `genus` is None where it is too small for a surface."""

    component: int
    voxels: int
    cavities: int
    touches_border: bool
    genus: int | None


@dataclass(frozen=True)
class Thickness:
    """Local thickness in the source's unit, and in voxels of the mean size (None for a mesh).

    1 % of the area lies on walls thinner than `thin`, half of it on walls thinner than `typical`. (The very least
    is left out: it is that of a single crease.)
    """

    thin: float
    typical: float
    thin_voxels: float | None
    typical_voxels: float | None


@dataclass(frozen=True)
class Taken:
    """What `make` would take; lengths in the source's unit.

    `mean_edge` is that of `faces` equilateral triangles of the same total area; None where the pieces are too few for
    the genus.
    """

    label: int | None
    threshold: float | None
    component: int | None
    genus: int
    area: float
    volume: float
    extents: Triple
    faces: int | None
    vertices: int | None
    mean_edge: float | None


@dataclass(frozen=True)
class Inspection:
    """Either `volume` or `mesh` is given; `warnings` are what may spoil a kit, `notes` what was assumed.

    `distances` are those expected of M_s at several numbers of faces; `recommended` is what a wanted one needs.
    """

    name: str
    format: str
    sha256: str
    unit: Unit | None
    volume: VolumeFacts | None
    mesh: MeshFacts | None
    component_count: int
    components: tuple[ComponentFacts, ...]
    taken: Taken
    thickness: Thickness | None
    notes: tuple[str, ...]
    warnings: tuple[str, ...]
    distances: tuple[ExpectedDistance, ...] = ()
    recommended: ExpectedDistance | None = None

    def to_dict(self) -> dict[str, Any]:
        """Plain dictionaries, lists and numbers, as for JSON."""
        return asdict(self)


def inspect_source(path: Path, spec: KitSpec, for_distance_percent: float | None = None) -> Inspection:
    """What the file holds, what `make` would take from it with this spec, and what may spoil the kit.

    Args:
        path: a volume or a mesh file.
        spec: the parameters that `make` would get.
        for_distance_percent: mean distance from M_i to M_s, in percent of the box's diagonal, to find the faces for.

    Raises:
        SpecError: a parameter that the source has no use for.
        InputError: whatever `make` would refuse the file for.
    """
    if is_mesh_path(path):
        return _inspect_mesh(path, spec, for_distance_percent)
    volume = read_volume(path, spec)
    surface = extract_surface(volume, spec)
    inside = foreground(volume, spec)
    found = components(inside.mask)
    taken, warnings = _taken(surface, spec)
    thickness = _thickness(surface.mesh, math.prod(volume.spacing) ** (1 / 3))
    return Inspection(
        name=path.name,
        format=str(suffix_of(path)),
        sha256=volume.sha256,
        unit=volume.unit,
        volume=_volume_facts(volume),
        mesh=None,
        component_count=len(found.voxels),
        components=_component_facts(volume, inside, found, surface),
        taken=taken,
        thickness=thickness,
        notes=surface.notes,
        warnings=(*warnings, *_thin_warning(thickness, taken, volume.unit), *_border_warning(surface)),
        distances=expected_distances(surface, spec),
        recommended=_recommended(surface, spec, for_distance_percent),
    )


def _recommended(surface: Surface, spec: KitSpec, percent: float | None) -> ExpectedDistance | None:
    return None if percent is None else faces_for_distance(surface, spec, percent)


def _inspect_mesh(path: Path, spec: KitSpec, for_distance_percent: float | None) -> Inspection:
    surface = extract_surface(path, spec)
    mesh = surface.mesh
    taken, warnings = _taken(surface, spec)
    thickness = _thickness(mesh, None)
    return Inspection(
        name=path.name,
        format=str(suffix_of(path)),
        sha256=sha256_of(path),
        unit=spec.unit,
        volume=None,
        mesh=MeshFacts(
            len(mesh.vertices), len(mesh.faces), surface.components, mesh.is_closed_manifold, _triple(mesh.extents)
        ),
        component_count=surface.components,
        components=(),
        taken=taken,
        thickness=thickness,
        notes=surface.notes,
        warnings=(*warnings, *_thin_warning(thickness, taken, spec.unit)),
        distances=expected_distances(surface, spec),
        recommended=_recommended(surface, spec, for_distance_percent),
    )


# ---- what make would take


def _taken(surface: Surface, spec: KitSpec) -> tuple[Taken, tuple[str, ...]]:
    mesh, source = surface.mesh, surface.source
    area = float(mesh.areas.sum())
    warnings: tuple[str, ...] = ()
    faces = vertices = mean_edge = None
    try:
        vertices = spec.vertex_count(mesh.genus)
    except SpecError as error:
        warnings = (str(error),)
    try:
        warnings += require_walls(mesh, spec.face_count(mesh.genus))
    except InputError as error:
        warnings += (str(error),)
    if vertices is not None:
        faces = 2 * vertices - 4 + 4 * mesh.genus
        mean_edge = even_edge(area, faces)
    taken = Taken(
        source.label,
        source.threshold,
        source.component,
        mesh.genus,
        area,
        mesh.volume,
        _triple(mesh.extents),
        faces,
        vertices,
        mean_edge,
    )
    return taken, warnings


def _triple(lengths: Floats) -> Triple:
    return float(lengths[0]), float(lengths[1]), float(lengths[2])


def _component_facts(
    volume: LabelVolume, inside: Foreground, found: Components, surface: Surface
) -> tuple[ComponentFacts, ...]:
    facts: list[ComponentFacts] = []
    for rank, voxels in enumerate(found.voxels[:COMPONENTS_LISTED]):
        part = voxel_object(inside, found, rank)
        genus = surface.mesh.genus if rank + 1 == surface.source.component else None
        if genus is None and voxels >= FEWEST_VOXELS:
            one = KitSpec(label=inside.label, threshold=inside.threshold, component=rank + 1, smooth=False)
            genus = extract_surface(volume, one).mesh.genus
        facts.append(ComponentFacts(rank + 1, voxels, part.cavities, bool(part.border), genus))
    return tuple(facts)


# ---- what the volume holds


def _volume_facts(volume: LabelVolume) -> VolumeFacts:
    values: Voxels = volume.values
    shape, dtype = values.shape, str(values.dtype)
    if volume.kind == "density":
        density = float(values.min()), float(values.max())
        return VolumeFacts(shape, dtype, volume.kind, volume.spacing, (), density, otsu_threshold(values))
    return VolumeFacts(shape, dtype, volume.kind, volume.spacing, _label_facts(values))


def _label_facts(values: Voxels) -> tuple[LabelFacts, ...]:
    facts: list[LabelFacts] = []
    counts = label_counts(values)
    for (label, voxels), (x, y, z) in zip(counts.items(), label_boxes(values, list(counts)), strict=True):
        ends = zip((x, y, z), values.shape, strict=True)
        border = any(side.start == 0 or side.stop == size for side, size in ends)
        first, last = (x.start, y.start, z.start), (x.stop - 1, y.stop - 1, z.stop - 1)
        facts.append(LabelFacts(label, voxels, first, last, border))
    return tuple(facts)


# ---- thin places


def _thickness(mesh: TriMesh, voxel: float | None) -> Thickness | None:
    """Of the area that has a wall opposite; None where no wall has."""
    found = wall_thickness(mesh)
    walls = np.flatnonzero(np.isfinite(found))
    if not walls.size:
        return None
    walls = walls[np.argsort(found[walls])]
    share = np.cumsum(mesh.areas[walls])
    thin, typical = (float(found[walls[np.searchsorted(share, part * share[-1])]]) for part in (THIN_SHARE, 0.5))
    return Thickness(thin, typical, thin / voxel if voxel else None, typical / voxel if voxel else None)


def _thin_warning(thickness: Thickness | None, taken: Taken, unit: Unit | None) -> tuple[str, ...]:
    if thickness is None or taken.mean_edge is None or thickness.thin >= taken.mean_edge:
        return ()
    voxels = f" ({thickness.thin_voxels:.1f} voxels)" if thickness.thin_voxels else ""
    return (
        f"thin places: {thickness.thin:.3g} {unit or 'units'}{voxels}, thinner than the pieces' mean edge of "
        f"{taken.mean_edge:.3g}: more --faces make the pieces smaller",
    )


def _border_warning(surface: Surface) -> tuple[str, ...]:
    return ("the object is cut off by the end of the volume",) if surface.touches_border else ()
