"""How thick a closed surface's walls are, and whether pieces of a number are small enough for them.

The shape diameter (Shapira et al., "Consistent mesh partitioning", Visual Computer 24, 2008) with one ray to a face.
Distances to the background on the voxel grid were tried: its staircase makes every shape look thin.
"""

import math
from typing import Any

import igl
import numpy as np

from drkid.errors import InputError
from drkid.mesh import Bools, Floats, Ints, TriMesh

FACING_COSINE = -0.5  # of the angle between a wall's two sides: 120 degrees at least
LIFT_DIAGONALS = 1e-6  # rays start this much below the surface, so that they do not hit their own face
SHEET_EDGES = 0.35  # a wall thinner than this times the mean edge has no inside left for pieces to enclose
SHEET_SHARE = 0.5  # of the area on such walls, from which the simplified mesh would fold and collapse
THIN_EDGES, THIN_SHARE = 0.7, 0.15  # from here on the user should hear of it
MOST_SENSIBLE = 3000  # faces: nobody builds more
ALONGSIDE_COSINE = -math.cos(math.radians(20))  # of the angle between the sides of a part's wall; else it is an edge
STEP_MM = 2.0  # between the rays through a part's walls
SLIVER_MM = 0.05  # faces of a part that are narrower are none of a wall's sides
UPRIGHT_COSINE = math.sin(math.radians(20))  # between a rib's sides and the plane that it stands under
RIB_MM = 0.01  # what rounding adds to a rib's height
MOST_STEPS = 64  # of rays along a face's longest side


def wall_thickness(mesh: TriMesh) -> Floats:
    """(F,): from the middle of every face straight inwards to a wall that faces it; infinite where none does."""
    return _inwards(mesh, mesh.corners.mean(axis=1), np.arange(len(mesh.faces)), FACING_COSINE)


def _inwards(mesh: TriMesh, points: Floats, face: Ints, facing_cosine: float) -> Floats:
    """(n,): from points (n, 3) on faces (n,) straight inwards to a face that looks the other way, or infinite."""
    tree: Any = igl.AABB()
    tree.init(np.array(mesh.vertices), np.array(mesh.faces))
    lift, normals = LIFT_DIAGONALS * mesh.diagonal, mesh.face_normals[face]
    hit, beyond, _ = tree.intersect_ray_first(mesh.vertices, mesh.faces, points - lift * normals, -normals)
    facing = np.einsum("ij,ij->i", normals, mesh.face_normals[hit]) < facing_cosine
    return np.where((hit >= 0) & facing, np.asarray(beyond) + lift, np.inf)


def thinnest_wall_mm(mesh: TriMesh, rib_mm: float = 0.0) -> float:
    """The thinnest wall of a printed part, between two sides that are parallel within 20°; infinite where none is.

    By rays from points some `STEP_MM` apart on all faces that are no slivers. Ribs that stand no higher than `rib_mm`
    under a plane of the surface, as there are between the strokes of marks so deep, are no walls.
    """
    faces = np.flatnonzero(2 * mesh.areas > SLIVER_MM * mesh.side_lengths.max(axis=1))
    steps = np.clip(np.ceil(mesh.side_lengths[faces].max(axis=1) / STEP_MM), 1, MOST_STEPS).astype(np.int64)
    points, owner = list[Floats](), list[Ints]()
    for count in np.unique(steps).tolist():
        own = faces[steps == count]
        points.append(np.einsum("nk,fkc->fnc", _middles(count), mesh.corners[own]).reshape(-1, 3))
        owner.append(np.repeat(own, count**2))
    start, face = np.concatenate(points), np.concatenate(owner)
    found = _inwards(mesh, start, face, ALONGSIDE_COSINE)
    walls = np.isfinite(found)
    start, face, found = start[walls], face[walls], found[walls]
    if rib_mm:
        found[_on_ribs(mesh, faces, start, start - mesh.face_normals[face] * found[:, None], rib_mm)] = np.inf
    return float(found.min(initial=np.inf))


def _on_ribs(mesh: TriMesh, faces: Ints, start: Floats, end: Floats, rib_mm: float) -> Bools:
    """(n,): which walls from `start` to `end` (n, 3) lie within `rib_mm` under the plane of a face that they meet."""
    levels = np.einsum("fk,fk->f", mesh.face_normals, mesh.corners[:, 0])
    planes = np.unique(np.round(np.column_stack([mesh.face_normals, levels])[faces], 3), axis=0)
    out, along = np.zeros(len(start), np.bool_), end - start
    length = np.linalg.norm(along, axis=1)
    for normal, level in zip(planes[:, :3], planes[:, 3].tolist(), strict=True):
        under = level - np.stack([start, end]) @ normal
        near = ((under > -RIB_MM) & (under < rib_mm + RIB_MM)).all(axis=0)
        out |= near & (np.abs(along @ normal) < UPRIGHT_COSINE * length)
    return out


def _middles(count: int) -> Floats:
    """(count², 3): barycentric coordinates of the middles of a triangle's parts, its sides cut in `count`."""
    i, j = np.divmod(np.arange(count**2), count)
    lower = i + j < count
    a, b = np.where(lower, i + 1 / 3, count - i - 1 / 3), np.where(lower, j + 1 / 3, count - j - 1 / 3)
    return np.stack([a, b, count - a - b], axis=1) / count


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
