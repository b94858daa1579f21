"""Distance geometry: vertices moved so that pieces of one shape have all distances between their corners in common.

Least squares by Levenberg and Marquardt. The distances of a shape are no unknowns: the best ones are the means over its
pieces, so that what is left of a distance is its difference to that mean (variable projection; Golub and Pereyra 1973).
Vertices are held near where they were, normal to the surface more than along it, and pairs that may not come nearer
than some length are pushed apart where they do.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.sparse import csr_array

from drkid.mesh import Floats, Ints, TriMesh, summed
from drkid.patches.corner_room import CornerRooms
from drkid.patches.outline import Outlined

HOLD = 0.02  # weight of staying in place against equal distances; more of it leaves them unequal
ALONG = 0.15  # of this weight: what it is along the surface
ITERATIONS = 10
APART = 2.0  # weight of pairs that are too near, against equal distances
FIRST_DAMPING, LEAST_DAMPING = 1e-3, 1e-9
HARDER, EASIER = 6.0, 0.2  # factors of the damping after a step that failed, and after one that did not
TRIALS = 6  # of larger damping, until the merit falls
LEAST_GAIN = 1e-3  # of the merit in one iteration, below which it ends


@dataclass(frozen=True, eq=False)
class Place:
    """Where vertices are held: `vertices` (V, 3) and the metric (V, 3, 3) in which they count as moved."""

    vertices: Floats
    metric: Floats

    def moved(self, vertices: Floats) -> Floats:
        """(V,): how far vertices are from their place, off the surface; the way along it counts by `ALONG`."""
        off = vertices - self.vertices
        return np.sqrt(np.einsum("vi,vij,vj->v", off, self.metric, off))


def place(mesh: TriMesh) -> Place:
    """The mesh's own place: normals are the mean ones of the faces round each vertex, by area."""
    weighted = np.repeat(mesh.face_normals * mesh.areas[:, None], 3, axis=0)
    normals = summed(mesh.faces.ravel(), weighted, len(mesh.vertices))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Place(mesh.vertices, np.einsum("vi,vj->vij", normals, normals) + ALONG**2 * np.eye(3))


@dataclass(frozen=True, eq=False)
class _Distances:
    """Pairs of vertices (R, 2), and the means (k, R) that sum up the pairs which are one distance of one shape.

    `apart` holds the pairs that may not come too near.
    """

    pairs: Ints
    means: csr_array
    apart: CornerRooms | None

    @property
    def share(self) -> Floats:
        """(k,): one over the number of pieces."""
        return 1 / np.asarray(self.means.sum(axis=1)).ravel()

    def centred(self, lengths: Floats) -> Floats:
        """Lengths (R,) less their means over the pieces of a shape."""
        return lengths - np.asarray(self.means.T @ (self.share * (self.means @ lengths)), np.float64)


def _distances(pieces: list[Outlined], shape: Ints, apart: CornerRooms | None) -> _Distances:
    number: dict[tuple[int, int, int], int] = {}
    pairs, own = list[tuple[int, int]](), list[int]()
    for piece, k in zip(pieces, shape.tolist(), strict=True):
        for a, b in combinations(range(len(piece.vertices)), 2):
            pairs.append((piece.vertices[a], piece.vertices[b]))
            own.append(number.setdefault((k, a, b), len(number)))
    ones = np.ones(len(own))
    means = csr_array((ones, (own, np.arange(len(own)))), shape=(len(number), len(own)))
    return _Distances(np.array(pairs), means, apart)


def made_congruent(
    vertices: Floats, pieces: list[Outlined], shape: Ints, held: Place, apart: CornerRooms | None = None
) -> Floats:
    """(V, 3): the vertices after at most `ITERATIONS` steps; pieces of one `shape` (P,) name their corners alike."""
    distances = _distances(pieces, shape, apart)
    damping, merit = FIRST_DAMPING, _merit(vertices, distances, held)
    for _ in range(ITERATIONS):
        hessian, gradient = _normal_equations(vertices, distances, held)
        tried, after = vertices, merit
        for _trial in range(TRIALS):
            step = np.linalg.solve(hessian + damping * np.eye(len(hessian)), -gradient)
            tried = vertices + step.reshape(-1, 3)
            after = _merit(tried, distances, held)
            if after < merit:
                break
            damping *= HARDER
        if after >= merit:
            break
        gain, vertices, merit = merit - after, tried, after
        damping = max(EASIER * damping, LEAST_DAMPING)
        if gain < LEAST_GAIN * (merit + gain):
            break
    return vertices


def _lengths(vertices: Floats, pairs: Ints) -> tuple[Floats, Floats]:
    """(R,) distances and (R, 3) their directions."""
    along = vertices[pairs[:, 0]] - vertices[pairs[:, 1]]
    length = np.linalg.norm(along, axis=1)
    return length, along / length[:, None]


def _too_near(vertices: Floats, distances: _Distances) -> tuple[Ints, Floats]:
    """Pairs (m, 2) that are nearer than they may be, and by how much (m,)."""
    if distances.apart is None:
        return np.zeros((0, 2), np.int64), np.zeros(0)
    missing = distances.apart.missing(vertices)
    return distances.apart.pairs[missing > 0], missing[missing > 0]


def _merit(vertices: Floats, distances: _Distances, held: Place) -> float:
    apart, (_, missing) = distances.centred(_lengths(vertices, distances.pairs)[0]), _too_near(vertices, distances)
    return float(apart @ apart + APART**2 * missing @ missing + HOLD**2 * (held.moved(vertices) ** 2).sum())


def _normal_equations(vertices: Floats, distances: _Distances, held: Place) -> tuple[Floats, Floats]:
    jacobian, length = _jacobian(vertices, distances.pairs)
    count, (near, missing) = len(vertices), _too_near(vertices, distances)
    pushed, _ = _jacobian(vertices, near)
    mean = csr_array(distances.means @ jacobian)
    pull = HOLD**2 * np.einsum("vij,vj->vi", held.metric, vertices - held.vertices)
    product = csr_array(
        jacobian.T @ jacobian - mean.T @ mean.multiply(distances.share[:, None]) + APART**2 * (pushed.T @ pushed)
    )
    hessian = np.ascontiguousarray(product.toarray(), np.float64)
    every = np.arange(count)
    hessian.reshape(count, 3, count, 3)[every, :, every, :] += HOLD**2 * held.metric
    gradient = jacobian.T @ distances.centred(length) - APART**2 * (pushed.T @ missing)
    return hessian, np.asarray(gradient, np.float64) + pull.ravel()


def _jacobian(vertices: Floats, pairs: Ints) -> tuple[csr_array, Floats]:
    """(R, 3V) derivatives of the distances of pairs, and the distances (R,)."""
    length, along = _lengths(vertices, pairs)
    rows = np.repeat(np.arange(len(length)), 6)
    columns = (3 * pairs[:, :, None] + np.arange(3)).ravel()
    shape = (len(length), 3 * len(vertices))
    return csr_array((np.concatenate([along, -along], axis=1).ravel(), (rows, columns)), shape=shape), length
