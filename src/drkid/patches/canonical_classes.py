"""Classes of canonical patches: triangles told apart by the curves at their sides, and by the depth of their inside.

A side of one length may have one of several boundary curves: the two pieces at a joint have the same one, so that any
two pieces meet as tightly as before. Members of one triangle with the same curves that bulge alike share one patch;
their sides do not depend on the inside, so that a deep and a shallow patch meet all the same neighbours.
"""

from dataclasses import replace
from itertools import product

import numpy as np

from drkid.class_triangle import is_equilateral
from drkid.curved_patch import barycentric_grid, monomials
from drkid.kit import Decomposition
from drkid.mesh import Floats, Ints, TriMesh, read_only
from drkid.patches.assignment import PatchClasses, curves_agreed, improved, side_neighbours
from drkid.patches.canonical_fit import FIT_LEVELS, CanonicalFit, Target, canonical_fit, target_of
from drkid.patches.canonical_patch import ARCS, CanonicalPatch, length_groups
from drkid.patches.laid_faces import LaidFaces, laid_faces

MOST_ROUNDS = 12  # of choosing patches for members and members for patches; it settles in a few
MOST_LENGTHS = 3  # kinds of sides: as many as a palette has lengths; more lengths share one curvature


def canonical_classes(
    decomposition: Decomposition, surface: TriMesh, classes: int, smoothness: float, most_gap: float
) -> tuple[Decomposition, LaidFaces, tuple[CanonicalPatch, ...]]:
    """The decomposition with its classes divided into `classes` in all, and their canonical patches.

    Every length begins with one boundary curve. As long as that leaves less, one of them gets one more, of those with
    which every triangle can still have every combination of curves; the classes that are left divide triangles by
    depth. For each such plan, `canonical_fit` and the choice of classes for the faces alternate, as in k-means.
    Classes that nobody uses are dropped. Fewer classes than the triangles have are left as they are.

    Args:
        decomposition: classes of triangles.
        surface: M_i, in the same unit.
        classes: how many classes of patches there may be.
        smoothness: weight of the tangent breaks (`target_of`).
        most_gap: largest gap at 95 of 100 joints.
    """
    laid = laid_faces(decomposition)
    target = target_of(laid, surface, smoothness, most_gap)
    group = length_groups(laid.class_lengths, MOST_LENGTHS)
    plan = np.ones(int(group.max()) + 1, np.int64)
    found, fit = _alternated(laid, target, _first(laid, target, group, plan, classes))
    several = _told_apart(laid, group)
    while True:
        plans = [plan + (np.arange(len(plan)) == g) for g in several]
        plans = [p for p in plans if p[group].prod(axis=1).sum() <= classes]
        tried = [(*_alternated(laid, target, _first(laid, target, group, p, classes)), p) for p in plans]
        best = min(tried, key=lambda one: one[1].residual, default=None)
        if best is None or best[1].residual >= fit.residual:
            break
        found, fit, plan = best
    return _of_use(decomposition, laid, found, fit)


def _told_apart(laid: LaidFaces, group: Ints) -> list[int]:
    """Groups of lengths that may have several curves.

    Not those of equilateral triangles, whose sides nothing else would tell apart, and none where a mesh is not exact
    and the two sides at a joint are taken for different lengths.
    """
    equal = {int(own[0]) for own, lengths in zip(group, laid.class_lengths, strict=True) if is_equilateral(lengths)}
    ends = group[laid.face_class[laid.joint_face], laid.joint_side]
    exact = bool((ends[:, 0] == ends[:, 1]).all())
    return [g for g in range(int(group.max()) + 1) if g not in equal] if exact else []


def _first(laid: LaidFaces, target: Target, group: Ints, plan: Ints, classes: int) -> PatchClasses:
    """Classes to begin with: so many curves of each length, joints sorted by their sagitta, faces by their depth."""
    first = np.concatenate([[0], np.cumsum(plan)])
    joint = side_neighbours(laid)[0]
    joint_group = group[laid.face_class[laid.joint_face[:, 0]], laid.joint_side[:, 0]]
    rank = _ranked(_joint_sagittas(laid, target, joint), joint_group, plan)
    rows = [
        (k, *own)
        for k, sides in enumerate(group)
        for own in product(*(range(first[g], first[g] + plan[g]) for g in sides))
    ]
    number = {row: i for i, row in enumerate(rows)}
    faces = np.column_stack([laid.face_class, first[group[laid.face_class]] + rank[joint]]).tolist()
    choice = np.array([number[tuple(row)] for row in faces], np.int64)
    kinds = np.array(rows, np.int64)
    owner, choice = _split(choice, _depths(target), len(rows), classes)
    return PatchClasses(kinds[owner, 0], kinds[owner, 1:], np.repeat(np.arange(len(plan)), plan), choice)


