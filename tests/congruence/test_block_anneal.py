from dataclasses import replace

import numpy as np
import pytest
from labelled_shapes import SOFT_WEIGHT, softly_solved

from drkid.congruence.block_anneal import (
    BETA_OF_LARGE,
    ROUNDS,
    TOLERANCE,
    Blocks,
    anneal_by_patches,
    sparse_exactly,
    sparse_hop,
    sparse_round,
)
from drkid.congruence.framework import Framework
from drkid.congruence.palette import Palette, palette_of_classes
from drkid.congruence.penalty import NEAR, largest_error
from drkid.congruence.sparse_solve import sparse_linearised, sparse_smoothness
from drkid.congruence.target import Target

WEIGHT = SOFT_WEIGHT
QUICK = Blocks(steps_per_edge=100, core=25, moving=50, packings=3)


@pytest.fixture(scope="module")
def palette() -> Palette:
    return palette_of_classes(4)


@pytest.fixture(scope="module")
def target(potato) -> Target:
    return Target(potato.scaled(1 / potato.mean_edge))


@pytest.fixture(scope="module")
def frame(target) -> Framework:
    """The potato in units of its mean edge, labelled and softly solved."""
    return softly_solved(target)


def merit(frame: Framework, target: Target) -> float:
    return sparse_linearised(frame, target, WEIGHT, sparse_smoothness(frame.mesh, BETA_OF_LARGE)).merit


def test_annealing_by_patches_lowers_the_merit_whatever_the_number_of_workers(frame, target, palette):
    merits, found = [], []
    for workers in (1, 2):
        one = anneal_by_patches(
            frame,
            target,
            palette,
            weight=WEIGHT,
            freedom="scale",
            rng=np.random.default_rng(5),
            blocks=replace(QUICK, workers=workers),
        )
        merits.append(merit(one, target))
        found.append(one)
    np.testing.assert_array_equal(found[0].labels, found[1].labels)
    np.testing.assert_allclose(found[0].mesh.vertices, found[1].mesh.vertices, atol=1e-9)
    assert merits[0] < 0.7 * merit(frame, target)


@pytest.fixture(scope="module")
def soft(frame, target, palette) -> Framework:
    rng, one = np.random.default_rng(2), frame
    for number in range(ROUNDS):
        one = sparse_round(one, number, target, palette, "all", rng, QUICK)
    return one


def test_a_start_holds_the_ratio_of_the_lengths(frame, soft):
    assert soft.lengths[1] / soft.lengths[0] == pytest.approx(frame.lengths[1] / frame.lengths[0])


def test_what_is_not_exact_ends_within_the_tolerance(soft, target, palette):
    for tolerance in (TOLERANCE, 2 * TOLERANCE):
        solved = sparse_exactly(soft, target, "all", square=False, tolerance=tolerance)
        assert largest_error(solved) <= 1.01 * NEAR * tolerance * solved.wanted.mean()
        assert palette.allowed[tuple(solved.labels[solved.mesh.face_edges].T)].all()


def test_newton_makes_a_mesh_exact_whose_labels_allow_it(soft, target):
    """Labels with a length of their own for each edge can be had exactly; without Newton the tolerance is used up."""
    easy = Framework(soft.mesh, np.arange(len(soft.labels)), soft.mesh.edge_lengths * 1.0003)
    assert sparse_exactly(easy, target, "none").worst < 1e-9
    assert sparse_exactly(easy, target, "none", square=False).worst > 1e-6


def test_a_hop_changes_labels_and_its_solution_is_within_the_tolerance_again(soft, target, palette):
    solved = sparse_exactly(soft, target, "all", square=False)
    hopped = sparse_hop(solved, target, palette, "all", np.random.default_rng(0))
    assert hopped.mesh.is_closed_manifold
    assert not np.array_equal(hopped.labels, solved.labels)
    assert palette.allowed[tuple(hopped.labels[hopped.mesh.face_edges].T)].all()
    again = sparse_exactly(hopped, target, "all", square=False)
    assert largest_error(again) <= 1.01 * NEAR * TOLERANCE * again.wanted.mean()
