from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from drkid.class_triangle import equal_sides, laid_down, symmetries
from drkid.curved_patch import barycentric_grid, side_points
from drkid.kit import Decomposition, Outcome
from drkid.mesh import TriMesh
from drkid.patches.canonical_fit import FIT_LEVELS, canonical_fit, gaps, joint_curves, readings, target_of
from drkid.patches.canonical_patch import BUBBLES, CanonicalPatch, length_groups, symmetric_bubbles
from drkid.patches.laid_faces import laid_faces
from drkid.patches.smoothness import assembled, joints

SHARES = np.linspace(0, 1, 9)
side = st.floats(0.8, 1.3)


SMOOTHNESS = 0.005


def decomposition(mesh: TriMesh) -> Decomposition:
    """Every face a class of its own lengths: what canonical patches need of it, not what a kit does."""
    lengths = np.sort(mesh.side_lengths, axis=1)
    own, label = np.unique(np.round(lengths, 1), axis=0, return_inverse=True)
    means = np.stack([lengths[label.ravel() == k].mean(axis=0) for k in range(len(own))])
    errors = np.linalg.norm(lengths - means[label.ravel()], axis=1)
    return Decomposition(mesh, label.ravel(), means, errors, 0, (), Outcome("converged", ""))


@pytest.fixture(scope="module")
def fitted(pebble, potato):
    laid = laid_faces(decomposition(pebble))
    return laid, fit_of(laid, potato, pebble.mean_edge).patches


def fit_of(laid, surface, mean_edge: float):
    curve = length_groups(laid.class_lengths, 3)
    return canonical_fit(laid, curve, target_of(laid, surface, SMOOTHNESS, 0.05 * mean_edge))


def patch_of(lengths, seed: int) -> CanonicalPatch:
    rng = np.random.default_rng(seed)
    basis = symmetric_bubbles(lengths, equal_sides(lengths))
    return CanonicalPatch(lengths, 0.1 * lengths**2, np.full(3, 0.2), basis @ rng.normal(size=basis.shape[1]))


@given(st.sampled_from([(1.0, 1.0, 1.2), (1.0, 1.2, 1.2), (1.0, 1.0, 1.0), (0.9, 1.0, 1.2)]), st.integers(0, 99))
def test_a_patch_has_every_symmetry_of_its_class(sides, seed) -> None:
    lengths = np.array(sides)
    patch = patch_of(lengths, seed).surface
    b = np.random.default_rng(seed).dirichlet(np.ones(3), 7)
    for permutation, matrix in symmetries(lengths):
        image = np.empty_like(b)
        image[:, list(permutation)] = b
        points = patch.points(b)
        points[:, :2] = points[:, :2] @ matrix.T
        assert patch.points(image) == pytest.approx(points, abs=1e-9)


@given(side, side, st.integers(0, 99))
def test_two_sides_of_one_length_have_the_same_curve(a, b, seed) -> None:
    """Seen from the side itself: along, outwards and up."""
    first, second = (np.sort(x) for x in (np.array([1.0, a, 1.25]), np.array([1.0, b, 1.15])))
    curves = []
    for lengths in (first, second):
        patch, flat = patch_of(lengths, seed), laid_down(lengths)
        i = int(np.argmin(np.abs(lengths - 1.0)))
        along = (flat[(i + 1) % 3] - flat[i]) / lengths[i]
        frame = np.array([[*along, 0], [along[1], -along[0], 0], [0, 0, 1]])
        points = patch.surface.points(side_points(i, SHARES)) - [*flat[i], 0]
        curves.append(points @ frame.T)
    assert curves[0] == pytest.approx(curves[1], abs=1e-9)


def test_bubbles_vanish_on_the_sides() -> None:
    for i in range(3):
        b = side_points(i, SHARES)
        assert (np.prod(b[:, None] ** BUBBLES, axis=2) == 0).all()