def _joint_sagittas(laid: LaidFaces, target: Target, joint: Ints) -> Floats:
    """(E,): sagitta of the parabola nearest to the surface over each joint, from both faces."""
    grid = barycentric_grid(FIT_LEVELS)
    out = np.zeros(len(laid.joint_face))
    for side in range(3):
        at = grid.sides[side]
        arc = 4 * monomials(ARCS, grid.points[at])[:, side]
        np.add.at(out, joint[:, side], target.measured[:, at] @ arc / (2 * (arc**2).sum()))
    return out


def _ranked(values: Floats, own: Ints, counts: Ints) -> Ints:
    """(n,): 0 for the smallest values of each group, and so on: each group in so many equal shares."""
    out = np.zeros(len(values), np.int64)
    for g, count in enumerate(counts.tolist()):
        members = np.flatnonzero(own == g)
        rank = np.argsort(np.argsort(values[members], kind="stable"), kind="stable")
        out[members] = rank * count // max(len(members), 1)
    return out


def _depths(target: Target) -> Floats:
    """(F,): how far the surface bulges over each face."""
    points = barycentric_grid(FIT_LEVELS).points
    weight = target.weight[:, : len(points)] * points.prod(axis=1)
    total = weight.sum(axis=1)
    return (weight * target.measured[:, : len(points)]).sum(axis=1) / np.where(total > 0, total, 1.0)


def _split(choice: Ints, depth: Floats, kinds: int, classes: int) -> tuple[Ints, Ints]:
    """The kind of each class, and a class for each face: ever the largest spread of depth is halved at its median."""
    owner, choice = list(range(kinds)), choice.copy()
    while len(owner) < classes:
        members = [np.flatnonzero(choice == k) for k in range(len(owner))]
        spread = [float(((depth[m] - depth[m].mean()) ** 2).sum()) if len(m) > 1 else 0.0 for m in members]
        widest = int(np.argmax(spread))
        if spread[widest] <= 0:
            break
        own = members[widest]
        choice[own[np.argsort(depth[own], kind="stable")[len(own) // 2 :]]] = len(owner)
        owner.append(owner[widest])
    return np.array(owner, np.int64), choice


def _alternated(laid: LaidFaces, target: Target, classes: PatchClasses) -> tuple[PatchClasses, CanonicalFit]:
    """The best of the rounds of patches for members and members for patches."""
    several = len(classes.group) > int(classes.group.max()) + 1
    best, fit = classes, canonical_fit(classes.laid(laid), classes.curve, target)
    tried, now = classes, fit
    for _ in range(MOST_ROUNDS):
        choice = tried.choice
        if several:
            choice = curves_agreed(laid, tried, now, target)
        choice = improved(laid, tried.kind, choice, now, target)
        if (choice == tried.choice).all():
            break
        tried = replace(tried, choice=choice)
        now = canonical_fit(tried.laid(laid), tried.curve, target)
        if now.residual < fit.residual:
            best, fit = tried, now
    return best, fit


def _of_use(
    decomposition: Decomposition, laid: LaidFaces, classes: PatchClasses, fit: CanonicalFit
) -> tuple[Decomposition, LaidFaces, tuple[CanonicalPatch, ...]]:
    """The classes that have members, in order of their triangles and curves."""
    used = np.unique(classes.choice)
    used = used[np.lexsort((used, *classes.curve[used].T[::-1], classes.parent[used]))]
    rank = np.empty(len(classes.parent), np.int64)
    rank[used] = np.arange(len(used))
    face_class, parent = read_only(rank[classes.choice]), classes.parent[used]
    divided = replace(
        decomposition, face_class=face_class, class_lengths=read_only(decomposition.class_lengths[parent])
    )
    found = replace(laid, face_class=face_class, class_lengths=laid.class_lengths[parent])
    return divided, found, tuple(fit.patches[k] for k in used)
