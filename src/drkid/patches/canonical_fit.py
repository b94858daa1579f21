"""Canonical patches of all classes together: close to the surface, smooth over the joints, tight along them."""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.optimize import lsq_linear

from drkid.class_triangle import laid_down
from drkid.curved_patch import barycentric_grid, gradients, monomials, side_points
from drkid.measure import project
from drkid.mesh import Floats, Ints, TriMesh, read_only
from drkid.patches.canonical_patch import (
    ARCS,
    BUBBLES,
    CanonicalPatch,
    barycentric_gradients,
    symmetric_bubbles,
)
from drkid.patches.laid_faces import LaidFaces

FIT_LEVELS = 3  # of the grid at which patches are held against the surface
FARTHEST = 0.5  # of the mean edge: where the surface is farther from a face, it says nothing about its curvature
FAIRNESS = 0.006  # weight of squared slopes, in mean edges, against squared heights: patches are no trays
ALONG = np.array([0.1, 0.3, 0.5, 0.7, 0.9])  # shares of a side at which tangents are held together
PERCENTILE = 95
NEGLIGIBLE = 1e-13  # of the largest eigenvalue: what the faces say nothing about stays as it is on a flat patch


@dataclass(frozen=True, eq=False)
class Target:
    """What patches are held against, and how much everything counts.

    `measured` (F, n + 2m): how far the surface lies over each face at the n points of the grid, and its slope in each
    of the m triangles of the grid, x then y (`readings`). `weight` is the share of each in the sum of squares, 0 where
    the surface is too far away. `smoothness` (E,) weighs the squared breaks at every place along a joint; `most_gap`
    is the largest gap at 95 of 100 joints.
    """

    measured: Floats
    weight: Floats
    smoothness: Floats
    most_gap: float


@dataclass(frozen=True, eq=False)
class CanonicalFit:
    """The patches of the classes, and what they leave.

    `residual` is the least sum. `measured` (k, n + 2m) is of the patches what the target's is of the surface, `slopes`
    (k, 3, p) how they rise outwards at places along their sides. `sagittas` (c,) and `leans` (c,) are those of the
    boundary curves, the sagittas for a side of unit length.
    """

    patches: tuple[CanonicalPatch, ...]
    residual: float
    measured: Floats
    slopes: Floats
    sagittas: Floats
    leans: Floats


def readings(lengths: Floats) -> Floats:
    """(n + 2m, n): from the heights at the n points of the grid to these and the slopes in its m triangles."""
    grid = barycentric_grid(FIT_LEVELS)
    a, b, c = np.moveaxis((grid.points @ laid_down(lengths))[grid.faces], 1, 0)
    slope = np.linalg.inv(np.stack([b - a, c - a], axis=1))  # (m, 2, 2): from the rises along two sides
    out = np.zeros((len(grid.faces), 2, len(grid.points)))
    number = np.arange(len(grid.faces))
    for corner, part in ((0, -slope.sum(axis=2)), (1, slope[:, :, 0]), (2, slope[:, :, 1])):
        out[number, :, grid.faces[:, corner]] = part
    return read_only(np.vstack([np.eye(len(grid.points)), out[:, 0], out[:, 1]]))


def target_of(laid: LaidFaces, surface: TriMesh, smoothness: float, most_gap: float) -> Target:
    """The heights and slopes of `surface` over the faces and what they and the tangent breaks weigh.

    Args:
        laid: the faces.
        surface: M_i, in their unit.
        smoothness: weight of the squared tangent breaks, whose angles count in mean edges, against squared distances.
        most_gap: largest gap (95th percentile) in the same unit.
    """
    mesh, grid = laid.mesh, barycentric_grid(FIT_LEVELS)
    height = heights(laid, surface, grid.points)
    reading = np.stack([readings(lengths) for lengths in laid.class_lengths])
    known = np.abs(height) < FARTHEST * mesh.mean_edge
    point = np.bincount(grid.faces.ravel(), minlength=len(grid.points)) / grid.faces.size
    slope = known[:, grid.faces].all(axis=2) * (FAIRNESS * mesh.mean_edge**2 / len(grid.faces))
    weight = (mesh.areas / mesh.areas.sum())[:, None] * np.hstack([known * point, slope, slope])
    joint = smoothness * mesh.mean_edge**2 * mesh.edge_lengths / mesh.edge_lengths.sum() / len(ALONG)
    measured = np.einsum("fij,fj->fi", reading[laid.face_class], height)
    return Target(read_only(measured), read_only(weight), read_only(joint), most_gap)


