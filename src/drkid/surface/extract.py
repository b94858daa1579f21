"""extract_surface: the two routes to M_i."""

from pathlib import Path

from drkid.kit import LabelVolume, Surface
from drkid.progress import Progress, silent
from drkid.spec import KitSpec
from drkid.surface.mesh_file import surface_of_mesh_file
from drkid.surface.voxel_surface import surface_of_volume


def extract_surface(source: LabelVolume | Path, spec: KitSpec, progress: Progress = silent) -> Surface:
    """M_i: one closed, manifold, connected surface with its faces outwards, in the source's coordinates and unit.

    Of a volume: the chosen label, or what lies at and above the threshold; of that one 26-connected component, its
    cavities filled; marching cubes (Lewiner et al. 2003), then the staircase of a mask removed. A voxel of index
    (i, j, k) has its centre at index × spacing. Of a mesh file (a Path): welded, cleaned, one body.

    Raises:
        SpecError: a parameter that the source has no use for, or label and threshold together.
        InputError: no such label or component, nothing inside, a speck; a mesh that is broken, open or not manifold.
    """
    if isinstance(source, Path):
        return surface_of_mesh_file(source, spec, progress)
    return surface_of_volume(source, spec, progress)
