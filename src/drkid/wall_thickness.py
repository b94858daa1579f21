"""How thick a closed surface's walls are, and whether pieces of a number are small enough for them.

The shape diameter (Shapira et al., "Consistent mesh partitioning", Visual Computer 24, 2008) with one ray to a face.
Distances to the background on the voxel grid were tried: its staircase makes every shape look thin.
"""

import math
from typing import Any

import igl
import numpy as np

from drkid.errors import InputError
from drkid.mesh import Floats, TriMesh

FACING_COSINE = -0.5  # of the angle between a wall's two sides: 120 degrees at least
LIFT_DIAGONALS = 1e-6  # rays start this much below the surface, so that they do not hit their own face
SHEET_EDGES = 0.35  # a wall thinner than this times the mean edge has no inside left for pieces to enclose
SHEET_SHARE = 0.5  # of the area on such walls, from which the simplified mesh would fold and collapse
THIN_EDGES, THIN_SHARE = 0.7, 0.15  # from here on the user should hear of it
MOST_SENSIBLE = 3000  # faces: nobody builds more


def wall_thickness(mesh: TriMesh) -> Floats:
    """(F,): from the middle of every face straight inwards to a wall that faces it; infinite where none does."""
    tree: Any = igl.AABB()
    tree.init(np.array(mesh.vertices), np.array(mesh.faces))
    lift = LIFT_DIAGONALS * mesh.diagonal
    start = mesh.corners.mean(axis=1) - lift * mesh.face_normals
    hit, beyond, _ = tree.intersect_ray_first(mesh.vertices, mesh.faces, start, -mesh.face_normals)
    facing = np.einsum("ij,ij->i", mesh.face_normals, mesh.face_normals[hit]) < FACING_COSINE
    return np.where((hit >= 0) & facing, np.asarray(beyond) + lift, np.inf)


def even_edge(area: float, faces: int) -> float:
    """The edge of so many equilateral triangles of this total area."""
    return math.sqrt(4 * area / (math.sqrt(3) * faces))


def thickness_below(mesh: TriMesh, thickness: Floats, share: float) -> float:
    """The thickness below which this share of the whole area lies; infinite where not so much of it has a wall."""
    order = np.argsort(thickness)
    reached = np.cumsum(mesh.areas[order])
    at = int(np.searchsorted(reached, share * reached[-1]))
    return float(thickness[order[min(at, len(order) - 1)]])


def faces_that_resolve(area: float, thickness: float, edges: float) -> int:
    """The least even number of faces whose edge times `edges` is at most the thickness."""
    return 2 * math.ceil(2 * area / (math.sqrt(3) * (thickness / edges) ** 2))


def require_walls(mesh: TriMesh, faces: int) -> tuple[str, ...]:
    """What a user should know of thin walls before so many pieces are made of the surface.

    Raises:
        InputError: most of the surface is a sheet to pieces of this size; says how many faces would resolve it.
    """
    thickness, area = wall_thickness(mesh), float(mesh.areas.sum())
    edge = even_edge(area, faces)
    middle = thickness_below(mesh, thickness, SHEET_SHARE)
    if middle < SHEET_EDGES * edge:
        raise _sheet(mesh, thickness, edge, faces, middle)
    lower = thickness_below(mesh, thickness, THIN_SHARE)
    if lower >= THIN_EDGES * edge:
        return ()
    share = 100 * _share_below(mesh, thickness, THIN_EDGES * edge)
    needed = faces_that_resolve(area, lower, THIN_EDGES)
    return (
        f"{share:.0f} % of the surface lies on walls thinner than {THIN_EDGES:g} of an edge: "
        f"{needed} faces would resolve all but {100 * THIN_SHARE:.0f} %",
    )


def _share_below(mesh: TriMesh, thickness: Floats, limit: float) -> float:
    return float(mesh.areas[thickness < limit].sum() / mesh.areas.sum())


def _sheet(mesh: TriMesh, thickness: Floats, edge: float, faces: int, middle: float) -> InputError:
    needed = faces_that_resolve(float(mesh.areas.sum()), middle, SHEET_EDGES)
    share = 100 * _share_below(mesh, thickness, SHEET_EDGES * edge)
    remedy = f"--faces {needed} or more resolve it"
    if needed > MOST_SENSIBLE:
        remedy = f"{needed} faces would resolve it, which nobody builds: it is a sheet, not a body; thicken it first"
    return InputError(
        f"the shape is too thin for {faces} pieces: they would fold through one another",
        wanted=f"walls thicker than {SHEET_EDGES:g} of the mean edge, {SHEET_EDGES * edge:.4g}",
        found=f"{share:.0f} % of the surface on thinner walls, half of it on walls below {middle:.4g}",
        remedy=remedy,
    )
