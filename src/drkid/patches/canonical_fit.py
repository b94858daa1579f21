"""Canonical patches of all classes together: close to the surface, smooth over the joints, tight along them."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.optimize import lsq_linear

from drkid.curved_patch import barycentric_grid, gradients, monomials, side_points
from drkid.measure import project
from drkid.mesh import Floats, Ints, TriMesh, read_only
from drkid.patches.canonical_patch import (
    ARCS,
    BUBBLES,
    CanonicalPatch,
    barycentric_gradients,
    length_groups,
    symmetric_bubbles,
)
from drkid.patches.laid_faces import LaidFaces

FIT_LEVELS = 3  # of the grid at which patches are held against the surface
MOST_CURVES = 3  # kinds of boundary curves: as many as a palette has lengths; more lengths share one curvature
FARTHEST = 0.5  # of the mean edge: where the surface is farther from a face, it says nothing about its curvature
ALONG = np.array([0.1, 0.3, 0.5, 0.7, 0.9])  # shares of a side at which tangents are held together
PERCENTILE = 95


@dataclass(frozen=True, eq=False)
class _System:
    """Rows and right sides of the least squares; its unknowns are a curvature a group, then bubbles class by class."""

    matrix: Floats
    wanted: Floats


def canonical_patches(
    laid: LaidFaces, surface: TriMesh, smoothness: float, most_gap: float
) -> tuple[CanonicalPatch, ...]:
    """One patch per class, from the least squares over all faces and joints (bounded by the gap at joints).

    Of two sums: the squared distances in height between patch and surface, averaged over each face (the solution for
    one class alone is the aligned, symmetrised mean of its members), and `smoothness` times the squared tangent
    breaks at the joints. Every length's boundary curve leans outwards by half the mean bend of its joints; its
    sagitta is such that the gap at joints, 2s·|sin(δ/2 − φ)|, is at most `most_gap` at 95 of 100.

    Args:
        laid: the faces and their classes.
        surface: M_i, in the unit of the faces.
        smoothness: weight of the tangent breaks, whose angles count in mean edges.
        most_gap: largest gap (95th percentile) in the same unit.
    """
    group = length_groups(laid.class_lengths, MOST_CURVES)
    count = int(group.max()) + 1
    lean = _leans(laid, group, count)
    bases = [symmetric_bubbles(lengths) for lengths in laid.class_lengths]
    starts = count + np.concatenate([[0], np.cumsum([b.shape[1] for b in bases])])
    spans = [slice(a, b) for a, b in pairwise(starts.tolist())]
    frame = _Frame(laid, group, lean, tuple(bases), tuple(spans), int(starts[-1]))
    near, smooth = frame.distances(surface), frame.breaks()
    weight = np.sqrt(smoothness) * laid.mesh.mean_edge
    matrix = np.vstack([near.matrix, weight * smooth.matrix])
    wanted = np.concatenate([near.wanted, weight * smooth.wanted])
    most = np.full(int(starts[-1]), np.inf)
    most[:count] = np.maximum(_largest_curvatures(laid, group, lean, most_gap), 1e-12)
    least = np.where(np.arange(len(most)) < count, 0.0, -np.inf)
    found = lsq_linear(matrix, wanted, (least, most)).x
    return tuple(
        CanonicalPatch(
            lengths,
            read_only(found[own] * lengths**2 / 8),
            read_only(lean[own]),
            read_only(basis @ found[span]),
        )
        for lengths, own, basis, span in zip(laid.class_lengths, group, bases, spans, strict=True)
    )


@dataclass(frozen=True, eq=False)
class _Frame:
    """What the unknowns mean: the group of lengths of every class side, and each class's bubbles."""

    laid: LaidFaces
    group: Ints
    lean: Floats
    bases: tuple[Floats, ...]
    spans: tuple[slice, ...]
    unknowns: int

    def rows(self, index: int, arcs: Floats, bubbles: Floats) -> Floats:
        """(n, unknowns): terms of arcs (n, 3) and of bubbles (n, 6) of a class as rows."""
        out = np.zeros((len(arcs), self.unknowns))
        for side, lengths in enumerate(self.laid.class_lengths[index]):
            own = self.group[index, side]
            out[:, own] += arcs[:, side] * lengths**2 / 2 * np.cos(self.lean[own])
        out[:, self.spans[index]] = bubbles @ self.bases[index]
        return out

    def distances(self, surface: TriMesh) -> _System:
        """Heights of the surface over every face, each face's rows weighted by its share of the area."""
        laid, points = self.laid, barycentric_grid(FIT_LEVELS).points
        rows = [
            self.rows(k, monomials(ARCS, points), monomials(BUBBLES, points)) for k in range(len(laid.class_lengths))
        ]
        height = heights(laid, surface, points)
        known = np.abs(height) < FARTHEST * laid.mesh.mean_edge
        share = np.sqrt(laid.mesh.areas / laid.mesh.areas.sum() / len(points))[:, None] * known
        matrix = np.concatenate([share[f, :, None] * rows[k] for f, k in enumerate(laid.face_class)])
        return _System(matrix, (share * height).ravel())

    def breaks(self) -> _System:
        """What is left of each bend between the tangent planes at a joint, to first order of the slopes."""
        laid = self.laid
        slopes = np.stack([self._outward_slopes(k) for k in range(len(laid.class_lengths))])
        ends = slopes[laid.face_class[laid.joint_face], laid.joint_side]  # (E, 2, n, unknowns)
        second = np.where(laid.opposed[:, None, None], ends[:, 1, ::-1], ends[:, 1])
        share = np.sqrt(laid.mesh.edge_lengths / laid.mesh.edge_lengths.sum() / len(ALONG))
        matrix = (ends[:, 0] + second) * share[:, None, None]
        wanted = np.repeat(-laid.bend_radians * share, len(ALONG))
        return _System(matrix.reshape(-1, self.unknowns), wanted)

    def _outward_slopes(self, index: int) -> Floats:
        """(3, n, unknowns): how the height of a class's patch rises outwards at each side."""
        gradient = barycentric_gradients(self.laid.class_lengths[index])
        out = np.empty((3, len(ALONG), self.unknowns))
        for side in range(3):
            at = side_points(side, ALONG)
            outward = -gradient[(side + 2) % 3] / np.linalg.norm(gradient[(side + 2) % 3])
            along = gradient @ outward
            out[side] = self.rows(index, gradients(ARCS, at) @ along, gradients(BUBBLES, at) @ along)
        return out


