"""How far the simplified mesh M_s will be from M_i at a number of faces, and how many faces a distance needs.

The distance of an even mesh of inscribed triangles from a smooth surface falls with the square of the edge, that is
with one over the faces (Fejes Tóth 1953, Gruber 1993); thin and rough shapes fall more slowly. So a power law
d = a · F^−b is put through two quick remeshes of the very shape, and a wanted distance is tried before it is told.
"""

import math
from dataclasses import dataclass

import numpy as np

from drkid.errors import DrkidError, InputError
from drkid.kit import Surface
from drkid.measure import hausdorff
from drkid.remesh import simplify
from drkid.spec import KitSpec

ANCHORS = (120, 400)  # faces of the quick remeshes
SHOWN = (80, 120, 172, 260, 400, 600, 1000)  # faces of the table
QUICK = {"vertices": None, "lloyd_iterations": 3, "newton_iterations": 8}
SAMPLES = 10_000
MOST_FACES = 20_000
LEAST_FACES = 20
TRIES = 4
NEAR = 0.95  # a mesh this near below the wanted distance has not many faces too many


@dataclass(frozen=True)
class ExpectedDistance:
    """Distance of M_s from M_i in percent of M_i's bounding box diagonal, as the kit's figures have it."""

    faces: int
    mean_percent: float
    max_percent: float


def quick_distance(surface: Surface, spec: KitSpec, faces: int) -> ExpectedDistance:
    """Of a real remesh with fewer iterations.

    Raises:
        DrkidError: the surface cannot be remeshed with so many faces.
    """
    quick = spec.model_copy(update={**QUICK, "faces": faces})
    simplified = simplify(surface, quick).mesh
    found = hausdorff(surface.mesh, simplified, np.random.default_rng(spec.seed), SAMPLES)
    percent = 100 / surface.mesh.diagonal
    return ExpectedDistance(faces, found.mean * percent, found.max * percent)


def expected_distances(surface: Surface, spec: KitSpec) -> tuple[ExpectedDistance, ...]:
    """The table for the faces SHOWN; empty where the surface cannot be remeshed at both ANCHORS.

    It is empty, too, where more faces bring no smaller distance: a shape so thin for them follows no law.
    """
    try:
        low, high = (quick_distance(surface, spec, faces) for faces in ANCHORS)
    except DrkidError:
        return ()
    if high.mean_percent >= low.mean_percent:
        return ()
    return tuple(_on_law(low, high, faces) for faces in SHOWN)


def _on_law(low: ExpectedDistance, high: ExpectedDistance, faces: int) -> ExpectedDistance:
    along = math.log(faces / low.faces) / math.log(high.faces / low.faces)
    mean, most = (
        a * (b / a) ** along for a, b in ((low.mean_percent, high.mean_percent), (low.max_percent, high.max_percent))
    )
    return ExpectedDistance(faces, mean, max(mean, most))


def faces_for_distance(surface: Surface, spec: KitSpec, mean_percent: float) -> ExpectedDistance:
    """About the fewest faces whose M_s is within a mean distance of M_i, tried by a quick remesh.

    Raises:
        InputError: not even MOST_FACES would do.
        DrkidError: the surface cannot be remeshed.
    """
    found = quick_distance(surface, spec, ANCHORS[0])
    best: ExpectedDistance | None = None
    for _ in range(TRIES):
        if found.mean_percent <= mean_percent and (best is None or found.faces < best.faces):
            best = found
        if NEAR * mean_percent <= found.mean_percent <= mean_percent:
            break
        faces = _even(found.faces * found.mean_percent / (0.98 * mean_percent))
        if faces == found.faces:
            break
        if faces > MOST_FACES:
            raise InputError(
                f"no kit of a sensible size is within {mean_percent:g} % of this shape on average",
                wanted=f"at most {MOST_FACES} faces",
                found=f"about {faces} would be needed",
                remedy="a larger --for-distance-percent",
            )
        found = quick_distance(surface, spec, faces)
    if best is None or (found.mean_percent <= mean_percent and found.faces < best.faces):
        best = found
    return best


def _even(faces: float) -> int:
    return max(LEAST_FACES, 2 * math.ceil(faces / 2))
