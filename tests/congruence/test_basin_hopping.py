from dataclasses import replace

import numpy as np
import pytest

from drkid.congruence.basin_hopping import EXACT, UNIT_ERROR, hopped, judged, stays_or_goes
from drkid.congruence.framework import Framework
from drkid.congruence.hop import Problem, exactly, start
from drkid.congruence.palette import palette_of_classes
from drkid.congruence.palette_solver import first_frame
from drkid.congruence.score import Yardstick
from drkid.congruence.target import Target
from drkid.spec import KitSpec


@pytest.fixture(scope="module")
def yardstick(pebble):
    return Yardstick(pebble.scaled(1 / pebble.mean_edge), KitSpec())


@pytest.fixture(scope="module")
def problem(yardstick) -> Problem:
    return Problem(Target(yardstick.reference), palette_of_classes(2), "all", True)


@pytest.fixture(scope="module")
def found(yardstick, problem):
    rng = np.random.default_rng(0)
    return judged(
        exactly(start(first_frame(yardstick.reference, problem.palette, 0, rng), problem, rng), problem), yardstick
    )


def own_lengths(mesh) -> Framework:
    return Framework(mesh, np.arange(len(mesh.edges)), mesh.edge_lengths.copy())


def test_a_mesh_that_is_not_exact_pays_for_its_largest_error(yardstick, found):
    bent = found.frame.moved(found.frame.mesh.vertices * [1.02, 1, 1], found.frame.lengths)
    here = judged(bent, yardstick)
    assert not here.exact
    assert here.score == pytest.approx(yardstick.score(here.quality) + UNIT_ERROR * bent.worst)


def test_two_lengths_that_are_nearly_one_do_not_count_as_exact(yardstick):
    frame = own_lengths(yardstick.reference)
    assert frame.worst < EXACT
    assert not judged(frame, yardstick).exact


def test_exact_meshes_come_before_others_whatever_their_score(found):
    good, bad = replace(found, exact=False, score=0.0), replace(found, exact=True, score=9.0)
    assert min(good, bad, key=lambda one: one.rank) is bad


def test_hops_lead_to_other_meshes_of_the_same_palette(problem, yardstick, found):
    seen = set()
    for seed in range(12):
        new = hopped(found, problem, yardstick, np.random.default_rng(seed))
        if new is not None:
            assert problem.palette.allowed[tuple(new.frame.labels[new.frame.mesh.face_edges].T)].all()
            assert new.frame.mesh.is_closed_manifold
            seen.add(round(new.score, 6))
    assert len(seen) > 2


def test_a_better_mesh_is_always_taken_and_a_worse_one_the_less_the_colder(found):
    rng = np.random.default_rng(0)
    better, worse = replace(found, score=found.score - 1e-6), replace(found, score=found.score + 0.1)
    assert stays_or_goes(found, None, 1.0, rng) is found
    assert stays_or_goes(found, better, 1e-9, rng) is better
    share = {t: np.mean([stays_or_goes(found, worse, t, rng) is worse for _ in range(2000)]) for t in (0.05, 0.2)}
    assert share[0.05] == pytest.approx(np.exp(-2), abs=0.03)
    assert share[0.2] == pytest.approx(np.exp(-0.5), abs=0.04)
