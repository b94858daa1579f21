"""Bevel variants: a class split into moulds of narrower bevels, and the way round that an equilateral piece lies."""

from dataclasses import dataclass, replace

import numpy as np

from drkid.class_triangle import is_equilateral
from drkid.kit import Decomposition, class_id
from drkid.mesh import Bools, Floats, Ints, read_only
from drkid.parts.bevel import bevel_groups, demanded, flippable_insets
from drkid.parts.members import Members, members_of
from drkid.spec import FOLLOWING, KitSpec

MOST_MOVES_EACH = 10  # of the local search, which ends by itself after fewer
LEAST_GAIN = 1e-9  # relative: what a move must save


@dataclass(frozen=True, eq=False)
class Variants:
    """Which variant of its class each face (F,) is made from, and by how many sides it is `turned` for that (F,)."""

    variant: Ints
    turned: Ints


@dataclass(frozen=True, eq=False)
class Moulds:
    """The decomposition seen as moulds: every variant of a class is a class of its own, which `members` belong to.

    Mould m (left and right counted as one) is variant `variant[m]` of class `class_index[m]`, from 1; 0 where the
    class has no other.
    """

    decomposition: Decomposition
    members: Members
    class_index: Ints
    variant: Ints

    def name(self, mould: int) -> str:
        """As people read it: A, or A2 where class A has several."""
        return f"{class_id(int(self.class_index[mould]))}{int(self.variant[mould]) or ''}"

    @property
    def count(self) -> int:
        """Printed shapes in use, left and right apart."""
        return len(np.unique(np.stack([self.members.face_class, self.members.left], axis=1), axis=0))


def moulds(decomposition: Decomposition, spec: KitSpec, count: int) -> Moulds:
    """The moulds of a kit with at most `count` variants of every class; one each where no bevel follows the bends."""
    members = members_of(decomposition)
    if spec.thickening not in FOLLOWING or spec.bevel_degrees is not None:
        return _without_variants(decomposition, members)
    congruent = replace(members, far=np.zeros_like(members.far))  # what a bend asks does not depend on the scale
    demand = demanded(congruent, 1.0, 2.0, spec.swing_degrees)
    if spec.thickening == "flippable":
        demand = flippable_insets(demand)
    found = bevel_variants(demand, decomposition.face_class, decomposition.class_lengths, count)
    return _as_classes(decomposition, members_of(decomposition, found.turned), found)


def _without_variants(decomposition: Decomposition, members: Members) -> Moulds:
    numbers = np.arange(len(decomposition.class_lengths))
    return Moulds(decomposition, members, read_only(numbers), read_only(np.zeros_like(numbers)))


def _as_classes(decomposition: Decomposition, members: Members, found: Variants) -> Moulds:
    """Every class's variants in a row, those with more members first; a class without members keeps its place."""
    mould, owners, numbers = np.zeros(len(found.variant), np.int64), list[int](), list[int]()
    for index in range(len(decomposition.class_lengths)):
        own = np.flatnonzero(decomposition.face_class == index)
        names, sizes = np.unique(found.variant[own], return_counts=True)
        ordered = names[np.argsort(-sizes, kind="stable")]
        for rank, name in enumerate(ordered.tolist()):
            mould[own[found.variant[own] == name]] = len(owners) + rank
        several = max(len(ordered), 1)
        owners += [index] * several
        numbers += range(1, several + 1) if several > 1 else [0]
    classes = replace(decomposition, face_class=read_only(mould), class_lengths=decomposition.class_lengths[owners])
    return Moulds(
        classes,
        replace(members, face_class=classes.face_class),
        read_only(np.array(owners)),
        read_only(np.array(numbers)),
    )


def bevel_variants(demand: Floats, face_class: Ints, class_lengths: Floats, count: int) -> Variants:
    """At most `count` variants of every class, chosen so that grooves are narrow; for 1, the turns alone.

    `demand` (F, 2, 3) is what each member asks of its sides at the inner and the outer face. A variant's inset is the
    largest that its members ask for, so all its pieces together stand back by members × Σ insets, summed over sides
    and faces: half of what their grooves are wide, neighbours included. That sum is made small by cutting the variant
    where it saves most, at a threshold of one side's demand, until there are `count`; then single faces change their
    variant or, where equilateral, their turn, as long as that saves anything. Deterministic; a local minimum.
    """
    variant, turned = np.zeros(len(face_class), np.int64), np.zeros(len(face_class), np.int64)
    for index, lengths in enumerate(class_lengths):
        own = np.flatnonzero(face_class == index)
        if len(own):
            options, weights = _options(demand[own], lengths)
            variant[own], turned[own] = _clustered(options, weights, count)
    return Variants(read_only(variant), read_only(turned))