def heights(laid: LaidFaces, surface: TriMesh, barycentric: Floats) -> Floats:
    """(F, n): how far the surface lies over each face at barycentric coordinates (n, 3) of its class's corners."""
    points = np.einsum("nk,fkc->fnc", barycentric, laid.mesh.vertices[laid.vertices])
    closest = project(surface, points.reshape(-1, 3))[0].reshape(points.shape)
    return np.einsum("fnc,fc->fn", closest - points, laid.mesh.face_normals)


def _joint_groups(laid: LaidFaces, group: Ints) -> Ints:
    return group[laid.face_class[laid.joint_face[:, 0]], laid.joint_side[:, 0]]


def _leans(laid: LaidFaces, group: Ints, count: int) -> Floats:
    """(g,): half the mean bend of the joints of each group of lengths."""
    own = _joint_groups(laid, group)
    total = np.bincount(own, weights=laid.bend_radians, minlength=count)
    return read_only(total / np.maximum(np.bincount(own, minlength=count), 1) / 2)


def _largest_curvatures(laid: LaidFaces, group: Ints, lean: Floats, most_gap: float) -> Floats:
    """(g,): the curvature 8s/L² of each group at which the joints' gap has reached `most_gap`."""
    own = _joint_groups(laid, group)
    across = 2 * np.abs(np.sin(laid.bend_radians / 2 - lean[own])) * laid.mesh.edge_lengths**2 / 8
    widest = np.array(
        [np.percentile(across[own == g], PERCENTILE) if (own == g).any() else 0.0 for g in range(len(lean))]
    )
    return np.divide(most_gap, widest, out=np.full(len(lean), np.inf), where=widest > 0)
