"""The one page that calls the stages in order: `make_kit(source, spec) -> Kit`."""

import time
from collections.abc import Callable, Generator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from pathlib import Path

from drkid.assembly import assemble
from drkid.congruence import decompose
from drkid.congruence.decompose import rigidity_of
from drkid.data import nucleus_path
from drkid.export import write_kit
from drkid.formats import is_mesh_path
from drkid.intersection import self_intersections
from drkid.kit import Decomposition, Kit, PartSet, Patches, Simplified, Surface
from drkid.mesh import TriMesh
from drkid.metrics import measure_kit
from drkid.moulds import corrected_faces, faces_at_size, require_agreement, size_notes, with_moulds_of
from drkid.parts import make_parts
from drkid.patches import flattened_patches, make_patches
from drkid.progress import Progress, StageProgress, nobody, silent
from drkid.remesh import simplify
from drkid.report import make_documents
from drkid.spec import DEFAULT_FACES, KitSpec
from drkid.surface import extract_surface
from drkid.volume import read_volume
from drkid.wall_thickness import require_walls

ROUNDING = 1e-9  # of a tolerance that is held against the one that was asked
STAGES = ("surface", "remesh", "congruence", "patches", "parts", "assembly", "measure")


def make_kit(source: str | Path | None = None, spec: KitSpec | None = None, progress: StageProgress = nobody) -> Kit:
    """Make a construction kit from a segmented volume or a mesh.

    Args:
        source: file of a volume (.mrc, .nii, .tif, .nrrd, .npy, …) or a closed mesh (.stl, .ply, .obj, …); the
            bundled cell nucleus where None.
        spec: all parameters; the defaults where None.
        progress: told how far each stage is.

    Returns:
        The kit, every length in millimetres of the printed object; `kit.write(folder)` writes it.

    Raises:
        DrkidError: a file that cannot be used, or parameters that cannot be met; says what to try.
    """
    spec = with_moulds_of(KitSpec() if spec is None else spec)
    seconds: dict[str, float] = {}

    @contextmanager
    def stage(name: str) -> Generator[Progress]:
        start = time.perf_counter()
        progress(name, "", 0.0)
        yield lambda what, fraction: progress(name, what, fraction)
        seconds[name] = time.perf_counter() - start
        progress(name, "", 1.0)

    with stage("surface") as told:
        surface = read_surface(source, spec, told)
    with stage("remesh") as told:
        spec, simplified = _simplified(surface, spec, told)
    with stage("congruence") as told:
        decomposition = decompose(simplified.mesh, spec, told, simplified.target)
    triangles = decomposition
    patches, part_set = _cut(triangles, surface.mesh, spec, stage)
    decomposition = decomposition if patches is None else _as_stiff_as_moved(patches.decomposition, triangles)
    unmerged = triangles if spec.merge else decomposition
    patches = None if patches is None else flattened_patches(patches, part_set.patch_share, spec.subdivision_levels)
    scale = part_set.scale_mm_per_unit
    printed = _scaled(part_set.by_parts(decomposition), scale)
    with stage("assembly") as told:
        assembly = assemble(printed.mesh, part_set, told, spec)
    with stage("measure"):
        surfaces = surface.mesh.scaled(scale), simplified.mesh.scaled(scale)
        metrics = measure_kit(*surfaces, printed, part_set, {}, patches, len(triangles.class_lengths))
    return Kit(
        spec=_resolved(spec, surface, unmerged, part_set).model_copy(
            update=_patch_choices(spec, patches, len(triangles.class_lengths), scale)
        ),
        source=surface.source,
        surface=surfaces[0],
        simplified=surfaces[1],
        decomposition=printed,
        part_set=part_set,
        assembly=assembly,
        metrics=replace(metrics, seconds=seconds, assembly=assembly.figures),
        notes=(
            *surface.notes,
            *simplified.notes,
            *printed.notes,
            *(patches.notes if patches else ()),
            *part_set.notes,
            *size_notes(spec, printed.mesh),
            *_crossings(printed),
            *assembly.notes,
        ),
        writer=write_kit,
        documents=make_documents,
        patches=patches,
    )


def read_surface(source: str | Path | None, spec: KitSpec, progress: Progress = silent) -> Surface:
    """M_i of a file, or of the bundled nucleus: the first stages of `make_kit` alone.

    Raises:
        DrkidError: the file cannot be used.
    """
    path = nucleus_path() if source is None else Path(source)
    return extract_surface(path if is_mesh_path(path) else read_volume(path, spec), spec, progress)


def _simplified(surface: Surface, spec: KitSpec, progress: Progress) -> tuple[KitSpec, Simplified]:
    """M_s, and the spec with the number of faces where it follows from given lengths and a size."""
    if spec.palette is None or spec.size_mm is None:
        return spec, _remeshed(surface, spec, progress)
    if spec.faces is not None or spec.vertices is not None:
        simplified = _remeshed(surface, spec, progress)
        require_agreement(simplified.mesh, spec)
        return spec, simplified
    spec = spec.model_copy(update={"faces": faces_at_size(surface.mesh, spec)})
    simplified = _remeshed(surface, spec, progress)
    better = corrected_faces(simplified.mesh, spec)
    if better == spec.faces:
        return spec, simplified
    spec = spec.model_copy(update={"faces": better})
    return spec, _remeshed(surface, spec, progress)


