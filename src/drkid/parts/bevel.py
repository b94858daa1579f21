"""Bevels that cannot collide: the planes between neighbours, and the least inset that serves a whole class."""

import numpy as np

from drkid.class_triangle import equal_sides
from drkid.mesh import Floats
from drkid.parts.members import Members

SHARPEST_JOINT_DEGREES = 140.0  # bends beyond this are served as if they were this sharp
MOST_MIDDLE_INSET = 0.45  # of the thickness: how far a side may stand back from the hinge axis at mid-height


def demanded(members: Members, scale: float, thickness_mm: float, swing_degrees: float) -> Floats:
    """(F, 2, 3): least inset of each member's sides at the inner and the outer face, in mm.

    A piece stays on its own side of the plane that halves the angle δ between neighbours iff its inset is at least
    far − z·tan(δ/2) at z = ±t/2, δ ranging over the bend ± the swing; `far` is how far the mesh's edge itself lies
    inside the part's, which is 0 for a face that is congruent to its class.
    """
    swing = np.radians(swing_degrees)
    most = np.radians(SHARPEST_JOINT_DEGREES)
    low, high = (np.tan(np.clip(members.bend_radians + s, -most, most) / 2) for s in (-swing, swing))
    return scale * members.far[:, None, :] + thickness_mm / 2 * np.stack([high, -low], axis=1)


def bisector_insets(demand: Floats, members: Members, class_lengths: Floats) -> Floats:
    """(k, 2, 3): smallest insets at the inner and outer face that serve all members, shared by equal sides, in mm.

    For congruent members this is d(z) = σ* − z·tan φ* with tan φ* = ½(max + min) of tan(δ/2) and
    σ* = (t/4)(max − min): an inset that is large enough at both faces is so at every height between. A side never
    stands out over the hinge axis at mid-height.
    """
    insets = np.full((len(class_lengths), 2, 3), -np.inf)
    np.maximum.at(insets, members.face_class, demand)
    for row, lengths in zip(insets, class_lengths, strict=True):
        group = equal_sides(lengths)
        shared = np.stack([row[:, group == g].max(axis=1) for g in range(group[-1] + 1)], axis=1)
        row[:] = shared[:, group]
    insets[np.isneginf(insets)] = 0.0  # a class without members
    return insets + np.maximum(-insets.mean(axis=1, keepdims=True), 0.0)


def bevel_insets(bends_degrees: tuple[float, float], thickness_mm: float, swing_degrees: float) -> Floats:
    """(2, 1): insets at the inner and outer face that serve every bend between a concave and a convex one, in mm.

    They depend on no mesh, so that pieces of the same lengths are the same for every shape.
    """
    concave, convex = np.tan(np.radians(np.add(bends_degrees, swing_degrees)) / 2)
    return thickness_mm / 2 * np.array([[convex], [concave]])


def limited(insets_mm: Floats, deepest_mm: float, thickness_mm: float) -> Floats:
    """Insets (…, 2, 3) cut down to what leaves the connector its hold.

    No more than `deepest_mm` at either face, and `MOST_MIDDLE_INSET` of the thickness at mid-height.
    """
    insets = np.minimum(insets_mm, deepest_mm)
    excess = insets.mean(axis=-2, keepdims=True) - MOST_MIDDLE_INSET * thickness_mm
    return insets - np.maximum(excess, 0.0)
