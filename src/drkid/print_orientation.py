"""Print orientation: which way up a part is printed, so that it needs no support."""

from math import inf

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull

from drkid.mesh import Floats, Ints, TriMesh
from drkid.solid import widest_circle_mm

STEEPEST_DEGREES = 45.0  # from the vertical: what leans out more needs support or a bridge
AS_STEEP = 1e-4  # of a normal: the flanks of a detent lean by 45° to single precision
ON_BED_MM = 0.02
SAME_DIRECTION = 1e-3
DECIMALS = 6  # of a facet's plane: the triangles of one facet have it to this
WIDTH_STEP_MM = 0.5  # bridges that differ by less are as good as each other


def print_orientation(mesh: TriMesh, longest_bridge_mm: float = inf) -> Floats:
    """(3, 3) proper rotation that turns a part as it is printed.

    Tried are all ways to rest on a facet of the convex hull; taken is the one with the least bridge beyond the longest
    that prints, then the narrowest free patch, then the least area that leans out by more than 45°, then the lowest,
    then the one with most of it on the bed.
    """
    normals, areas = _resting_facets(mesh)
    turns = [turned_down(normal) for normal in normals]
    return min(zip(turns, areas, strict=True), key=lambda pair: _preference(mesh, *pair, longest_bridge_mm))[0]


def widest_bridge_mm(mesh: TriMesh) -> float:
    """How wide a part's widest bridge is as it lies: twice as far as any of it is from where it is held; 0: none is.

    That is the diameter of the largest circle in the plan of a connected patch that leans out by more than 45° and does
    not lie on the bed.
    """
    return max((_circle_mm(mesh, patch) for patch in _free_patches(mesh)), default=0.0)


def free_width_mm(mesh: TriMesh) -> float:
    """How wide at most a part's free patches are as it lies, across a side of their hulls: no bridge is wider."""
    return max((_least_width(mesh.corners[p].reshape(-1, 3)[:, :2]) for p in _free_patches(mesh)), default=0.0)


def turned_down(normal: Floats) -> Floats:
    """The rotation that takes a direction to −z by the shortest way; half a turn about x where it is +z."""
    x, y, z = normal
    if z > 1 - SAME_DIRECTION**2:
        return np.diag([1.0, -1.0, -1.0])
    if z < -1 + SAME_DIRECTION**2:
        return np.eye(3)
    axis = np.array([-y, x, 0.0]) / np.hypot(x, y)  # normal × (−z) turned into the plane
    cosine, sine = -z, np.hypot(x, y)
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + sine * cross + (1 - cosine) * cross @ cross


def _preference(
    mesh: TriMesh, turn: Floats, resting_area: float, longest_bridge_mm: float
) -> tuple[float, float, float, float, float]:
    turned = mesh.moved(mesh.vertices @ turn.T)
    patches = _free_patches(turned)
    widths = [_least_width(turned.corners[patch].reshape(-1, 3)[:, :2]) for patch in patches]  # no circle is wider
    wide = [patch for patch, width in zip(patches, widths, strict=True) if width > longest_bridge_mm]
    beyond = max((_circle_mm(turned, patch) - longest_bridge_mm for patch in wide), default=0.0)
    leaning = sum(float((turned.areas * -turned.face_normals[:, 2])[patch].sum()) for patch in patches)
    return (
        float(np.ceil(max(beyond, 0.0) / WIDTH_STEP_MM - 1e-6)),
        float(np.ceil(max(widths, default=0.0) / WIDTH_STEP_MM - 1e-6)),
        round(leaning, 1),
        round(float(turned.extents[2]), 2),
        -round(resting_area, 2),
    )


def _circle_mm(mesh: TriMesh, patch: Ints) -> float:
    return widest_circle_mm(mesh.corners[patch][:, ::-1, :2])  # from above its faces run the other way round


def _free_patches(mesh: TriMesh) -> list[Ints]:
    """The faces of each patch, connected, that leans out by more than 45° and does not lie on the bed."""
    leaning = mesh.face_normals[:, 2] < -np.cos(np.radians(STEEPEST_DEGREES)) - AS_STEEP
    free = np.flatnonzero(leaning & (mesh.corners[:, :, 2].max(axis=1) > mesh.vertices[:, 2].min() + ON_BED_MM))
    first, second, third = mesh.faces[free].T
    count = len(mesh.vertices)
    links = coo_array((np.ones(2 * len(free)), (np.tile(first, 2), np.r_[second, third])), shape=(count, count))
    label = connected_components(links.tocsr(), directed=False)[1][first]
    return [free[label == k] for k in np.unique(label)]


def _resting_facets(mesh: TriMesh) -> tuple[Floats, Floats]:
    """Outward normals (n, 3) of the hull's facets that the part itself lies in, and the area it rests on (n,)."""
    equations = np.unique(np.round(ConvexHull(mesh.vertices).equations, DECIMALS), axis=0)
    level = (mesh.corners @ equations[:, :3].T + equations[:, 3] > -ON_BED_MM).all(axis=1)  # (F, n)
    areas = mesh.areas @ level
    chosen = list[int]()
    for k in np.argsort(-areas, kind="stable").tolist():
        if areas[k] <= areas.max() / 20:  # it stands on no sliver
            break
        if all(equations[k, :3] @ equations[other, :3] <= 1 - SAME_DIRECTION for other in chosen):
            chosen.append(k)
    return equations[chosen, :3], areas[chosen]


def _least_width(points: Floats) -> float:
    """Least width of a flat set of points (n, 2): across a side of its hull; 0 where it is a line."""
    if len(points) < 3 or np.linalg.matrix_rank(points - points[0], tol=1e-9) < 2:
        return 0.0
    normals = ConvexHull(points).equations[:, :2]
    return float(np.ptp(points @ normals.T, axis=0).min())
