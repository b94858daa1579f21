import numpy as np
import pytest
import trimesh

from drkid.kit import Decomposition, Outcome
from drkid.mesh import TriMesh
from drkid.patches.loop_subdivision import loop_patches
from drkid.patches.published_patch import curvature_space, published_patches
from drkid.patches.smoothness import assembled


def one_class(mesh: TriMesh) -> Decomposition:
    lengths = np.sort(mesh.side_lengths, axis=1)
    errors = np.linalg.norm(lengths - lengths.mean(axis=0), axis=1)
    zeros = np.zeros(len(mesh.faces), np.int64)
    return Decomposition(mesh, zeros, lengths.mean(axis=0)[None], errors, 0, (), Outcome("converged", ""))


def test_curvature_is_the_squared_distance_of_the_centres() -> None:
    flat = np.array([[[0.0, 0, 0], [1, 0, 0], [0.5, 0.75**0.5, 0]]])
    patch = np.repeat(flat.mean(axis=1)[:, None], 6, axis=1) + np.array([0, 0, 0.2])
    assert curvature_space(flat, patch, 1)[0] == pytest.approx([0.04, 1, 1, 1])
    assert curvature_space(3 * flat, 3 * patch, 1)[0] == pytest.approx([0.04, 1, 1, 1])


def test_an_icosahedron_has_one_curved_patch() -> None:
    ico = trimesh.creation.icosahedron()
    mesh = TriMesh(np.asarray(ico.vertices), np.asarray(ico.faces))
    found = published_patches(one_class(mesh), 1, 3, np.random.default_rng(0))
    assert found.threshold_percent == pytest.approx(0, abs=1e-9)
    surface = assembled(found.laid, found.shapes, 3).vertices.reshape(20, -1, 3)
    # a mean over the ways in which an equilateral patch can be laid is the patch itself here
    assert surface == pytest.approx(_ordered(loop_patches(mesh, 3), surface), abs=2e-3)


def _ordered(patches, like):
    """The points of each patch in the order in which they lie nearest to those of another."""
    apart = np.linalg.norm(patches[:, None] - like[:, :, None], axis=3)
    return np.take_along_axis(patches, apart.argmin(axis=2)[..., None], axis=1)


def test_more_classes_keep_a_smaller_threshold(pebble) -> None:
    t = [published_patches(one_class(pebble), k, 2, np.random.default_rng(0)).threshold_percent for k in (1, 6, 24)]
    assert t[0] > t[1] > t[2] > 0