def test_groups_of_lengths_are_few_or_one() -> None:
    two = np.array([[1.0, 1.0, 1.2], [1.0, 1.2, 1.2]])
    assert length_groups(two, 3).tolist() == [[0, 0, 1], [0, 1, 1]]
    assert length_groups(np.array([[1.0, 1.1, 1.2], [1.3, 1.4, 1.5]]), 3).tolist() == [[0] * 3, [0] * 3]


def test_a_sphere_becomes_smoother_and_closer(pebble, fitted, potato) -> None:
    laid, patches = fitted
    shapes = tuple(p.surface for p in patches)
    found = joints(laid, shapes)
    assert found.break_degrees.mean() < 0.8 * np.abs(np.degrees(laid.bend_radians)).mean()
    assert np.percentile(found.gap, 95) <= 0.08 * pebble.mean_edge
    assert assembled(laid, shapes, 2).volume == pytest.approx(potato.volume, rel=0.06)


@settings(max_examples=8)
@given(seed=st.integers(0, 1000))
def test_rigid_motions_change_no_patch(pebble, fitted, potato, seed) -> None:
    rng = np.random.default_rng(seed)
    turn, shift = Rotation.random(rng=rng).as_matrix(), rng.normal(size=3)
    moved = decomposition(pebble.moved(pebble.vertices @ turn.T + shift))
    other = fit_of(laid_faces(moved), potato.moved(potato.vertices @ turn.T + shift), pebble.mean_edge)
    for one, two in zip(fitted[1], other.patches, strict=True):
        assert two.sagittas == pytest.approx(one.sagittas, abs=1e-5)
        assert two.bubble == pytest.approx(one.bubble, abs=1e-3 * (1 + np.abs(one.bubble).max()))


@pytest.mark.parametrize("factor", [1e-4, 1e4])
def test_the_unit_changes_nothing(pebble, fitted, potato, factor) -> None:
    scaled = decomposition(pebble.scaled(1.0))
    scaled = replace(scaled, mesh=pebble.scaled(factor), class_lengths=factor * scaled.class_lengths)
    other = fit_of(laid_faces(scaled), potato.scaled(factor), factor * pebble.mean_edge)
    for one, two in zip(fitted[1], other.patches, strict=True):
        assert two.sagittas / factor == pytest.approx(one.sagittas, abs=1e-6)
        assert two.bubble / factor == pytest.approx(one.bubble, abs=1e-3 * (1 + np.abs(one.bubble).max()))


def test_readings_of_a_plane_are_its_heights_and_its_slope() -> None:
    lengths = np.array([1.0, 1.1, 1.3])
    points = barycentric_grid(FIT_LEVELS).points
    height = points @ laid_down(lengths) @ [0.3, -0.2]
    found = readings(lengths) @ height
    slopes = found[len(points) :].reshape(2, -1)
    assert found[: len(points)] == pytest.approx(height)
    assert slopes[0] == pytest.approx(0.3)
    assert slopes[1] == pytest.approx(-0.2)


def test_sides_with_different_curves_are_not_mirrored() -> None:
    lengths = np.array([1.0, 1.0, 1.2])
    same, apart = (symmetric_bubbles(lengths, np.array(curves)) for curves in ((0, 0, 1), (0, 2, 1)))
    assert same.shape[1] < apart.shape[1] == len(BUBBLES)


def test_curves_beyond_the_gap_are_held_back(pebble, potato) -> None:
    laid = laid_faces(decomposition(pebble))
    curve = length_groups(laid.class_lengths, 3)
    for gap in (0.001, 0.01, 0.1):
        fit = canonical_fit(laid, curve, target_of(laid, potato, SMOOTHNESS, gap * pebble.mean_edge))
        found = gaps(laid, fit.sagittas, fit.leans)[np.arange(len(laid.joint_face)), joint_curves(laid, curve)]
        assert np.mean(found <= gap * pebble.mean_edge * (1 + 1e-6)) >= 0.95
