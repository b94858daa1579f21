"""The palette that a spec asks for: lengths or multisets given from outside, or else those that the classes imply.

Given lengths fix the palette's ratios. Their common scale against the mesh stays free, for the printed size follows
from it; the system of lengths is then square but for that one freedom, as with free lengths.
"""

from dataclasses import replace

import numpy as np

from drkid.congruence.palette import MOST_CLASSES, Palette, all_multisets, palette_of_classes, parse_multisets
from drkid.congruence.palette_subset import best_subset, palette_for
from drkid.errors import SpecError
from drkid.mesh import TriMesh
from drkid.spec import KitSpec


def palette_of(spec: KitSpec, mesh: TriMesh, rng: np.random.Generator, *, large: bool = False) -> Palette:
    """The palette for a mesh, its ratios held where the spec gives the lengths.

    Args:
        spec: `palette` gives lengths, `multisets` the triangles; `classes` decides about what is not given.
        mesh: closed, in any unit; which triangles serve it best is searched for where that is open.
        rng: every random choice comes from it.
        large: the mesh is too large for that search.

    Raises:
        SpecError: no palette has so many classes, or a search would be needed on a large mesh.
    """
    if spec.palette is None:
        return _palette_of_any_lengths(spec, mesh, rng, large=large)
    ratios = tuple(length / spec.palette[0] for length in spec.palette)
    if spec.multisets is not None or len(ratios) == 2:
        return replace(_palette_of_any_lengths(spec, mesh, rng, large=large), ratios=ratios, held=True)
    if spec.classes == MOST_CLASSES or not large:
        return best_subset(mesh, Palette(ratios, all_multisets(3), held=True), spec.classes, rng)
    raise SpecError(
        f"which {spec.classes} classes of three lengths serve best is not searched for on {len(mesh.faces)} faces",
        wanted=f"the triangles themselves, or all {MOST_CLASSES}",
        found=f"classes {spec.classes}",
        remedy=f"--multisets aab,abc,bcc or another choice, --classes {MOST_CLASSES}, or fewer --faces",
    )


def _palette_of_any_lengths(spec: KitSpec, mesh: TriMesh, rng: np.random.Generator, *, large: bool) -> Palette:
    if spec.multisets is not None:
        return parse_multisets(spec.multisets)
    return palette_of_classes(spec.classes) if large else palette_for(mesh, spec.classes, rng)
