"""Assignment: which class of curved patches every face is made from, so that the pieces at a joint have one curve."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import coo_array, csr_array

from drkid.mesh import Floats, Ints, read_only
from drkid.patches.canonical_fit import PERCENTILE, CanonicalFit, Target, gaps
from drkid.patches.laid_faces import LaidFaces

OPTIMAL = 1e-3  # of the cost: an assignment so near to the best is taken
MOST_NODES = 2000  # of the search for it; some dozens do, for its linear relaxation is nearly whole
SWEEPS = 8  # over all faces, each changing to the class that leaves least
ROUNDING = 1 + 1e-9  # of a gap
LEAST_GAIN = 1e-12  # of the sum that flat pieces leave: below it, a change is rounding


@dataclass(frozen=True, eq=False)
class PatchClasses:
    """Classes (k,) of patches: their triangle `parent` (k,), the `curve` (k, 3) at each side; a `choice` (F,) of them.

    `group` (c,) is the group of lengths that each curve belongs to.
    """

    parent: Ints
    curve: Ints
    group: Ints
    choice: Ints

    @property
    def kind(self) -> Ints:
        """(k,): equal for classes of one triangle with the same curves."""
        rows = np.column_stack([self.parent, self.curve])
        return np.unique(rows, axis=0, return_inverse=True)[1].ravel().astype(np.int64)

    def laid(self, laid: LaidFaces) -> LaidFaces:
        """Faces laid on triangle classes as members of these."""
        return replace(laid, face_class=self.choice, class_lengths=laid.class_lengths[self.parent])


def side_neighbours(laid: LaidFaces) -> tuple[Ints, Ints, Ints]:
    """(F, 3) each: the joint at a face's class side, the face across it, and the class side of that face there."""
    joint, face, side = (np.empty((len(laid.face_class), 3), np.int64) for _ in range(3))
    for end in range(2):
        at = laid.joint_face[:, end], laid.joint_side[:, end]
        joint[at] = np.arange(len(laid.joint_face))
        face[at], side[at] = laid.joint_face[:, 1 - end], laid.joint_side[:, 1 - end]
    return joint, face, side


def curves_agreed(laid: LaidFaces, classes: PatchClasses, fit: CanonicalFit, target: Target) -> Ints:
    """(F,): the class of each face, all to choose from, such that the two sides at every joint are one curve.

    An integer programme: the least sum, over the faces, of the distances to the surface and of twice what each side
    lacks of half the bend at its joint. At 5 of 100 joints the gap may be wider than the widest. Where the search ends
    without any, it is the choice that the classes come with.

    Args:
        laid: the faces, by triangle classes.
        classes: what there is to choose from.
        fit: their patches.
        target: what they are held against.
    """
    joint = side_neighbours(laid)[0]
    face, taken = np.nonzero(classes.parent[None] == laid.face_class[:, None])
    edge, curve = np.nonzero(classes.group[None] == _joint_groups(laid, classes)[:, None])
    cost = _costs(laid, joint, fit, target)[face, taken]
    one = csr_array((np.ones(len(face)), (face, np.arange(len(face)))), shape=(len(joint), len(face) + len(edge)))
    wide = gaps(laid, fit.sagittas, fit.leans)[edge, curve] > ROUNDING * target.most_gap
    most_wide = int(np.floor((1 - PERCENTILE / 100) * len(laid.joint_face)))
    found = milp(
        np.concatenate([cost / cost.mean(), np.zeros(len(edge))]),
        constraints=[
            LinearConstraint(one, 1, 1),
            LinearConstraint(_agreement(joint, classes, (face, taken), (edge, curve)), 0, 0),
            LinearConstraint(np.concatenate([np.zeros(len(face)), wide])[None], 0, most_wide),
        ],
        integrality=np.concatenate([np.zeros(len(face)), np.ones(len(edge))]),
        bounds=Bounds(0, 1),
        options={"mip_rel_gap": OPTIMAL, "node_limit": MOST_NODES},
    )
    if found.x is None:
        return classes.choice
    share = np.full((len(joint), len(classes.parent)), -1.0)
    share[face, taken] = found.x[: len(face)]
    return read_only(share.argmax(axis=1).astype(np.int64))


