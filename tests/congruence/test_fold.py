import itertools
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drkid.congruence.fold import (
    FAST_WEIGHT,
    SLOW,
    descended,
    descent_from,
    fast_model,
    mode_price,
    relabellings,
    slow_modes,
)
from drkid.congruence.framework import Framework
from drkid.congruence.labelling import nearest_labels, repaired
from drkid.congruence.palette import palette_of_classes
from drkid.congruence.rigidity import rigidity_matrix
from drkid.congruence.sparse_solve import sparse_exact, sparse_linearised, sparse_smoothness, sparse_solve
from drkid.congruence.target import Target
from drkid.mesh import TriMesh

sizes = st.floats(0.01, 1.0)


def after(trials: int) -> Callable[[], bool]:
    """Over when asked so many times."""
    asked = itertools.count()
    return lambda: next(asked) >= trials


@pytest.fixture(scope="module")
def small(potato) -> TriMesh:
    """The potato in units of its mean edge."""
    return potato.scaled(1 / potato.mean_edge)


@pytest.fixture(scope="module")
def soft(small) -> Framework:
    """Labelled with the nearer of two lengths, repaired, and softly solved: full of folds."""
    lengths = np.array([0.93, 1.08])
    labels = repaired(small, nearest_labels(small, lengths), palette_of_classes(4), lengths, np.random.default_rng(0))
    assert labels is not None
    return sparse_solve(Framework(small, labels, lengths), Target(small), 0.02, "all", 10)[0]


bends = st.integers(-200, 200).filter(bool).map(lambda n: n / 100)


@given(misfit=st.floats(-0.2, 0.2), value=sizes, curvature=bends, stiffness=sizes, weight=sizes)
def test_a_mode_costs_no_less_than_its_optimum_and_no_more_than_to_stay(misfit, value, curvature, stiffness, weight):
    """The closed form takes either end of the trade between offset and misfit: it bounds the optimum from above."""
    price = mode_price(misfit, value, curvature, stiffness, weight)
    missing = np.polynomial.Polynomial([misfit, -value, -curvature])
    cost = missing**2 / weight**2 + np.polynomial.Polynomial([0, 0, stiffness])
    least = min(cost(t.real) for t in cost.deriv().roots())
    assert least * (1 - 1e-6) - 1e-12 <= price <= (misfit / weight) ** 2 + 1e-12


@given(misfit=st.floats(1e-4, 0.2), value=st.floats(0.01, 0.05), curvature=st.floats(0.1, 2))
def test_a_fold_is_one_sided(misfit, value, curvature):
    """Far on the solvable side only the shift is paid, at no weight more; on the other side the more, the closer."""
    sides = [[mode_price(sign * misfit, value, curvature, 1e-6, w) for w in (1e-3, 1e-5)] for sign in (1, -1)]
    assert sides[0][0] == pytest.approx(sides[0][1], rel=1e-9, abs=1e-5)
    missing = misfit - value**2 / (4 * curvature)
    if missing > 1e-5:
        assert sides[1][1] > 100 * sides[1][0] * 0.99
        assert sides[1][1] == pytest.approx((missing / 1e-5) ** 2, rel=1e-2)


def test_slow_modes_are_the_small_singular_values(soft, small):
    at = sparse_linearised(soft, Target(small), 0.02, sparse_smoothness(soft.mesh))
    modes = slow_modes(soft, Target(small), at)
    values = np.linalg.svd(rigidity_matrix(soft.mesh.vertices, soft.mesh.edges), compute_uv=False)
    np.testing.assert_allclose(np.sort(modes.value), np.sort(values[values < SLOW]), atol=1e-6)
    assert len(modes.value) > 0
    np.testing.assert_allclose(modes.stress.T @ modes.stress, np.eye(len(modes.value)), atol=1e-9)


