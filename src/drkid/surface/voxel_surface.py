"""The volume route: choose, fill, march, smooth."""

from dataclasses import replace

import numpy as np

from drkid.kit import LabelVolume, Source, Surface
from drkid.mesh import Floats, TriMesh
from drkid.progress import Progress
from drkid.spec import KitSpec
from drkid.surface.handle import MOST_TOLD, Closing, handles_kept, without_handles
from drkid.surface.marching_cubes import grid_surface, slid
from drkid.surface.staircase import without_staircase
from drkid.voxels import Components, Foreground, VoxelObject, Voxels, chosen_component, components, foreground
from drkid.voxels import voxel_object as object_of


def surface_of_volume(volume: LabelVolume, spec: KitSpec, progress: Progress) -> Surface:
    """The chosen object's surface.

    Raises:
        SpecError: label and threshold contradict each other or the volume.
        InputError: no such label or component, nothing inside, too few voxels, or more handles than can be closed.
    """
    progress("choosing the object", 0.0)
    inside = foreground(volume, spec)
    found = components(inside.mask)
    rank = chosen_component(found, spec)
    taken = object_of(inside, found, rank)
    closed: tuple[Closing, ...] = ()
    if spec.max_genus is not None:
        progress("closing handles", 0.2)
        mask, closed = without_handles(taken.mask, spec.max_genus, np.asarray(volume.spacing))
        taken = replace(taken, mask=mask)
    progress("marching cubes", 0.3)
    grid, other_bodies = grid_surface(taken.mask)
    progress("removing the staircase", 0.5)
    vertices, moved = _placed(grid, taken, inside, volume, spec)
    spacing = np.asarray(volume.spacing)
    mesh = grid.moved((vertices + taken.origin) * spacing)
    progress("surface", 1.0)
    return Surface(
        mesh,
        Source(volume.name, volume.sha256, volume.spacing, volume.unit, inside.label, inside.threshold, rank + 1),
        components=len(found.voxels),
        cavities_filled=taken.cavities,
        debris_dropped=len(found.voxels) - 1 + other_bodies,
        touches_border=bool(taken.border),
        max_displacement_voxels=moved,
        notes=(
            *volume.notes,
            *inside.notes,
            *_notes(found, rank, taken),
            *_closings(closed, taken, volume),
            *_more_than_asked(closed, mesh.genus, spec),
            *_notes_of(mesh, moved),
        ),
    )


def _placed(
    grid: TriMesh, taken: VoxelObject, inside: Foreground, volume: LabelVolume, spec: KitSpec
) -> tuple[Floats, float]:
    """Where the vertices lie, in indices of the object's mask, and how far smoothing moved them."""
    if inside.soft and inside.threshold is not None:
        return slid(grid, _excess_density(taken, volume.values, inside.threshold)), 0.0
    if spec.smooth:
        return without_staircase(grid, taken.mask, np.asarray(volume.spacing))
    return slid(grid, np.where(taken.mask, np.float32(1), np.float32(-1))), 0.0


def _excess_density(taken: VoxelObject, values: Voxels, threshold: float) -> Floats:
    """Density minus threshold around the object: positive exactly inside it, so that it alone has a surface.

    Beyond the volume, in other components and in filled cavities the density is as far from the threshold as it ever
    is on that side.
    """
    ends = [(start, start + size) for start, size in zip(taken.origin, taken.mask.shape, strict=True)]
    clipped = [(max(low, 0), min(high, size)) for (low, high), size in zip(ends, values.shape, strict=True)]
    window = tuple(slice(low, high) for low, high in clipped)
    margin = [(low - start, stop - high) for (low, high), (start, stop) in zip(clipped, ends, strict=True)]
    excess = np.pad(values[window].astype(np.float64) - threshold, margin, constant_values=-np.inf)
    highest, lowest = excess[taken.mask].max(), excess[np.isfinite(excess)].min()
    hair = 1e-6 * (highest - min(lowest, 0.0))
    inside = np.where(excess > 0, excess, np.where(excess < 0, highest, 0.0))
    outside = np.where((excess < 0) & np.isfinite(excess), excess, min(lowest, 0.0))
    return np.where(taken.mask, np.maximum(inside, hair), np.minimum(outside, -hair))


def _notes(found: Components, rank: int, taken: VoxelObject) -> list[str]:
    notes: list[str] = []
    others = len(found.voxels) - 1
    if others:
        left = sum(found.voxels) - taken.voxels
        notes.append(
            f"component {rank + 1} of {others + 1} taken ({taken.voxels} voxels); "
            f"{left} voxels in {others} other{'s' * (others > 1)} left out"
        )
    if taken.cavities:
        notes.append(f"{taken.cavities} enclosed {'cavities' if taken.cavities > 1 else 'cavity'} filled")
    if taken.border:
        notes.append(f"the object touches the end of the volume ({', '.join(taken.border)}) and is closed flat there")
    return notes


def _closings(closed: tuple[Closing, ...], taken: VoxelObject, volume: LabelVolume) -> list[str]:
    unit = volume.unit or "units"
    notes = [
        f"{'a handle' if one.handles == 1 else f'{one.handles} handles'} closed (--max-genus): "
        f"{one.voxels} voxel{'s' * (one.voxels > 1)} {one.way} at "
        f"({', '.join(f'{x:.4g}' for x in (one.centre + taken.origin) * volume.spacing)}) {unit}, "
        f"{one.across:.3g} {unit} across"
        for one in closed[:MOST_TOLD]
    ]
    if len(closed) > MOST_TOLD:
        left = closed[MOST_TOLD:]
        notes.append(
            f"{sum(one.handles for one in left)} more handles closed, with {sum(one.voxels for one in left)} voxels "
            f"in all, {max(one.across for one in left):.3g} {unit} across at most"
        )
    return notes


def _more_than_asked(closed: tuple[Closing, ...], genus: int, spec: KitSpec) -> list[str]:
    if spec.max_genus is None or not closed or genus >= spec.max_genus:
        return []
    return [
        f"--max-genus {spec.max_genus} left {genus}: handles that one patch of voxels closes go together; "
        f"to keep {spec.max_genus}, close the others in the segmentation"
    ]


def _notes_of(mesh: TriMesh, moved: float) -> list[str]:
    notes: list[str] = []
    if mesh.genus:
        notes.append(handles_kept(mesh.genus))
    if moved:
        notes.append(f"the staircase of voxels is removed: nothing moved by more than {moved:.2f} voxels")
    return notes