def _remeshed(surface: Surface, spec: KitSpec, progress: Progress) -> Simplified:
    """M_s, once the walls are known to be thick enough for pieces of its size."""
    thin = require_walls(surface.mesh, spec.face_count(surface.mesh.genus))
    simplified = simplify(surface, spec, progress)
    return replace(simplified, notes=(*thin, *simplified.notes))


def _cut(
    triangles: Decomposition, surface: TriMesh, spec: KitSpec, stage: Callable[[str], AbstractContextManager[Progress]]
) -> tuple[Patches | None, PartSet]:
    """Patches and parts: once more where the print is larger than the one for which patches kept their tolerance."""
    with stage("patches") as told:
        patches = make_patches(triangles, surface, spec, told)
    with stage("parts") as told:
        part_set = make_parts(_to_cut(triangles, patches), spec, told, patches)
        sized = _sized(spec, triangles, patches, part_set)
        if sized is not None:
            patches = make_patches(triangles, surface, sized, told)
            part_set = make_parts(_to_cut(triangles, patches), spec, told, patches)
    return patches, part_set


def _to_cut(triangles: Decomposition, patches: Patches | None) -> Decomposition:
    """What parts are made from: merged pieces from the triangles, curved ones from their own classes."""
    return triangles if patches is None or patches.merged else patches.decomposition


def _sized(spec: KitSpec, triangles: Decomposition, patches: Patches | None, part_set: PartSet) -> KitSpec | None:
    """The spec with the size that was found, where patches kept a tolerance for a smaller one; None where it holds."""
    asked = spec.merge_tolerance_mm if spec.merge is not None else spec.curved_gap_mm
    if patches is None or patches.allowance is None or asked is None:
        return None
    if patches.allowance * part_set.scale_mm_per_unit <= asked * (1 + ROUNDING):
        return None
    size_mm = float(triangles.mesh.extents.max()) * part_set.scale_mm_per_unit
    return spec.model_copy(update={"size_mm": size_mm, "mean_edge_mm": None, "fit": False})


def _scaled(decomposition: Decomposition, scale: float) -> Decomposition:
    """In millimetres of the printed object."""
    return replace(
        decomposition,
        mesh=decomposition.mesh.scaled(scale),
        class_lengths=decomposition.class_lengths * scale,
        face_errors=decomposition.face_errors * scale,
        scale_mm_per_unit=None if decomposition.scale_mm_per_unit is None else 1.0,
    )


def _crossings(decomposition: Decomposition) -> tuple[str, ...]:
    count = len(self_intersections(decomposition.mesh))
    return (f"{count} pairs of faces of the assembled surface cut each other: take more faces",) if count else ()


def _as_stiff_as_moved(found: Decomposition, before: Decomposition) -> Decomposition:
    """The rigidity of the mesh as it is, where merging has moved its vertices."""
    if found.rigidity is None or (found.mesh.vertices == before.mesh.vertices).all():
        return found
    return replace(found, rigidity=rigidity_of(found.mesh))


def _resolved(spec: KitSpec, surface: Surface, unmerged: Decomposition, part_set: PartSet) -> KitSpec:
    """The spec with every automatic choice filled in, so that the same kit can be made from it again.

    The size is that of the mesh before triangles are merged, which may move its vertices.
    """
    size_mm = float(unmerged.mesh.extents.max()) * part_set.scale_mm_per_unit
    source, dimensions = surface.source, part_set.dimensions
    return spec.model_copy(
        update={
            "label": source.label,
            "threshold": source.threshold,
            "component": source.component,
            "spacing": source.voxel_size,
            "unit": source.voxel_unit,
            "faces": None if spec.vertices is not None else spec.faces or DEFAULT_FACES,
            "tolerance_percent": spec.tolerance_for(len(unmerged.mesh.faces)),
            "seconds": None,
            "rounds": unmerged.iterations if spec.method == "palette" else None,
            "size_mm": None if spec.palette is not None else round(size_mm, 9),
            "thickness_mm": dimensions.thickness_mm,
            "clearance_mm": dimensions.clearance_mm,
            "rod_clearance_mm": dimensions.rod_clearance_mm,
            "rod_diameter_mm": dimensions.rod_diameter_mm or None,
            "min_wall_mm": dimensions.min_wall_mm,
            "knuckle_wall_mm": dimensions.knuckle_wall_mm,
            "knuckles": dimensions.knuckles or None,
            "mean_edge_mm": None,
            "fit": False,
            "mark_depth_mm": spec.engraving_depth_mm,
        }
    )


def _patch_choices(spec: KitSpec, patches: Patches | None, triangle_classes: int, scale: float) -> dict[str, object]:
    """The automatic choices of curved and merged pieces, in millimetres of the print."""
    if patches is None or patches.allowance is None:
        return {} if patches is None else {"curved_classes": spec.curved_classes_for(triangle_classes)}
    allowance_mm = patches.allowance * scale
    if spec.merge is not None:
        return {"merge_tolerance_mm": allowance_mm}
    return {"curved_classes": spec.curved_classes_for(triangle_classes), "curved_gap_mm": allowance_mm}
