"""The largest distance between mesh and surface, lowered where it is, at one peak after the other.

Least squares leave isolated peaks: a tip that no vertex reaches, a valley that edges cross. Weights that grow with the
distance, as in Lawson's algorithm for the best uniform approximation (Rice and Usow, "The Lawson algorithm and
extensions", 1968), lower a peak; so does a start that least squares do not find, from a vertex at the tip. It is tried
on the few faces around the peak, with everything else fixed. (Flips of edges at the peak, tried too, never won.)
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from drkid.intersection import self_intersections
from drkid.measure import bend_radians, smallest_angle_degrees
from drkid.mesh import Bools, Floats, Ints, TriMesh
from drkid.remesh.closest_point import ClosestPoint
from drkid.remesh.collapse_and_split import relative_spread
from drkid.remesh.midpoint_subdivision import subdivided
from drkid.remesh.sizing_field import goals
from drkid.remesh.surface_fit import Points, Region, SurfaceFit

MOST_PEAKS = 12  # that are lowered: by then the next one is about as high
RINGS = 3  # of neighbours around a peak that move with it
FEWEST_VERTICES, MOST_VERTICES = 10, 20  # of the surface, for each of the mesh, at which distances are measured
LATTICE = np.array([(i, j, 3 - i - j) for i in range(4) for j in range(4 - i)]) / 3  # points of a face, the same
STEPS = 3  # of least squares after a move
NEAREST = 3  # vertices that are tried at a peak
FAR = 3.0  # root mean squares, from which a vertex of the surface pulls at the mesh as the fit's points do
MOST_PEAK = 100.0  # mean squares that a distance's weight grows with: a single point then pulls like its surroundings
LEAST_GAIN = 0.02  # of the largest distance
PRICE = 1.04  # that the mean distance, the edges' spread and the smallest angle may pay, as a factor
ONE_SIDED = 0.1  # of the mean distance, that the signed one may be: volume between the two, unless it was more before
STEEP_DEGREES = 90.0  # between the normals of neighbours; where bends were sharper, they may be as sharp again


@dataclass(frozen=True, eq=False)
class _Measured:
    """A mesh's distances: `away` (P,) of the probes and the `face` (P,) closest to each; `off` (F, L) of its own."""

    mesh: TriMesh
    away: Floats
    face: Ints
    off: Floats

    @property
    def largest(self) -> float:
        """Either way."""
        return float(max(self.away.max(), self.off.max()))


@dataclass(frozen=True)
class _Limits:
    """What a mesh may not exceed, or fall below."""

    mean: float
    spread: float
    volume: tuple[float, float]
    angle_degrees: float
    bend_radians: float

    def allow(self, mesh: TriMesh, fit: SurfaceFit) -> bool:
        """Does the mesh keep to them? Its mean distance is known to the caller."""
        return (
            relative_spread(mesh, fit) <= self.spread
            and self.volume[0] <= mesh.volume <= self.volume[1]
            and smallest_angle_degrees(mesh) >= self.angle_degrees
            and float(np.abs(bend_radians(mesh)).max()) <= self.bend_radians
        )


def lowered(mesh: TriMesh, fit: SurfaceFit) -> TriMesh:
    """The mesh with a smaller largest distance from the fit's surface, or as it was.

    Faces stay, vertices move. The mean distance and the edges' spread grow and the smallest angle shrinks by 4 % at
    most, hardly any volume goes, and no joint becomes sharper than a right angle that was not. The mesh is closed and
    manifold.
    """
    probes = _probes(fit, len(mesh.vertices))
    now = _measured(mesh, fit, probes)
    surface, mean = fit.closest.surface, _mean(now.away, fit)
    error = max(abs(mesh.volume - surface.volume), ONE_SIDED * mean * float(surface.areas.sum()))
    limits = _Limits(
        PRICE * mean,
        PRICE * relative_spread(mesh, fit),
        (surface.volume - error, surface.volume + error),
        smallest_angle_degrees(mesh) / PRICE,
        max(float(np.abs(bend_radians(mesh)).max()), np.radians(STEEP_DEGREES)),
    )
    for _ in range(MOST_PEAKS):
        better = _with_a_lower_peak(now, fit, probes, limits)
        if better is None:
            break
        now = better
    return now.mesh if len(self_intersections(now.mesh)) <= len(self_intersections(mesh)) else mesh


class _Probes(NamedTuple):
    """The fit's points, then vertices of the surface, all or every so many; `share` (P,) of its area."""

    points: Floats
    share: Floats


