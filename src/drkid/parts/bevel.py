"""Bevels that cannot collide: the planes between neighbours, and the least inset that serves a whole class."""

from math import ceil

import numpy as np

from drkid.class_triangle import equal_sides, is_equilateral
from drkid.errors import FitError
from drkid.measure import bend_radians
from drkid.mesh import Floats, Ints, TriMesh
from drkid.parts.members import Members
from drkid.spec import KitSpec

SAME_BEND_DEGREES = 1e-6  # beyond a given bend: rounding
SHARPEST_JOINT_DEGREES = 140.0  # bends beyond this are served as if they were this sharp


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


def bevel_groups(lengths: Floats) -> Ints:
    """(3,): for each of three ascending side lengths, the number of the group of sides that share its bevel.

    Equal sides do, or the piece would lose its mirror image in itself. An equilateral piece keeps one with two sides
    alike and the third on its own: which of a face's three sides that one meets is then a choice.
    """
    return np.array([0, 0, 1]) if is_equilateral(lengths) else equal_sides(lengths)


def bisector_insets(demand: Floats, members: Members, class_lengths: Floats) -> Floats:
    """(k, 2, 3): smallest insets at the inner and outer face that serve all members, shared by `bevel_groups`, in mm.

    For congruent members this is the chord d(z) = σ* − z·tan φ* with tan φ* = ½(max + min) of tan(δ/2) and
    σ* = (t/4)(max − min): an inset that is large enough at both faces is so at every height between. A side never
    stands out over the hinge axis at mid-height.
    """
    insets = np.full((len(class_lengths), 2, 3), -np.inf)
    np.maximum.at(insets, members.face_class, demand)
    insets = _shared(insets, class_lengths)
    insets[np.isneginf(insets)] = 0.0  # a class without members
    return insets + np.maximum(-insets.mean(axis=1, keepdims=True), 0.0)


def _shared(insets: Floats, class_lengths: Floats) -> Floats:
    """Insets (k, n, 3) with the largest of each of `bevel_groups`."""
    groups = np.stack([bevel_groups(lengths) for lengths in class_lengths])
    together = groups[:, :, None] == groups[:, None, :]
    return np.where(together[:, None], insets[:, :, None, :], -np.inf).max(axis=3)


def flippable_insets(insets_mm: Floats) -> Floats:
    """Insets (…, 2, 3) with each side's larger one at both faces: the piece is its own image in the middle plane."""
    return np.repeat(insets_mm.max(axis=-2, keepdims=True), 2, axis=-2)


def ridged(insets_mm: Floats, ridge_mm: Floats | float) -> Floats:
    """(…, 3, 3): insets at the inner face, the middle plane and the outer face, for insets (…, 2, 3) at the faces.

    No bend asks for an inset where the hinge axis lies, at z = 0, so that each side comes back to `ridge_mm` (…, 3)
    there: d(z) = ridge + 2|z|/t·(inset − ridge), a bevel of two planes, which closes the groove half-way down. Where
    one plane through both faces' insets stands nearer still, it is kept: the piece stays convex.
    """
    middle = np.minimum(insets_mm.mean(axis=-2), ridge_mm)
    return np.stack([insets_mm[..., 0, :], middle, insets_mm[..., 1, :]], axis=-2)


def ridges(members: Members, class_lengths: Floats, scale: float, clearance_mm: float) -> Floats:
    """(k, 3): how far the sides of each class stand back from the hinge axis at mid-height, in mm.

    Half the clearance, and as far as the mesh's edge lies inside that of a member.
    """
    far = np.zeros((len(class_lengths), 3))
    np.maximum.at(far, members.face_class, scale * members.far)
    return _shared(far[:, None], class_lengths)[:, 0] + clearance_mm / 2


def bevel_insets(bends_degrees: tuple[float, float], thickness_mm: float, swing_degrees: float) -> Floats:
    """(2, 1): insets at the inner and outer face that serve every bend between a concave and a convex one, in mm.

    They depend on no mesh, so that pieces of the same lengths are the same for every shape.
    """
    concave, convex = np.tan(np.radians(np.add(bends_degrees, swing_degrees)) / 2)
    return thickness_mm / 2 * np.array([[convex], [concave]])


def require_bends(mesh_mm: TriMesh, spec: KitSpec) -> None:
    """Check that no joint of M_f, in mm, bends beyond what every piece is bevelled for, if that is given.

    Raises:
        FitError: one does; names the worst joint, its place and its angle, and how many there are.
    """
    if spec.bevel_degrees is None:
        return
    concave, convex = spec.bevel_degrees
    bend = np.degrees(bend_radians(mesh_mm))
    beyond = np.maximum(bend - convex, -concave - bend)
    worst, count = int(beyond.argmax()), int((beyond > SAME_BEND_DEGREES).sum())
    if not count:
        return
    (a, b), (v, w) = mesh_mm.edge_faces[worst].tolist(), mesh_mm.edges[worst].tolist()
    x, y, z = mesh_mm.vertices[[v, w]].mean(axis=0)
    others = f"; {count - 1} more joints do" if count > 1 else ""
    wider = ",".join(f"{ceil(max(limit, most)):g}" for limit, most in ((concave, -bend.min()), (convex, bend.max())))
    raise FitError(
        f"the joint of faces {a} and {b}, at ({x:.1f}, {y:.1f}, {z:.1f}) mm, bends by {abs(bend[worst]):.1f}° "
        f"({'convex' if bend[worst] > 0 else 'concave'}), more than every piece is bevelled for{others}",
        wanted=f"bends from {concave:g}° concave to {convex:g}° convex",
        found=f"{max(0.0, -bend.min()):.1f}° concave and {max(0.0, bend.max()):.1f}° convex at most",
        remedy=f"more --faces, another --seed, or other pieces for wider bends (--bevel-degrees {wider})",
    )


def limited(insets_mm: Floats, ridge_mm: Floats, deepest_mm: float, hold_share: float) -> Floats:
    """Insets (k, 2, 3) at the faces cut down to what leaves the connector its hold.

    `hold_share` is the part of half the thickness that the connector takes up: within it the bevel, which runs from
    the ridge (k, 3) at mid-height to the face, stands back by no more than `deepest_mm`.
    """
    ridge = ridge_mm[:, None, :]
    return np.minimum(insets_mm, ridge + (deepest_mm - ridge) / hold_share)