def _agreement(joint: Ints, classes: PatchClasses, members: tuple[Ints, Ints], curves: tuple[Ints, Ints]) -> csr_array:
    """Rows for every face, side and curve: the classes chosen that have it there, less whether the joint has it."""
    (face, taken), (edge, curve) = members, curves
    count = len(classes.group)
    column = np.full((int(joint.max()) + 1, count), -1, np.int64)
    column[edge, curve] = len(face) + np.arange(len(edge))
    own_face, own_side, own_curve = np.nonzero(column[joint] >= 0)
    row = np.concatenate([
        ((3 * face[:, None] + np.arange(3)) * count + classes.curve[taken]).ravel(),
        (3 * own_face + own_side) * count + own_curve,
    ])  # fmt: skip
    at = np.concatenate([np.repeat(np.arange(len(face)), 3), column[joint[own_face, own_side], own_curve]])
    value = np.where(at < len(face), 1.0, -1.0)
    return coo_array((value, (row, at)), shape=(joint.size * count, len(face) + len(edge))).tocsr()


def _joint_groups(laid: LaidFaces, classes: PatchClasses) -> Ints:
    """(E,): the group of lengths of each joint."""
    first = np.searchsorted(np.sort(classes.parent), np.arange(int(classes.parent.max()) + 1))
    side = classes.curve[np.argsort(classes.parent, kind="stable")[first]]
    return classes.group[side[laid.face_class[laid.joint_face[:, 0]], laid.joint_side[:, 0]]]


def _costs(laid: LaidFaces, joint: Ints, fit: CanonicalFit, target: Target) -> Floats:
    """(F, k): what each class would leave at each face, were half of every bend that of its side."""
    cost = _distances(fit, target)
    for side in range(3):
        own = joint[:, side]
        lacking = fit.slopes[None, :, side] + laid.bend_radians[own, None, None] / 2
        cost += 2 * target.smoothness[own, None] * (lacking**2).sum(axis=2)
    return cost


def _distances(fit: CanonicalFit, target: Target) -> Floats:
    """(F, k): the squared distances that each class would leave at each face."""
    square = (target.weight * target.measured**2).sum(axis=1)
    mixed = (target.weight * target.measured) @ fit.measured.T
    return np.maximum(square[:, None] - 2 * mixed + target.weight @ (fit.measured**2).T, 0.0)


def improved(laid: LaidFaces, kind: Ints, choice: Ints, fit: CanonicalFit, target: Target) -> Ints:
    """The choice (F,) with faces changed, one after the other, to the class of the same `kind` (k,) that leaves least.

    Breaks count with the neighbours as they are. Stops when no face gains.
    """
    joint, face, side = side_neighbours(laid)
    alike = [np.flatnonzero(kind == own) for own in kind]
    distance, weight, bend = _distances(fit, target), target.smoothness[joint], laid.bend_radians[joint]
    # a joint's places run the other way along the neighbour's side where the two sides are opposed
    ways = np.stack([fit.slopes, fit.slopes[..., ::-1]], axis=1)
    opposed = laid.opposed[joint].astype(np.int64)
    least = LEAST_GAIN * float((target.weight * target.measured**2).sum())
    out = choice.copy()
    for _ in range(SWEEPS):
        changed = False
        for f in range(len(out)):
            classes = alike[out[f]]
            facing = ways[out[face[f]], opposed[f], side[f]] + bend[f][:, None]
            left = distance[f, classes] + ((fit.slopes[classes] + facing) ** 2).sum(axis=2) @ weight[f]
            best = int(left.argmin())
            if left[best] < left[classes == out[f]][0] - least:
                out[f], changed = classes[best], True
        if not changed:
            break
    return read_only(out)
