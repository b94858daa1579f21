"""Print orientation: which way up a part is printed, so that it needs no support."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull

from drkid.mesh import Bools, Floats, TriMesh

STEEPEST_DEGREES = 45.0  # from the vertical: what leans out more needs support or a bridge
ON_BED_MM = 0.02
SAME_DIRECTION = 1e-3
WIDTH_STEP_MM = 0.5  # bridges that differ by less are as good as each other


def print_orientation(mesh: TriMesh) -> Floats:
    """(3, 3) proper rotation that turns a part as it is printed.

    Tried are all ways to rest on a facet of the convex hull; taken is the one with the narrowest bridge, then the
    least area that leans out by more than 45°, then the lowest, then the one with most of it on the bed.
    """
    normals, areas = _resting_facets(mesh)
    turns = [_turned_down(normal) for normal in normals]
    return min(zip(turns, areas, strict=True), key=lambda pair: _preference(mesh, *pair))[0]


def widest_bridge_mm(mesh: TriMesh) -> float:
    """Least width of the widest connected patch that leans out by more than 45° and does not lie on the bed."""
    down = _unsupported(mesh)
    faces = mesh.faces[down]
    if not len(faces):
        return 0.0
    pairs = np.concatenate([faces[:, :2], faces[:, 1:]])
    graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(mesh.vertices), len(mesh.vertices)))
    label = connected_components(graph, directed=False)[1][faces[:, 0]]
    return max(_least_width(mesh.vertices[np.unique(faces[label == k]), :2]) for k in np.unique(label))


def _preference(mesh: TriMesh, turn: Floats, resting_area: float) -> tuple[float, float, float, float]:
    turned = mesh.moved(mesh.vertices @ turn.T)
    down = _unsupported(turned)
    leaning = float((turned.areas * -turned.face_normals[:, 2])[down].sum())
    bridge = np.ceil(widest_bridge_mm(turned) / WIDTH_STEP_MM - 1e-6)
    return float(bridge), round(leaning, 1), round(float(turned.extents[2]), 2), -round(resting_area, 2)


def _unsupported(mesh: TriMesh) -> Bools:
    leaning = mesh.face_normals[:, 2] < -np.cos(np.radians(STEEPEST_DEGREES)) - 1e-6
    return leaning & (mesh.corners[:, :, 2].max(axis=1) > mesh.vertices[:, 2].min() + ON_BED_MM)


def _resting_facets(mesh: TriMesh) -> tuple[Floats, Floats]:
    """Outward normals (n, 3) of the hull's facets that the part itself lies in, and the area it rests on (n,)."""
    hull = ConvexHull(mesh.vertices)
    found, areas = list[Floats](), list[float]()
    for normal, offset in zip(hull.equations[:, :3], hull.equations[:, 3], strict=True):
        if any(normal @ other > 1 - SAME_DIRECTION for other in found):
            continue
        level = (mesh.corners @ normal + offset > -ON_BED_MM).all(axis=1)
        if level.any():
            found.append(np.asarray(normal, np.float64))
            areas.append(float(mesh.areas[level].sum()))
    most = max(areas)
    chosen = [k for k, area in enumerate(areas) if area > most / 20]  # it stands on no sliver
    return np.array([found[k] for k in chosen]), np.array([areas[k] for k in chosen])


def _turned_down(normal: Floats) -> Floats:
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


def _least_width(points: Floats) -> float:
    """Least width of a flat set of points (n, 2): across a side of its hull; 0 where it is a line."""
    if len(points) < 3 or np.linalg.matrix_rank(points - points[0], tol=1e-9) < 2:
        return 0.0
    normals = ConvexHull(points).equations[:, :2]
    return float(np.ptp(points @ normals.T, axis=0).min())
