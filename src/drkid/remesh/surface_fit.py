"""Vertices where the mesh is nearest to the surface and its edges are most even: one least-squares problem.

Hoppe, DeRose, Duchamp, McDonald and Stuetzle, "Mesh optimization" (SIGGRAPH 1993), sections 3 and 4: squared distances
of sample points and springs along edges, here of a goal, the mean length, and not of none. A mesh whose vertices lie on
a convex surface is inside it; the least squares lift it until it lies on both sides, which keeps the volume too.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit

from drkid.measure import sample
from drkid.mesh import Floats, Ints, TriMesh, summed
from drkid.remesh.closest_point import ClosestPoint
from drkid.remesh.sizing_field import SizingField, goals
from drkid.remesh.tangential_relaxation import moved_where_harmless

CLOSENESS = 3.0  # of squared distances against squared errors of edges: more costs evenness and narrows angles
PEAK = 0.2  # how much more a distance of the root mean square weighs than none: more lowers the largest one
MOST_PEAK = 10.0  # mean squares: a tip that no vertex can reach is not to bend its surroundings
PEAK_EDGE = 0.3  # the same of an edge's error: more widens the narrowest angles
DAMPING = 0.02  # of a step, in units of the springs; without it, vertices slide where the surface is flat
REACH = 0.3  # most of a mean edge that a vertex moves in a step: beyond it the closest points are others
SOLVED, MOST_SOLVER_STEPS = 1e-6, 60  # squared residual, against that of no step, at which the solver stops
POINTS, FEWEST_POINTS = 6, 3000  # of the surface, for each vertex and in all
RULE = np.array([[2 / 3, 1 / 6, 1 / 6], [1 / 6, 2 / 3, 1 / 6], [1 / 6, 1 / 6, 2 / 3]])  # of degree 2 in a triangle


@njit(cache=True)
def _accumulate(count: int, points: "Points", share: Floats) -> tuple[Floats, Floats]:
    # For each face the normal matrix (9, 9) and the gradient (9,) of its points: r = away + direction · Σ weight u.
    matrix, gradient, row = np.zeros((count, 9, 9)), np.zeros((count, 9)), np.empty(9)
    for i in range(len(points.face)):
        f = points.face[i]
        for k in range(9):
            row[k] = points.weights[i, k // 3] * points.direction[i, k % 3]
        for k in range(9):
            gradient[f, k] += share[i] * points.away[i] * row[k]
            for m in range(9):
                matrix[f, k, m] += share[i] * row[k] * row[m]
    return matrix, gradient


class System(NamedTuple):
    """Normal equations of one step, kept by face and by edge.

    `matrix` (F, 9, 9) of each face's points, `along` (E, 3) the edges' directions, `stiffness` (E,) of the springs;
    `fixed` are the vertices that stay.
    """

    faces: Ints
    matrix: Floats
    edges: Ints
    along: Floats
    stiffness: Floats
    damping: float
    fixed: Ints


@njit(cache=True)
def _add_pulls(edges: Ints, along: Floats, stiffness: Floats, x: Floats, y: Floats) -> None:
    for e in range(len(edges)):
        a, b, change = edges[e, 0], edges[e, 1], 0.0
        for d in range(3):
            change += along[e, d] * (x[b, d] - x[a, d])
        for d in range(3):
            y[a, d] -= stiffness[e] * change * along[e, d]
            y[b, d] += stiffness[e] * change * along[e, d]


@njit(cache=True)
def _product(system: System, x: Floats, y: Floats) -> None:
    # y = A x
    faces, matrix, edges, along, stiffness, damping, fixed = system
    for v, d in np.ndindex(x.shape):
        y[v, d] = damping * x[v, d]
    for f in range(len(faces)):
        for row in range(9):
            total = 0.0
            for column in range(9):
                total += matrix[f, row, column] * x[faces[f, column // 3], column % 3]
            y[faces[f, row // 3], row % 3] += total
    _add_pulls(edges, along, stiffness, x, y)
    for v in fixed:
        y[v] = 0.0


@njit(cache=True)
def _diagonal(system: System, count: int) -> Floats:
    faces, matrix, edges, along, stiffness, damping, _ = system
    found = np.full((count, 3), damping)
    for f in range(len(faces)):
        for row in range(9):
            found[faces[f, row // 3], row % 3] += matrix[f, row, row]
    for e in range(len(edges)):
        for d in range(3):
            found[edges[e, 0], d] += stiffness[e] * along[e, d] ** 2
            found[edges[e, 1], d] += stiffness[e] * along[e, d] ** 2
    for v in range(count):
        found[v] = found[v].sum() / 3  # the trace does not depend on the axes, so that steps turn with the mesh
    return found


@njit(cache=True)
def _conjugate_gradients(system: System, right: Floats) -> Floats:
    # Preconditioned by the diagonal (Shewchuk 1994, section 12); an inexact solution makes an inexact step, no error.
    diagonal = _diagonal(system, len(right))
    x, r, q = np.zeros_like(right), right.copy(), np.empty_like(right)
    z = r / diagonal
    p, rz = z.copy(), (r * z).sum()
    least = SOLVED * rz
    for _ in range(MOST_SOLVER_STEPS):
        if rz <= least:
            break
        _product(system, p, q)
        alpha = rz / (p * q).sum()
        x += alpha * p
        r -= alpha * q
        z = r / diagonal
        before, rz = rz, (r * z).sum()
        p = z + rz / before * p
    return x


class Points(NamedTuple):
    """Pairs of points to bring together, one of them on a face of the mesh.

    `face` (P,), `weights` (P, 3) barycentric, `away` (P,) the signed distance, `direction` (P, 3) of unit length in
    which it grows, `share` (P,) of the area that the pair stands for.
    """

    face: Ints
    weights: Floats
    away: Floats
    direction: Floats
    share: Floats


class Region(NamedTuple):
    """The part of a mesh that a step moves.

    `vertices` (v,) may move; `faces` (f,) and `edges` (e,) are those at them, `fixed` the other vertices of these.
    `points` (p, 3) of the surface lie closest to these faces, `share` (p,) is the part of its area that each stands
    for; `rule` (k, 3) are the points that are taken in each face. `mean_squares` of distances, and of the edges'
    errors, are those of the whole mesh; distances count as `most_peak` times that at most.
    """

    vertices: Ints
    fixed: Ints
    faces: Ints
    edges: Ints
    points: Floats
    share: Floats
    rule: Floats = RULE
    mean_squares: tuple[float, float] | None = None
    most_peak: float = MOST_PEAK


@dataclass(frozen=True, eq=False)
class SurfaceFit:
    """A surface with what is needed to fit meshes to it: its tree, `points` (P, 3) spread over it, lengths of edges."""

    closest: ClosestPoint
    points: Floats
    sizing: SizingField | None = None

    def stepped(self, mesh: TriMesh) -> TriMesh:
        """One step of Gauss and Newton towards closeness and even edges; the mesh is closed and manifold.

        Minimised are the mean squared distance of the two surfaces, from both sides, times `CLOSENESS`, in units of the
        mean edge, and the mean squared relative error of the edges. A vertex stays where it is if one of its faces
        would turn by 90° or become a sliver or a fold.
        """
        region = self._everywhere(mesh)
        return self.placed(mesh, region, self.pairs(mesh, region))

    def placed(self, mesh: TriMesh, region: Region, pairs: Points) -> TriMesh:
        """The same step of a region's vertices alone, from its `pairs`."""
        faces, edges, count = mesh.faces[region.faces], mesh.edges[region.edges], len(mesh.vertices)
        goal = goals(mesh, self.sizing)
        ends, lengths = mesh.vertices[edges], mesh.edge_lengths[region.edges]
        along = (ends[:, 1] - ends[:, 0]) / lengths[:, None]
        wanted = goal[edges].mean(axis=1)
        surplus, weight = lengths - wanted, (mesh.mean_edge / wanted) ** 2  # relative errors count
        squares, errors = pairs.away**2, weight * surplus**2
        means = region.mean_squares or (float((pairs.share * squares).sum()) / 2, float(errors.mean()))
        distance, error = (max(mean, np.finfo(float).tiny) for mean in means)
        raised = 1 + PEAK * np.minimum(squares / distance, region.most_peak)
        matrix, gradient = _accumulate(len(faces), pairs, CLOSENESS / 2 * pairs.share * raised)
        stiffness = weight * (1 + PEAK_EDGE * errors / error) / len(mesh.edges)
        pull = (stiffness * surplus)[:, None] * along
        right = summed(edges.T.ravel(), np.concatenate([pull, -pull]), count)
        right -= summed(faces.ravel(), gradient.reshape(-1, 3), count)
        right[region.fixed] = 0
        step = _conjugate_gradients(
            System(faces, matrix, edges, along, stiffness, DAMPING / count, region.fixed), right
        )
        size = np.linalg.norm(step, axis=1, keepdims=True)
        most = REACH * goal[:, None]
        return moved_where_harmless(mesh, mesh.vertices + step * (most / np.maximum(size, most)), region.vertices)

    def pairs(self, mesh: TriMesh, region: Region) -> Points:
        """Points of a region's faces with those closest to them on the surface, and the other way round."""
        return _joined(self._from_mesh(mesh, region), self._from_surface(mesh, region))

    def _everywhere(self, mesh: TriMesh) -> Region:
        vertices, faces, edges = (np.arange(len(array)) for array in (mesh.vertices, mesh.faces, mesh.edges))
        share = np.full(len(self.points), 1 / len(self.points))
        return Region(vertices, vertices[:0], faces, edges, self.points, share)

    def _from_mesh(self, mesh: TriMesh, region: Region) -> Points:
        here = np.einsum("rc,fcd->frd", region.rule, mesh.corners[region.faces]).reshape(-1, 3)
        there, normals = self.closest(here)
        count, rule = len(region.faces), region.rule
        share = np.repeat(mesh.areas[region.faces] / (len(rule) * mesh.areas.sum()), len(rule))
        away, direction = _signed(here, there, normals, self._rounding)
        return Points(np.repeat(np.arange(count), len(rule)), np.tile(rule, (count, 1)), away, direction, share)

    def _from_surface(self, mesh: TriMesh, region: Region) -> Points:
        part = TriMesh(mesh.vertices, mesh.faces[region.faces])
        there, face, weights = ClosestPoint(part).in_faces(region.points)
        away, direction = _signed(there, region.points, part.face_normals[face], self._rounding)
        return Points(face, weights, away, direction, region.share)

    @property
    def _rounding(self) -> float:
        return 1e-9 * self.closest.surface.diagonal


def surface_fit(
    closest: ClosestPoint, count: int, rng: np.random.Generator, sizing: SizingField | None = None
) -> SurfaceFit:
    """For meshes of `count` vertices."""
    return SurfaceFit(closest, sample(closest.surface, max(FEWEST_POINTS, POINTS * count), rng), sizing)


def _joined(one: Points, two: Points) -> Points:
    return Points(
        np.concatenate([one.face, two.face]),
        np.concatenate([one.weights, two.weights]),
        np.concatenate([one.away, two.away]),
        np.concatenate([one.direction, two.direction]),
        np.concatenate([one.share, two.share]),
    )


def _signed(here: Floats, there: Floats, normals: Floats, rounding: float) -> tuple[Floats, Floats]:
    """Distances (P,) of points from those on the surface, positive outside, and the directions in which they grow."""
    apart = here - there
    size = np.linalg.norm(apart, axis=1)
    sign = np.where(np.einsum("ij,ij->i", apart, normals) < 0, -1.0, 1.0)
    direction = apart * (sign / np.maximum(size, rounding))[:, None]
    return size * sign, np.where((size > rounding)[:, None], direction, normals)