def test_the_curvature_of_a_mode_is_the_second_derivative_of_the_lengths(soft, small):
    at = sparse_linearised(soft, Target(small), 0.02, sparse_smoothness(soft.mesh))
    modes = slow_modes(soft, Target(small), at)
    step = 1e-3
    for i, value in enumerate(modes.value):
        flex = (at.jacobian.T @ modes.stress[:, i] / value).reshape(-1, 3)
        ahead, behind = (soft.mesh.moved(soft.mesh.vertices + s * step * flex).edge_lengths for s in (1, -1))
        second = modes.stress[:, i] @ (ahead + behind - 2 * soft.mesh.edge_lengths) / step**2 / 2
        assert second == pytest.approx(modes.curvature[i], abs=1e-4)
        first = modes.stress[:, i] @ (ahead - behind) / (2 * step)
        assert first == pytest.approx(value, abs=1e-4)


def test_the_fast_model_sees_nothing_of_the_slow_modes_and_bends_no_further_than_rigidly(soft, small):
    at = sparse_linearised(soft, Target(small), FAST_WEIGHT, sparse_smoothness(soft.mesh))
    modes = slow_modes(soft, Target(small), at)
    fast = fast_model(soft, at, modes, FAST_WEIGHT)
    response = fast.response * FAST_WEIGHT**2
    np.testing.assert_allclose(response @ modes.stress, 0, atol=1e-9)
    values = np.linalg.eigvalsh((response + response.T) / 2)
    assert values.min() > -1e-9
    assert values.max() <= 1 + 1e-9
    np.testing.assert_allclose(fast.residual @ modes.stress, 0, atol=1e-7)


def test_relabellings_are_distinct_local_and_complete(small):
    for size in (2, 3):
        moves = relabellings(small, size)
        rows = np.column_stack([moves.edges, moves.turns])
        assert len(np.unique(rows, axis=0)) == len(rows)
        single = moves.edges[:, 1] < 0
        assert single.sum() == len(small.edges) * (size - 1)
        pairs = np.unique(moves.edges[~single], axis=0)
        # two edges of a face: 3 F of them; two across an edge: 4 E
        assert len(pairs) == 3 * len(small.faces) + 4 * len(small.edges)
        ends = small.edges[moves.edges[~single]]
        assert all(len(set(a) | set(b)) <= 4 for a, b in ends.tolist())


def test_repair_keeps_the_faces_allowed_and_makes_the_mesh_more_exact(soft, small):
    """With the ratio of the lengths held: freed, they would meet, and every face be nearly equilateral."""
    palette = palette_of_classes(4)
    held, _ = sparse_solve(Framework(small, soft.labels, np.array([0.93, 1.08])), Target(small), 0.02, "scale", 10)
    before = sparse_exact(held, "scale")
    assert before.worst > 1e-4
    found = descended(descent_from(held, "scale"), Target(small), palette, np.random.default_rng(0), 80, "scale").best
    assert found.worst < 0.8 * before.worst
    assert (found.labels != held.labels).any()
    assert palette.allowed[tuple(found.labels[found.mesh.face_edges].T)].all()
    np.testing.assert_array_equal(found.mesh.faces, soft.mesh.faces)


def test_a_repair_that_was_cut_short_goes_on_where_it_stood(soft, small):
    palette, rng = palette_of_classes(4), np.random.default_rng(0)
    descent = descent_from(soft, "scale")
    worst = [descent.best.worst]
    for _ in range(6):
        descent = descended(descent, Target(small), palette, rng, 8, "scale")
        worst.append(descent.best.worst)
    assert worst == sorted(worst, reverse=True)
    assert worst[-1] < 0.8 * worst[0]
    assert (descent.frame.labels != soft.labels).any()


def test_without_trials_it_does_what_newton_does(soft, small):
    found = descended(descent_from(soft), Target(small), palette_of_classes(4), np.random.default_rng(0), 0).best
    assert found.worst == min(soft.worst, sparse_exact(soft).worst)
    np.testing.assert_array_equal(found.labels, soft.labels)


def test_what_newton_can_solve_is_not_relabelled(small):
    near = Framework(small, np.arange(len(small.edges)), small.edge_lengths * (1 + 1e-6))
    found = descended(descent_from(near), Target(small), palette_of_classes(4), np.random.default_rng(0), 2000).best
    assert found.worst < 1e-9
    np.testing.assert_array_equal(found.labels, near.labels)
