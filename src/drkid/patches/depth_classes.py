"""Depth classes: members of one triangle class that bulge alike share one canonical patch.

The boundary curves do not depend on the class, so that a deep and a shallow patch of one triangle meet any neighbour
along the same curves: only their insides differ.
"""

from dataclasses import replace

import numpy as np

from drkid.curved_patch import barycentric_grid, monomials
from drkid.kit import Decomposition
from drkid.mesh import Floats, Ints, TriMesh, read_only
from drkid.patches.canonical_fit import FIT_LEVELS, canonical_patches, heights
from drkid.patches.canonical_patch import BUBBLES, CanonicalPatch
from drkid.patches.laid_faces import LaidFaces, laid_faces

MOST_ROUNDS = 12  # of choosing patches for members and members for patches; it settles in a few


def with_depths(
    decomposition: Decomposition, surface: TriMesh, classes: int, smoothness: float, most_gap: float
) -> tuple[Decomposition, LaidFaces, tuple[CanonicalPatch, ...]]:
    """The decomposition with its classes split by depth into `classes` in all, and their canonical patches.

    Alternates, as k-means does, between the best patches for the members (`canonical_patches`) and the nearest patch
    for each member. Splits that nobody uses are dropped. Fewer classes than the triangles have are left as they are.
    """
    laid = laid_faces(decomposition)
    points = barycentric_grid(FIT_LEVELS).points
    height = heights(laid, surface, points)
    bulge = monomials(BUBBLES, points).sum(axis=1)
    depth = height @ (bulge / bulge.sum())
    split = _split(decomposition.face_class, depth, max(classes, len(decomposition.class_lengths)))
    patches: tuple[CanonicalPatch, ...] = ()
    found = laid
    for _ in range(MOST_ROUNDS):
        parent, own = np.unique(split, axis=0, return_inverse=True)
        found = replace(laid, face_class=own.ravel(), class_lengths=laid.class_lengths[parent[:, 0]])
        patches = canonical_patches(found, surface, smoothness, most_gap)
        nearest = _nearest(patches, parent[:, 0], decomposition.face_class, height, points)
        if (nearest == found.face_class).all():
            break
        split = parent[nearest]
    parent, own = np.unique(split, axis=0, return_inverse=True)
    face_class = read_only(own.ravel().astype(np.int64))
    if len(parent) != len(patches) or (face_class != found.face_class).any():
        found = replace(laid, face_class=face_class, class_lengths=laid.class_lengths[parent[:, 0]])
        patches = canonical_patches(found, surface, smoothness, most_gap)
    divided = replace(
        decomposition,
        face_class=face_class,
        class_lengths=read_only(decomposition.class_lengths[parent[:, 0]]),
    )
    return divided, found, patches


def _split(face_class: Ints, depth: Floats, classes: int) -> Ints:
    """(F, 2): class and depth of each face, ever the group with the largest spread of depth halved at its mean."""
    split = np.stack([face_class, np.zeros_like(face_class)], axis=1)
    while len(kinds := np.unique(split, axis=0)) < classes:
        members = [np.flatnonzero((split == kind).all(axis=1)) for kind in kinds]
        spread = [float(((depth[m] - depth[m].mean()) ** 2).sum()) for m in members]
        widest = int(np.argmax(spread))
        if spread[widest] <= 0:
            break
        own = members[widest]
        kind = kinds[widest]
        split[own[depth[own] > depth[own].mean()], 1] = kinds[kinds[:, 0] == kind[0], 1].max() + 1
    return split


def _nearest(
    patches: tuple[CanonicalPatch, ...], parent: Ints, face_class: Ints, height: Floats, points: Floats
) -> Ints:
    """(F,): the patch of its own triangle that lies nearest to the surface over each face."""
    shape = np.stack([p.surface.points(points)[:, 2] for p in patches])
    distance = ((height[:, None] - shape[None]) ** 2).sum(axis=2)
    distance[parent[None] != face_class[:, None]] = np.inf
    return distance.argmin(axis=1).astype(np.int64)
