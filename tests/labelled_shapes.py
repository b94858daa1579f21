"""Labelled frameworks and targets that several tests of the palette solver start from."""

import numpy as np
import trimesh
from quadratic_problem import pebble

from drkid.congruence.framework import Framework
from drkid.congruence.labelling import nearest_labels, repaired
from drkid.congruence.palette import palette_of_classes
from drkid.congruence.sparse_solve import sparse_solve
from drkid.congruence.target import Target
from drkid.mesh import TriMesh

SOFT_WEIGHT = 0.4
PEBBLE_LENGTHS = np.array([0.95, 1.06])


def softly_solved(target: Target) -> Framework:
    """The target's own mesh, labelled with the nearer of two lengths in four classes, softly solved."""
    mesh, lengths = target.mesh, np.array([0.93, 1.08])
    labels = repaired(mesh, nearest_labels(mesh, lengths), palette_of_classes(4), lengths, np.random.default_rng(0))
    assert labels is not None
    return sparse_solve(Framework(mesh, labels, lengths), target, SOFT_WEIGHT, "scale", 4)[0]


def labelled_pebble() -> Framework:
    """The pebble with labels drawn at random."""
    mesh = pebble()
    return Framework(mesh, np.random.default_rng(1).integers(2, size=len(mesh.edges)), PEBBLE_LENGTHS)


def ellipsoid() -> Target:
    """A smooth ellipsoid that the pebble was roughly made on."""
    sphere = trimesh.creation.icosphere(subdivisions=4)
    size = pebble().extents / 2 / [1.3, 1.0, 0.9]
    return Target(TriMesh(sphere.vertices * [1.3, 1.0, 0.9] * size.mean(), sphere.faces))