def _probes(fit: SurfaceFit, count: int) -> _Probes:
    surface = subdivided(fit.closest.surface, FEWEST_VERTICES * count)
    every = slice(None, None, -(-len(surface.vertices) // (MOST_VERTICES * count)))
    mass = np.bincount(surface.faces.ravel(), np.repeat(surface.areas, 3), len(surface.vertices))[every]
    share = np.concatenate([np.full(len(fit.points), 1 / len(fit.points)), mass / mass.sum()])
    return _Probes(np.concatenate([fit.points, surface.vertices[every]]), share)


def _measured(mesh: TriMesh, fit: SurfaceFit, probes: _Probes) -> _Measured:
    there, face, _ = ClosestPoint(mesh).in_faces(probes.points)
    here = (LATTICE @ mesh.corners).reshape(-1, 3)
    off = np.linalg.norm(here - fit.closest(here)[0], axis=1).reshape(-1, len(LATTICE))
    return _Measured(mesh, np.linalg.norm(there - probes.points, axis=1), face, off)


def _mean(away: Floats, fit: SurfaceFit) -> float:
    return float(away[: len(fit.points)].mean())


def _with_a_lower_peak(now: _Measured, fit: SurfaceFit, probes: _Probes, limits: _Limits) -> _Measured | None:
    """With the best move at the highest peak, or the first after which another is higher; None if none helps."""
    peak = _peak(now, fit, probes)
    faces = _around(now.mesh, peak.face)
    inside = np.isin(now.face, faces)
    elsewhere = max(now.away[~inside].max(initial=0), np.delete(now.off, faces, axis=0).max(initial=0))
    mean_squares = _mean(now.away**2, fit), _mean_square_error(now.mesh, fit)
    lowest, best = (1 - LEAST_GAIN) * now.largest, None
    sampled = np.flatnonzero(inside) < len(fit.points)
    region = _region(now.mesh, faces, _Probes(*(array[inside] for array in probes)), mean_squares)
    for trial in _moves(now.mesh, peak):
        for mesh, pairs in _fitted(trial, fit, region, sampled):
            largest = float(np.abs(pairs.away).max())
            if largest < lowest and limits.allow(mesh, fit):
                found = _updated(now, mesh, region, inside, pairs)
                if _mean(found.away, fit) <= limits.mean:
                    lowest, best = largest, found
        if lowest <= elsewhere:
            break
    return best


def _fitted(mesh: TriMesh, fit: SurfaceFit, region: Region, sampled: Bools) -> Iterator[tuple[TriMesh, Points]]:
    """The mesh and its pairs of points, as it is and after each step; vertices of the surface pull where they are far.

    `sampled` (P,) says which of the probes are the fit's.
    """
    means = region.mean_squares or (0.0, 0.0)
    always = np.concatenate([np.ones(len(region.faces) * len(LATTICE), np.bool_), sampled])
    for _ in range(STEPS):
        pairs = fit.pairs(mesh, region)
        yield mesh, pairs
        pulling = always | (pairs.away**2 > FAR**2 * means[0])
        mesh = fit.placed(mesh, region, pairs._replace(share=np.where(pulling, pairs.share, 0)))
    yield mesh, fit.pairs(mesh, region)


def _updated(was: _Measured, mesh: TriMesh, region: Region, inside: Bools, pairs: Points) -> _Measured:
    """The distances of the whole mesh, from those of the region; probes there are not nearer than to its faces."""
    own = len(region.faces) * len(LATTICE)
    away, face, off = was.away.copy(), was.face.copy(), was.off.copy()
    away[inside], face[inside] = np.abs(pairs.away[own:]), region.faces[pairs.face[own:]]
    off[region.faces] = np.abs(pairs.away[:own]).reshape(-1, len(LATTICE))
    return _Measured(mesh, away, face, off)


def _mean_square_error(mesh: TriMesh, fit: SurfaceFit) -> float:
    wanted = goals(mesh, fit.sizing)[mesh.edges].mean(axis=1)
    return float(((mesh.edge_lengths / wanted - 1) ** 2).mean()) * mesh.mean_edge**2


@dataclass(frozen=True, eq=False)
class _Peak:
    """`place` on the mesh or the surface, the closest point on the other, and the `face` of the mesh that it is at."""

    place: Floats
    foot: Floats
    face: int
    on_the_mesh: bool


def _peak(now: _Measured, fit: SurfaceFit, probes: _Probes) -> _Peak:
    if now.away.max() == now.largest:
        i = int(now.away.argmax())
        return _Peak(probes.points[i], probes.points[i], int(now.face[i]), on_the_mesh=False)
    face, k = np.unravel_index(int(now.off.argmax()), now.off.shape)
    place = LATTICE[k] @ now.mesh.corners[face]
    return _Peak(place, fit.closest(place[None])[0][0], int(face), on_the_mesh=True)


def _around(mesh: TriMesh, face: int) -> Ints:
    """The faces within so many rings of one."""
    reached = np.zeros(len(mesh.vertices), np.bool_)
    reached[mesh.faces[face]] = True
    for _ in range(RINGS - 1):
        reached[mesh.faces[reached[mesh.faces].any(axis=1)]] = True
    return np.flatnonzero(reached[mesh.faces].any(axis=1))


def _region(mesh: TriMesh, faces: Ints, probes: _Probes, mean_squares: tuple[float, float]) -> Region:
    """Of the vertices that only these faces have."""
    free = np.zeros(len(mesh.vertices), np.bool_)
    free[mesh.faces[faces]] = True
    free[np.delete(mesh.faces, faces, axis=0)] = False
    corners = np.unique(mesh.faces[faces])
    return Region(
        np.flatnonzero(free),
        corners[~free[corners]],
        faces,
        np.flatnonzero(free[mesh.edges].any(axis=1)),
        *probes,
        LATTICE,
        mean_squares,
        MOST_PEAK,
    )


def _moves(mesh: TriMesh, peak: _Peak) -> Iterator[TriMesh]:
    """The mesh with one of the nearest vertices at the peak's foot, the nearest first; and as it is."""
    corners = np.unique(mesh.faces[np.isin(mesh.faces, mesh.faces[peak.face]).any(axis=1)])
    apart = np.linalg.norm(mesh.vertices[corners] - peak.place, axis=1)
    for v in corners[np.argsort(apart, kind="stable")[:NEAREST]]:
        vertices = mesh.vertices.copy()
        vertices[v] = peak.foot
        yield mesh.moved(vertices)
    yield mesh
