"""The one function of this stage."""

from drkid.kit import Decomposition, Patches
from drkid.mesh import TriMesh
from drkid.patches.curved import curved_patches, units_per_mm
from drkid.patches.merging import merged_patches
from drkid.progress import Progress, silent
from drkid.spec import KitSpec


def make_patches(
    decomposition: Decomposition, surface: TriMesh, spec: KitSpec, progress: Progress = silent
) -> Patches | None:
    """Curved or merged patches where the spec asks for them, None where pieces are flat triangles.

    `surface` is M_i in the decomposition's unit: curved patches follow it.
    """
    if spec.patch == "curved":
        progress("bending patches", 0.0)
        return curved_patches(decomposition, surface, spec)
    if spec.merge is not None:
        progress("merging triangles", 0.0)
        return merged_patches(decomposition, spec, spec.merge_tolerance_mm * units_per_mm(decomposition, spec))
    return None