def canonical_fit(laid: LaidFaces, curve: Ints, target: Target) -> CanonicalFit:
    """One patch per class, from the least squares over all faces and joints (bounded by the gap at joints).

    Of three sums: the squared distances in height between patch and surface (the solution for one class alone is the
    aligned, symmetrised mean of its members), those in slope, and the squared tangent breaks at the joints. Every
    boundary curve leans outwards by half the bend of its joints; its sagitta is such that the gap at joints,
    2s·|sin(δ/2 − φ)|, is at most `target.most_gap` at 95 of 100.

    Args:
        laid: the faces and their classes.
        curve: (k, 3), the number of the boundary curve at each side of each class.
        target: what the patches are held against.
    """
    frame = _frame(laid, curve)
    gram, right = frame.distances(target)
    more, rest = frame.breaks(target)
    most = np.maximum(largest_curvatures(laid, curve, frame.lean, target.most_gap), 1e-12)
    bound = np.concatenate([most, np.full(frame.unknowns - len(most), np.inf)])
    found = _bounded(gram + more, right + rest, bound)
    patches = tuple(
        CanonicalPatch(
            lengths,
            read_only(found[own] * lengths**2 / 8),
            read_only(frame.lean[own]),
            read_only(basis @ found[span]),
        )
        for lengths, own, basis, span in zip(laid.class_lengths, curve, frame.bases, frame.spans, strict=True)
    )
    fit = CanonicalFit(
        patches,
        0.0,
        read_only(frame.readings @ found),
        read_only(frame.slopes @ found),
        read_only(found[: len(most)] / 8),
        frame.lean,
    )
    return replace(fit, residual=_residual(laid, fit, target))


def _bounded(gram: Floats, right: Floats, bound: Floats) -> Floats:
    """Where x·gram·x/2 − right·x is least for |x| ≤ `bound`; unknowns in units in which the diagonal is 1."""
    unit = np.sqrt(gram.diagonal())
    unit[unit == 0] = 1.0
    values, vectors = np.linalg.eigh(gram / np.outer(unit, unit))
    sure = values > NEGLIGIBLE * values.max()
    root = np.sqrt(values[sure])
    wanted = (vectors[:, sure].T @ (right / unit)) / root
    found = lsq_linear((vectors[:, sure] * root).T, wanted, (-bound * unit, bound * unit))
    return np.asarray(found.x, np.float64) / unit


def _residual(laid: LaidFaces, fit: CanonicalFit, target: Target) -> float:
    apart = target.measured - fit.measured[laid.face_class]
    ends = fit.slopes[laid.face_class[laid.joint_face], laid.joint_side]
    second = np.where(laid.opposed[:, None], ends[:, 1, ::-1], ends[:, 1])
    left = ends[:, 0] + second + laid.bend_radians[:, None]
    return float((target.weight * apart**2).sum() + (target.smoothness[:, None] * left**2).sum())


