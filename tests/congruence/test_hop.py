from dataclasses import replace

import numpy as np
import pytest

from drkid.congruence.hop import (
    LOCAL,
    REHEATS,
    START_WEIGHTS,
    Anneal,
    Problem,
    annealed,
    edges_around,
    exactly,
    hop,
    start,
)
from drkid.congruence.palette import palette_of_classes
from drkid.congruence.palette_solver import first_frame
from drkid.congruence.quadratic_model import quadratic_model
from drkid.congruence.target import Target
from drkid.mesh import TriMesh


@pytest.fixture(scope="module")
def unit(pebble) -> TriMesh:
    return pebble.scaled(1 / pebble.mean_edge)


@pytest.fixture(scope="module")
def problem(unit) -> Problem:
    return Problem(Target(unit), palette_of_classes(2), "all", True)


@pytest.fixture(scope="module")
def soft(unit, problem):
    rng = np.random.default_rng(0)
    return start(first_frame(unit, problem.palette, 0, rng), problem, rng)


def is_allowed(frame, problem) -> bool:
    return bool(problem.palette.allowed[tuple(frame.labels[frame.mesh.face_edges].T)].all())


def test_a_start_brings_lengths_near_the_palette(unit, problem, soft):
    first = first_frame(unit, problem.palette, 0, np.random.default_rng(0))
    assert is_allowed(first, problem)
    assert is_allowed(soft, problem)
    assert soft.residual @ soft.residual < 0.05 * (first.residual @ first.residual)
    assert soft.mesh.is_closed_manifold
    assert soft.lengths[1] / soft.lengths[0] == pytest.approx(first.lengths[1] / first.lengths[0])


def test_hops_reach_exact_meshes(problem, soft):
    """Of a few hops some end with every edge at its length to machine precision."""
    frame, exact = exactly(soft, problem), 0
    for seed in range(6):
        found = hop(frame, problem, np.random.default_rng(seed))
        assert is_allowed(found, problem)
        assert found.mesh.is_closed_manifold
        if found.worst < 1e-9:
            exact += 1
            assert found.mesh.edge_lengths == pytest.approx(found.wanted, rel=1e-9)
    assert exact > 0


def test_a_local_anneal_changes_no_label_elsewhere(problem, soft):
    changed = 0
    for centre in (0, 7, 20, 33, 45):
        active = edges_around(soft, centre, 16)
        assert 16 < len(active) < len(soft.labels) / 2
        how = Anneal(0.3, 0.05, 1.0, 4000)
        found = annealed(soft, problem, how, np.random.default_rng(centre), active)
        before = {tuple(e): int(v) for e, v in zip(soft.mesh.edges.tolist(), soft.labels, strict=True)}
        inside = {tuple(soft.mesh.edges[e].tolist()) for e in active}
        for edge, label in zip(found.mesh.edges.tolist(), found.labels.tolist(), strict=True):
            if before.get(tuple(edge)) != label:
                assert tuple(edge) in inside or tuple(edge) not in before
                changed += 1
    assert changed > 0


def test_a_cold_anneal_is_made_hotter_until_something_changes(problem, soft):
    """Nine orders of magnitude too cold: not even the last attempt changes anything; three: one does."""

    def changed(heat: float) -> bool:
        found = annealed(start_again, problem, Anneal(0.3, 0.05, heat, 3000), np.random.default_rng(0))
        return bool((found.labels != start_again.labels).any() or (found.mesh.faces != start_again.mesh.faces).any())

    start_again = soft  # each anneal moves the vertices, which may make further changes worth it
    for seed in range(20):
        before = start_again
        start_again = annealed(before, problem, Anneal(0.3, 0.05, 1e-9, 60_000), np.random.default_rng(seed))
        if (start_again.labels == before.labels).all() and (start_again.mesh.faces == before.mesh.faces).all():
            break
    assert not changed(1e-9)
    assert changed(1.7 ** (1 - REHEATS))


def test_an_anneal_ends_where_its_model_is_at_rest(problem, soft):
    """The vertices that come out lie much nearer to the rest of the new labels' model than those that went in."""
    how = Anneal(0.3, 0.05, 0.5, 4000)
    found = annealed(soft, problem, how, np.random.default_rng(1))
    unmoved = replace(found, mesh=found.mesh.moved(soft.mesh.vertices))
    after, before = (quadratic_model(f, problem.target, how.weight, how.damping) for f in (found, unmoved))
    assert np.linalg.norm(after.shift) < 0.5 * np.linalg.norm(before.shift)


def test_drawn_anneals_lie_in_their_ranges():
    rng = np.random.default_rng(0)
    for _ in range(50):
        how = LOCAL.draw(rng)
        for value, (low, high) in ((how.weight, LOCAL.weight), (how.heat, LOCAL.heat), (how.damping, LOCAL.damping)):
            assert low <= value <= high
        assert LOCAL.steps[0] - 1 <= how.steps <= LOCAL.steps[1]


def test_the_model_is_stationary_where_it_says(problem, soft):
    """H y = −gradient, and the residual and coupling are those of y and H⁻¹."""
    model = quadratic_model(soft, problem.target, START_WEIGHTS[-1], 0.05)
    assert model.inverse == pytest.approx(model.inverse.T)
    assert np.linalg.eigvalsh(model.coupling).min() > -1e-9
    assert np.diag(model.coupling).max() < 1
    assert np.abs(model.residual).max() < np.abs(soft.residual).max() * 1.5