def _options(demand: Floats, lengths: Floats) -> tuple[Floats, Floats]:
    """What a member asks for in each way of laying it down (n, ways, q), and how many sides each number stands for."""
    group = bevel_groups(lengths)
    ways = [np.roll(demand, -turn, axis=2) for turn in range(3 if is_equilateral(lengths) else 1)]
    columns = [
        np.stack([way[:, face][:, group == g].max(axis=1) for way in ways], axis=1)
        for g in range(group[-1] + 1)
        for face in (0, 1)
    ]
    return np.stack(columns, axis=2), np.repeat(np.bincount(group), 2).astype(np.float64)


def _clustered(options: Floats, weights: Floats, count: int) -> tuple[Ints, Ints]:
    """Variant and way (n,) of each member; the best of the starts, one for each number that a way can make small."""
    best: tuple[float, Ints, Ints] | None = None
    for column in range(options.shape[2] if options.shape[1] > 1 else 1):
        way = np.argmin(options[:, :, column], axis=1).astype(np.int64)
        variant = _split(options[np.arange(len(way)), way], weights, count)
        variant, way = _improved(options, weights, count, variant, way)
        cost = _cost(options[np.arange(len(way)), way], weights, variant)
        if best is None or cost < best[0] * (1 - LEAST_GAIN):
            best = cost, variant, way
    if best is None:
        message = "a class without members"
        raise ValueError(message)
    return best[1], best[2]


def _cost(points: Floats, weights: Floats, variant: Ints) -> float:
    used, own = np.unique(variant, return_inverse=True)
    highest = np.full((len(used), points.shape[1]), -np.inf)
    np.maximum.at(highest, own, points)
    return float(np.bincount(own) @ highest @ weights)


def _split(points: Floats, weights: Floats, count: int) -> Ints:
    """Points (n, q) cut into `count` boxes, fewer where nothing is saved, each cut the one that saves most."""
    variant = np.zeros(len(points), np.int64)
    cuts = {0: _best_cut(points, weights)}
    for fresh in range(1, count):
        which = max(cuts, key=lambda one: cuts[one][0])
        saved, beyond = cuts[which]
        if saved <= LEAST_GAIN:
            break
        own = np.flatnonzero(variant == which)
        variant[own[beyond]] = fresh
        for one in (which, fresh):
            cuts[one] = _best_cut(points[variant == one], weights)
    return variant


def _best_cut(points: Floats, weights: Floats) -> tuple[float, Bools]:
    """What the best threshold in one column saves, and the points (n,) beyond it."""
    size = len(points)
    whole = size * float(points.max(axis=0) @ weights)
    best, beyond = 0.0, np.zeros(size, np.bool_)
    for column in points.T:
        order = np.argsort(column, kind="stable")
        upwards = np.maximum.accumulate(points[order]) @ weights
        downwards = np.maximum.accumulate(points[order[::-1]])[::-1] @ weights
        below = np.arange(1, size)
        saved = whole - below * upwards[:-1] - (size - below) * downwards[1:]
        if size > 1 and saved.max() > best:
            best = float(saved.max())
            beyond = np.zeros(size, np.bool_)
            beyond[order[int(np.argmax(saved)) + 1 :]] = True
    return best, beyond


def _improved(options: Floats, weights: Floats, count: int, variant: Ints, way: Ints) -> tuple[Ints, Ints]:
    """Steepest descent: of all single moves to another variant or way the one that saves most, while one does."""
    variant, way = variant.copy(), way.copy()
    everyone = np.arange(len(variant))
    for _ in range(MOST_MOVES_EACH * len(variant)):
        points = options[everyone, way]
        added = _added(options, points, weights, count, variant)
        saved = added[everyone, variant, way] - added.min(axis=(1, 2))
        mover = int(np.argmax(saved))
        if saved[mover] <= LEAST_GAIN * np.abs(added).max():
            break
        variant[mover], way[mover] = divmod(int(np.argmin(added[mover])), options.shape[1])
    return variant, way


def _added(options: Floats, points: Floats, weights: Floats, count: int, variant: Ints) -> Floats:
    """(n, count, ways): by how much each member raises the sum in each place, if it leaves its own first."""
    sizes = np.bincount(variant, minlength=count)
    ranked = np.full((2, count, points.shape[1]), -np.inf)  # what the most and the second most demanding member ask for
    np.maximum.at(ranked[0], variant, points)
    first = points == ranked[0][variant]
    shared = np.zeros((count, points.shape[1]), np.int64)
    np.add.at(shared, variant, first)
    np.maximum.at(ranked[1], variant, np.where(first & (shared[variant] < 2), -np.inf, points))
    home = np.eye(count, dtype=np.bool_)[variant]  # (n, count)
    highest = np.where(home[..., None], np.where(first, ranked[1][variant], ranked[0][variant])[:, None], ranked[0])
    members = sizes - home
    before = np.where(members > 0, members * (np.where(np.isneginf(highest), 0.0, highest) @ weights), 0.0)
    after = np.maximum(highest[:, :, None], options[:, None]) @ weights
    return (members[..., None] + 1) * after - before[..., None]
