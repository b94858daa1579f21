"""Agglomerative clustering of pieces into shapes: the two nearest become one as long as no piece is too far from it.

A shape is the mean of its pieces, laid on one another. Pieces may also be made alike: vertices of M_f are moved, by a
little, so that all pieces of a shape agree (`distance_geometry`) and pockets keep their room (`corner_room`).
"""

from dataclasses import dataclass, replace

import numpy as np

from drkid.mesh import Floats, Ints, TriMesh, read_only
from drkid.patches.corner_room import CornerRooms, corner_rooms
from drkid.patches.distance_geometry import Place, made_congruent, place
from drkid.patches.identity import built_alike, misfits, relabellings
from drkid.patches.outline import Outlined
from drkid.rigid_fit import rigid_fit

MEANS = 4  # rounds of laying pieces on their mean and taking the mean of them
AT_ONCE = 12  # pairs of shapes that are merged in one trial; halved where it fails
MOST_MISSES = 12  # single pairs in a row that cannot be made alike
MOST_MOVED = 600  # vertices up to which pieces are made alike; it takes time as their cube


@dataclass(frozen=True, eq=False)
class Shapes:
    """Pieces, turned so that those of one shape name their corners alike, and their shapes.

    `shape` (P,) is the number of each, `means` its corners and then inner points, `misfit` (P,) how far the farthest
    of a piece's lies from them.
    """

    vertices: Floats
    pieces: list[Outlined]
    shape: Ints
    means: dict[int, Floats]
    misfit: Floats


@dataclass(frozen=True, eq=False)
class _Limits:
    tolerance: float
    shift: float
    held: Place
    apart: CornerRooms


def agglomerated(mesh: TriMesh, pieces: list[Outlined], tolerance: float, most_shift: float) -> Shapes:
    """Few shapes: no piece farther than `tolerance` from its own, no vertex off the surface by more than `most_shift`.

    Greedy: the nearest shapes first, several at once while that succeeds. Both limits are in the mesh's unit; where
    `most_shift` is 0 the mesh stays as it is.
    """
    pieces = list(pieces)
    groups = built_alike(pieces)
    for own in groups:
        first = pieces[own[0]]
        for p in own:
            pieces[p] = pieces[p].turned(relabellings(first, pieces[p])[0])
    shift = most_shift if len(mesh.vertices) <= MOST_MOVED else 0.0
    limits = _Limits(tolerance, shift, place(mesh), corner_rooms(mesh, pieces))
    found = _measured(mesh.vertices, pieces, np.arange(len(pieces)))
    at_once, misses, tabu = AT_ONCE, 0, set[tuple[int, int, int]]()
    while misses < MOST_MISSES or not shift:
        chosen = _nearest(found, groups, tabu, at_once, None if shift else 2 * tolerance)
        if not chosen:
            break
        tried = _merged(found, chosen, limits)
        if tried is not None:
            found, misses = tried, 0
        elif at_once > 1:
            at_once //= 2
        else:
            tabu.add(chosen[0])
            misses += 1
    return found


def _nearest(
    found: Shapes, groups: list[list[int]], tabu: set[tuple[int, int, int]], most: int, farthest: float | None
) -> list[tuple[int, int, int]]:
    """Up to `most` pairs of shapes and the turn that lays the second on the first, nearest first, none used twice."""
    pairs: list[tuple[float, int, int, int]] = []
    for group in groups:
        shapes = sorted(set(found.shape[group].tolist()))
        points = np.stack([found.means[k] for k in shapes])
        piece = found.pieces[group[0]]
        for by in relabellings(piece, piece):
            turned = np.concatenate(
                [np.roll(points[:, : len(piece.vertices)], -by, 1), points[:, len(piece.vertices) :]], 1
            )
            apart = misfits(turned[None], points[:, None])
            for i, j in np.argwhere(np.triu(np.isfinite(apart), 1)).tolist():
                pairs.append((float(apart[i, j]), shapes[i], shapes[j], by))
    chosen, used = list[tuple[int, int, int]](), set[int]()
    for apart, one, other, by in sorted(pairs):
        if farthest is not None and apart > farthest:
            break
        if (one, other, by) not in tabu and one not in used and other not in used:
            used |= {one, other}
            chosen.append((one, other, by))
            if len(chosen) == most:
                break
    return chosen


def _merged(found: Shapes, chosen: list[tuple[int, int, int]], limits: _Limits) -> Shapes | None:
    """With pairs of shapes made one each; None where that breaks a limit."""
    pieces, shape = list(found.pieces), found.shape.copy()
    for one, other, by in chosen:
        for p in np.flatnonzero(found.shape == other).tolist():
            pieces[p] = pieces[p].turned(by)
            shape[p] = one
    if not limits.shift:
        tried = _measured(found.vertices, pieces, shape)
        return tried if tried.misfit.max() <= limits.tolerance else None
    vertices = made_congruent(found.vertices, pieces, shape, limits.held, limits.apart)
    tried = _with_inner(_measured(vertices, pieces, shape))
    moved = limits.held.moved(tried.vertices).max()
    return (
        tried
        if limits.apart.enough(tried.vertices) and moved <= limits.shift and tried.misfit.max() <= limits.tolerance
        else None
    )


def _measured(vertices: Floats, pieces: list[Outlined], shape: Ints) -> Shapes:
    means, misfit = dict[int, Floats](), np.zeros(len(pieces))
    for k in np.unique(shape).tolist():
        own = np.flatnonzero(shape == k)
        laid = np.stack([vertices[[*pieces[p].vertices, *pieces[p].inner]] for p in own.tolist()])
        mean = laid[0]
        if len(own) > 1:
            for _ in range(MEANS):
                motion = rigid_fit(laid, np.broadcast_to(mean, laid.shape))
                laid = np.einsum("pij,pnj->pni", motion[:, :3, :3], laid) + motion[:, None, :3, 3]
                mean = laid.mean(axis=0)
            misfit[own] = misfits(laid, mean)
        means[k] = mean
    return Shapes(vertices, pieces, shape, means, read_only(misfit))


def _with_inner(found: Shapes) -> Shapes:
    """The inner points, that no other piece has, put where the shapes have them."""
    vertices = found.vertices.copy()
    for piece, k in zip(found.pieces, found.shape.tolist(), strict=True):
        if piece.inner:
            mean, count = found.means[k], len(piece.vertices)
            motion = rigid_fit(mean[:count], vertices[list(piece.vertices)])
            vertices[list(piece.inner)] = mean[count:] @ motion[:3, :3].T + motion[:3, 3]
    return _measured(vertices, found.pieces, found.shape) if (vertices != found.vertices).any() else found


def renumbered(found: Shapes) -> Shapes:
    """The shapes numbered by how many pieces they have, most first."""
    kinds, count = np.unique(found.shape, return_counts=True)
    order = kinds[np.argsort(-count, kind="stable")].tolist()
    number = {k: i for i, k in enumerate(order)}
    shape = np.array([number[k] for k in found.shape.tolist()])
    return replace(found, shape=shape, means={number[k]: mean for k, mean in found.means.items()})
