import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_linearisation import plain_linearised
from scipy.sparse import csc_array
from scipy.spatial.transform import Rotation

from drkid.congruence import levenberg_marquardt, newton
from drkid.congruence.framework import BETA, Framework
from drkid.congruence.rigidity import rigidity_matrix
from drkid.congruence.sparse_solve import (
    factorised,
    sparse_exact,
    sparse_jacobian,
    sparse_linearised,
    sparse_merit,
    sparse_smoothness,
    sparse_solve,
)
from drkid.congruence.target import Target, smoothness


@pytest.fixture(scope="module")
def frame(potato) -> Framework:
    """The potato, shaken so that nothing is symmetric, its edges labelled by the nearer of two lengths."""
    noise = np.random.default_rng(0).normal(size=potato.vertices.shape)
    mesh = potato.moved(potato.vertices + 0.1 * potato.mean_edge * noise)
    lengths = mesh.mean_edge * np.array([0.9, 1.1])
    return Framework(mesh, np.abs(mesh.edge_lengths[:, None] - lengths).argmin(axis=1), lengths)


@pytest.fixture(scope="module")
def target(potato) -> Target:
    return Target(potato)


def test_the_matrices_are_the_dense_ones(frame, target):
    np.testing.assert_allclose(sparse_smoothness(frame.mesh).toarray(), smoothness(frame.mesh, BETA), atol=1e-14)
    np.testing.assert_array_equal(
        sparse_jacobian(frame).toarray(), rigidity_matrix(frame.mesh.vertices, frame.mesh.edges)
    )
    ours = sparse_linearised(frame, target, 0.3, sparse_smoothness(frame.mesh))
    theirs = plain_linearised(frame, target, 0.3)
    np.testing.assert_allclose(ours.hessian.toarray(), theirs.hessian, atol=1e-13)
    np.testing.assert_allclose(ours.gradient, theirs.gradient, atol=1e-13)
    assert ours.merit == pytest.approx(theirs.merit, rel=1e-12)


@pytest.mark.parametrize("freedom", ["all", "scale"])
@pytest.mark.parametrize("weight", [0.3, 0.05])
def test_levenberg_marquardt_does_what_the_dense_one_does(frame, target, freedom, weight):
    ours, value = sparse_solve(frame, target, weight, freedom, 3)
    theirs, other = levenberg_marquardt.solve(frame, target, weight, freedom, 3)
    np.testing.assert_allclose(ours.mesh.vertices, theirs.mesh.vertices, atol=1e-9)
    np.testing.assert_allclose(ours.lengths, theirs.lengths, atol=1e-10)
    assert value == pytest.approx(other, rel=1e-9)


def test_the_palette_stays_where_it_is_held(frame, target):
    ours, _ = sparse_solve(frame, target, 0.1, "none", 2)
    np.testing.assert_array_equal(ours.lengths, frame.lengths)
    scaled, _ = sparse_solve(frame, target, 0.1, "scale", 2)
    assert scaled.lengths[1] / scaled.lengths[0] == pytest.approx(frame.lengths[1] / frame.lengths[0], rel=1e-12)


@settings(max_examples=15)
@given(weight=st.sampled_from([0.5, 0.1, 0.02]), seed=st.integers(0, 50))
def test_the_merit_never_rises_and_is_that_of_the_result(frame, target, weight, seed):
    labels = np.random.default_rng(seed).integers(0, 2, len(frame.labels))
    begun = Framework(frame.mesh, labels, frame.lengths)
    stiffness = sparse_smoothness(frame.mesh)
    before = sparse_merit(begun, target.offsets(begun.mesh.vertices)[0], stiffness, weight)
    found, value = sparse_solve(begun, target, weight, "all", 2)
    assert value < before
    offset, _ = target.offsets(found.mesh.vertices)
    assert value == pytest.approx(sparse_merit(found, offset, stiffness, weight), rel=1e-9)


def test_newton_is_exact_near_a_rigid_mesh_and_agrees_with_the_dense_one(frame):
    """Any lengths near a rigid mesh's own can be had: here each edge has one of its own."""
    noise = np.random.default_rng(1).normal(size=len(frame.labels))
    begun = Framework(frame.mesh, np.arange(len(noise)), frame.mesh.edge_lengths * (1 + 3e-5 * noise))
    assert begun.worst > 3e-5
    assert sparse_exact(begun, "none").worst < 1e-11
    ours, theirs = sparse_exact(begun, "scale"), newton.exact(begun, "scale")
    assert ours.worst < 1e-11
    np.testing.assert_allclose(ours.mesh.vertices, theirs.mesh.vertices, atol=1e-9)
    np.testing.assert_allclose(ours.lengths, theirs.lengths, atol=1e-10)


def test_newton_does_as_the_dense_one_with_few_lengths(frame, target):
    soft, _ = sparse_solve(frame, target, 0.05, "all", 4)
    ours, theirs = sparse_exact(soft, "all"), newton.exact(soft, "all")
    assert ours.worst <= soft.worst
    assert ours.worst == pytest.approx(theirs.worst, rel=1e-2)


def test_a_rigid_motion_changes_nothing(frame, potato):
    rotation = Rotation.from_rotvec([0.3, -1.0, 0.5]).as_matrix()
    surface, mesh = (one.moved(one.vertices @ rotation.T + np.array([1.0, 2.0, 3.0])) for one in (potato, frame.mesh))
    here, value = sparse_solve(frame, Target(potato), 0.2, "all", 2)
    there, other = sparse_solve(Framework(mesh, frame.labels, frame.lengths), Target(surface), 0.2, "all", 2)
    assert value == pytest.approx(other, rel=1e-6)
    np.testing.assert_allclose(here.lengths, there.lengths, rtol=1e-6)


def test_a_singular_matrix_and_one_that_is_not_finite_are_told():
    with pytest.raises(np.linalg.LinAlgError):
        factorised(csc_array(np.zeros((3, 3))))
    with pytest.raises(np.linalg.LinAlgError, match="finite"):
        factorised(csc_array(np.full((2, 2), np.nan)))