@dataclass(frozen=True, eq=False)
class _Frame:
    """What the unknowns mean: a curvature for each boundary curve, then bubbles class by class."""

    laid: LaidFaces
    curve: Ints
    lean: Floats
    bases: tuple[Floats, ...]
    spans: tuple[slice, ...]
    unknowns: int

    def rows(self, index: int, arcs: Floats, bubbles: Floats) -> Floats:
        """(n, unknowns): terms of arcs (n, 3) and of bubbles (n, b) of a class as rows."""
        out = np.zeros((len(arcs), self.unknowns))
        for side, lengths in enumerate(self.laid.class_lengths[index]):
            own = self.curve[index, side]
            out[:, own] += arcs[:, side] * lengths**2 / 2 * np.cos(self.lean[own])
        out[:, self.spans[index]] = bubbles @ self.bases[index]
        return out

    @cached_property
    def readings(self) -> Floats:
        """(k, n + 2m, unknowns): heights and slopes of each class's patch in the grid."""
        points = barycentric_grid(FIT_LEVELS).points
        arcs, bubbles = monomials(ARCS, points), monomials(BUBBLES, points)
        return np.stack([readings(x) @ self.rows(k, arcs, bubbles) for k, x in enumerate(self.laid.class_lengths)])

    @cached_property
    def slopes(self) -> Floats:
        """(k, 3, p, unknowns): how the height of each class's patch rises outwards at places along its sides."""
        return np.stack([self.outward_slopes(k) for k in range(len(self.curve))])

    def distances(self, target: Target) -> tuple[Floats, Floats]:
        """Normal equations of the heights and slopes of the surface over every face."""
        gram, right = np.zeros((self.unknowns, self.unknowns)), np.zeros(self.unknowns)
        for index in range(len(self.curve)):
            own = self.laid.face_class == index
            row, weight = self.readings[index], target.weight[own]
            gram += (row.T * weight.sum(axis=0)) @ row
            right += row.T @ (weight * target.measured[own]).sum(axis=0)
        return gram, right

    def breaks(self, target: Target) -> tuple[Floats, Floats]:
        """Normal equations of the bends left between the tangent planes at joints, to first order of the slopes."""
        laid = self.laid
        ends = self.slopes[laid.face_class[laid.joint_face], laid.joint_side]  # (E, 2, n, unknowns)
        second = np.where(laid.opposed[:, None, None], ends[:, 1, ::-1], ends[:, 1])
        rows = (ends[:, 0] + second).reshape(-1, self.unknowns)
        weight = np.repeat(target.smoothness, len(ALONG))
        return (rows.T * weight) @ rows, rows.T @ (-weight * np.repeat(laid.bend_radians, len(ALONG)))

    def outward_slopes(self, index: int) -> Floats:
        """(3, n, unknowns): how the height of a class's patch rises outwards at each side."""
        gradient = barycentric_gradients(self.laid.class_lengths[index])
        out = np.empty((3, len(ALONG), self.unknowns))
        for side in range(3):
            at = side_points(side, ALONG)
            outward = -gradient[(side + 2) % 3] / np.linalg.norm(gradient[(side + 2) % 3])
            along = gradient @ outward
            out[side] = self.rows(index, gradients(ARCS, at) @ along, gradients(BUBBLES, at) @ along)
        return out


def _frame(laid: LaidFaces, curve: Ints) -> _Frame:
    count = int(curve.max()) + 1
    bases = [symmetric_bubbles(lengths, own) for lengths, own in zip(laid.class_lengths, curve, strict=True)]
    starts = count + np.concatenate([[0], np.cumsum([b.shape[1] for b in bases])])
    spans = [slice(a, b) for a, b in pairwise(starts.tolist())]
    return _Frame(laid, curve, _leans(laid, curve), tuple(bases), tuple(spans), int(starts[-1]))


def heights(laid: LaidFaces, surface: TriMesh, barycentric: Floats) -> Floats:
    """(F, n): how far the surface lies over each face at barycentric coordinates (n, 3) of its class's corners."""
    points = np.einsum("nk,fkc->fnc", barycentric, laid.mesh.vertices[laid.vertices])
    closest = project(surface, points.reshape(-1, 3))[0].reshape(points.shape)
    return np.einsum("fnc,fc->fn", closest - points, laid.mesh.face_normals)


def joint_curves(laid: LaidFaces, curve: Ints) -> Ints:
    """(E,): the boundary curve of either piece at each joint."""
    return curve[laid.face_class[laid.joint_face[:, 0]], laid.joint_side[:, 0]]


def gaps(laid: LaidFaces, sagittas: Floats, leans: Floats) -> Floats:
    """(E, c): how far apart the two curves at each joint would be, were it each of these (unit sides)."""
    return 2 * np.abs(sagittas * np.sin(laid.bend_radians[:, None] / 2 - leans)) * laid.mesh.edge_lengths[:, None] ** 2


def _leans(laid: LaidFaces, curve: Ints) -> Floats:
    """(c,): half the bend of each curve's joints: the middle of the narrowest range that 95 of 100 of them lie in."""
    own = joint_curves(laid, curve)
    out = np.zeros(int(curve.max()) + 1)
    for c in np.unique(own):
        bend = np.sort(laid.bend_radians[own == c])
        kept = int(np.ceil(PERCENTILE / 100 * len(bend)))
        first = int(np.argmin(bend[kept - 1 :] - bend[: len(bend) - kept + 1]))
        out[c] = (bend[first] + bend[first + kept - 1]) / 4
    return read_only(out)


def largest_curvatures(laid: LaidFaces, curve: Ints, lean: Floats, most_gap: float) -> Floats:
    """(c,): the curvature 8s/L² of each curve at which its joints' gap has reached `most_gap`."""
    own, across = joint_curves(laid, curve), gaps(laid, np.ones_like(lean) / 8, lean)
    widest = np.zeros(len(lean))
    for c in np.unique(own):
        widest[c] = np.percentile(across[own == c, c], PERCENTILE, method="higher")
    return np.divide(most_gap, widest, out=np.full(len(lean), np.inf), where=widest > 0)
