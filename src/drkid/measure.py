"""What tables report: distances of surfaces, dihedral angles, quality of triangles."""

from dataclasses import dataclass

import igl
import numpy as np
from scipy.sparse import coo_array

from drkid.mesh import Bools, Floats, Ints, TriMesh, read_only

CONCAVE_DEGREES = 1.0  # a joint counts as concave when its inner angle is above 180° by more than this
NORMAL_SMOOTHING = 5  # rounds of averaging of vertex normals: voxels leave ripples in them
HAUSDORFF_SAMPLES = 60_000  # per direction: the mean is then good to about 0.5 % of itself


def distance_to_surface(mesh: TriMesh, points: Floats) -> Floats:
    """(n,): unsigned distance of each point (n, 3) to the mesh."""
    return np.sqrt(np.maximum(_closest(mesh, points)[0], 0.0))


def project(mesh: TriMesh, points: Floats) -> tuple[Floats, Ints]:
    """The closest point on the mesh for each point (n, 3), and the face that it lies on (n,)."""
    _, face, closest = _closest(mesh, points)
    return closest, face


def _closest(mesh: TriMesh, points: Floats) -> tuple[Floats, Ints, Floats]:
    tree = igl.AABB()
    tree.init(np.array(mesh.vertices), np.array(mesh.faces))
    squared, face, closest = tree.squared_distance(mesh.vertices, mesh.faces, np.array(points, order="C"))
    return np.asarray(squared, np.float64), np.asarray(face, np.int64), np.asarray(closest, np.float64)


def sample(mesh: TriMesh, count: int, rng: np.random.Generator, weight: Floats | None = None) -> Floats:
    """(count, 3): points spread by area, times `weight` (F,) if given, stratified: large faces get their exact share.

    Turk, "Generating random points in triangles", Graphics Gems (1990), for the point within a face.
    """
    share = np.concatenate([[0.0], np.cumsum(mesh.areas if weight is None else weight * mesh.areas)])
    along = (np.arange(count) + rng.random(count)) * (share[-1] / count)
    face = np.minimum(np.searchsorted(share, along, side="right") - 1, len(mesh.faces) - 1)
    u, v = np.sqrt(rng.random((count, 1))), rng.random((count, 1))
    a, b, c = np.moveaxis(mesh.corners[face], 1, 0)
    return (1 - u) * a + u * (1 - v) * b + u * v * c


@dataclass(frozen=True)
class Hausdorff:
    """`mean`: average of the two directions' means; `max`: the larger of the two directions' maxima."""

    mean: float
    max: float


def hausdorff(a: TriMesh, b: TriMesh, rng: np.random.Generator, count: int = HAUSDORFF_SAMPLES) -> Hausdorff:
    """Symmetric distance of two surfaces, sampled on both (vertices too) (Cignoni et al., Metro, 1998)."""
    means, maxima = [], []
    for here, there in ((a, b), (b, a)):
        points = sample(here, count, rng)
        distance = distance_to_surface(there, np.concatenate([points, here.vertices]))
        means.append(distance[:count].mean())
        maxima.append(distance.max())
    return Hausdorff(float(np.mean(means)), float(max(maxima)))


def bend_radians(mesh: TriMesh) -> Floats:
    """(E,): signed angle between the normals of each edge's two faces, positive where convex.

    Raises:
        ValueError: the mesh is not closed and manifold.
    """
    first, second = mesh.face_normals[mesh.edge_faces[:, 0]], mesh.face_normals[mesh.edge_faces[:, 1]]
    along = mesh.vertices[mesh.edges[:, 1]] - mesh.vertices[mesh.edges[:, 0]]
    sine = np.einsum("ij,ij->i", np.cross(first, second), along) / mesh.edge_lengths
    return read_only(np.arctan2(sine, np.einsum("ij,ij->i", first, second)))


@dataclass(frozen=True)
class Dihedral:
    """Of |180° − inner angle| over all edges: mean and 95th percentile; and the share of concave edges."""

    mean_degrees: float
    p95_degrees: float
    concave_percent: float


def dihedral(mesh: TriMesh, edges: Bools | None = None) -> Dihedral:
    """Summary of a closed mesh's dihedral angles, at all edges or at those of a mask (E,)."""
    bend = np.degrees(bend_radians(mesh))
    bend = bend if edges is None else bend[edges]
    return Dihedral(
        float(np.abs(bend).mean()),
        float(np.percentile(np.abs(bend), 95)),
        float(100 * (bend < -CONCAVE_DEGREES).mean()),
    )


def edge_spread(mesh: TriMesh) -> float:
    """Standard deviation of the edge lengths over their mean."""
    return float(mesh.edge_lengths.std() / mesh.mean_edge)


def smallest_angle_degrees(mesh: TriMesh) -> float:
    """The smallest angle of any face (law of cosines)."""
    a, b, c = np.sort(mesh.side_lengths, axis=1).T
    return float(np.degrees(np.arccos(np.clip((b * b + c * c - a * a) / (2 * b * c), -1, 1))).min())


def smooth_normals(mesh: TriMesh) -> Floats:
    """(V, 3): unit vertex normals, averaged with their neighbours a few times."""
    normals, every = mesh.vertex_normals, np.arange(len(mesh.vertices))
    here, there = np.concatenate([every, *mesh.edges.T]), np.concatenate([every, *mesh.edges[:, ::-1].T])
    neighbours = coo_array((np.ones(len(here)), (here, there)), shape=(len(every), len(every))).tocsr()
    for _ in range(NORMAL_SMOOTHING):
        total = neighbours @ normals
        normals = total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), np.finfo(float).tiny)
    return normals
