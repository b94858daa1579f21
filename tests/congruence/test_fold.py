import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drkid.congruence.fold import (
    FAST_WEIGHT,
    SLOW,
    fast_model,
    mode_price,
    relabellings,
    repair,
    slow_modes,
)
from drkid.congruence.framework import Framework
from drkid.congruence.hop import Problem, start
from drkid.congruence.labelling import nearest_labels, repaired
from drkid.congruence.palette import palette_of_classes
from drkid.congruence.rigidity import rigidity_matrix
from drkid.congruence.sparse_solve import sparse_exact, sparse_linearised, sparse_smoothness, sparse_solve
from drkid.congruence.target import Target
from drkid.mesh import TriMesh

sizes = st.floats(0.01, 1.0)


@pytest.fixture(scope="module")
def small() -> TriMesh:
    """A smooth closed surface of 80 faces in units of its mean edge."""
    from exact_shapes import potato  # noqa: PLC0415

    mesh = potato(1, 0.02)
    return mesh.scaled(1 / mesh.mean_edge)


@pytest.fixture(scope="module")
def soft(small) -> Framework:
    """Annealed and softly solved."""
    palette, rng = palette_of_classes(4), np.random.default_rng(0)
    lengths = np.array([0.93, 1.08])
    labels = repaired(small, nearest_labels(small, lengths), palette, lengths, rng)
    assert labels is not None
    problem = Problem(Target(small), palette, "all", True)
    return sparse_solve(start(Framework(small, labels, lengths), problem, rng), problem.target, 0.02)[0]


@given(misfit=st.floats(-0.2, 0.2), value=sizes, curvature=st.floats(-2, 2), stiffness=sizes, weight=sizes)
def test_a_mode_costs_no_less_than_its_optimum_and_no_more_than_to_stay(misfit, value, curvature, stiffness, weight):
    """The closed form takes either end of the trade between offset and misfit: it bounds the optimum from above."""
    price = mode_price(misfit, value, curvature, stiffness, weight)
    shift = np.linspace(-20, 20, 20001)
    cost = ((misfit - value * shift - curvature * shift**2) / weight) ** 2 + stiffness * shift**2
    assert cost.min() <= price * (1 + 1e-6) + 1e-4
    assert price <= (misfit / weight) ** 2 + 1e-12


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


def test_repair_keeps_the_faces_allowed_and_makes_the_mesh_no_less_exact(soft, small):
    palette = palette_of_classes(4)
    before = sparse_exact(soft)
    found = repair(soft, Target(small), palette, np.random.default_rng(0), time.monotonic() + 5)
    assert found.worst <= before.worst
    assert palette.allowed[tuple(found.labels[found.mesh.face_edges].T)].all()
    np.testing.assert_array_equal(found.mesh.faces, soft.mesh.faces)


def test_without_time_it_returns_what_came(soft, small):
    found = repair(soft, Target(small), palette_of_classes(4), np.random.default_rng(0), time.monotonic())
    assert found is soft
