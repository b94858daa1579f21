import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from labelled_shapes import SOFT_WEIGHT, softly_solved

from drkid.congruence.framework import Framework
from drkid.congruence.palette import Palette, palette_of_classes
from drkid.congruence.patch import Patch, annealed_patch, ball, local_model, neighbours, packing, put_back
from drkid.congruence.quadratic_model import price_of_labels
from drkid.congruence.sparse_solve import sparse_linearised, sparse_smoothness
from drkid.congruence.target import Target

WEIGHT, DAMPING = SOFT_WEIGHT, 0.05


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


@pytest.fixture(scope="module")
def linearised(frame, target):
    return sparse_linearised(frame, target, WEIGHT, sparse_smoothness(frame.mesh))


def disk(frame: Framework, count: int = 50, core: int = 25, centre: int = 3) -> Patch:
    return Patch(np.array(ball(neighbours(frame.mesh), centre, count, set())), core)


def whole_energy(frame, at, moving, lengths_wanted) -> float:
    """Least value of the model when only these vertices move, by solving it."""
    freedoms = (3 * moving[:, None] + np.arange(3)).ravel()
    residual = frame.mesh.edge_lengths - lengths_wanted
    jacobian = at.jacobian.toarray()[:, freedoms]
    hessian = at.hessian.toarray()[np.ix_(freedoms, freedoms)] + DAMPING**2 * np.eye(len(freedoms))
    pull = at.gradient - at.jacobian.T @ frame.residual  # of the offsets alone
    gradient = jacobian.T @ residual + pull[freedoms]
    return float(residual @ residual - gradient @ np.linalg.solve(hessian, gradient))


@given(centre=st.integers(0, 161), count=st.integers(1, 162))
def test_a_ball_is_connected_distinct_and_of_the_size_asked(frame, centre, count):
    around = neighbours(frame.mesh)
    inside = ball(around, centre, count, set())
    assert len(set(inside)) == len(inside) == count
    assert inside[0] == centre
    assert all(set(around[v]) & set(inside[:i]) for i, v in enumerate(inside) if i)


@given(seed=st.integers(0, 1000), core=st.integers(5, 30))
@settings(max_examples=20)
def test_patches_of_a_packing_are_disjoint_and_rounds_of_them_visit_every_vertex(frame, seed, core):
    rng, visits = np.random.default_rng(seed), np.zeros(len(frame.mesh.vertices), np.int64)
    for _ in range(200):
        patches = packing(frame.mesh, core, 2 * core, visits, rng)
        moving = np.concatenate([p.moving for p in patches])
        assert len(np.unique(moving)) == len(moving)
        for p in patches:
            assert core <= len(p.moving) <= 2 * core
            visits[p.moving[:core]] += 1
        if visits.min() >= 1:
            break
    assert visits.min() >= 1


def test_the_price_of_a_relabelling_is_what_solving_the_frozen_model_again_gives(frame, linearised):
    patch = disk(frame)
    local = local_model(frame, linearised, patch, DAMPING)
    before = whole_energy(frame, linearised, patch.moving, frame.wanted)
    rng = np.random.default_rng(1)
    for _ in range(5):
        chosen = rng.choice(np.flatnonzero(local.free), 2, replace=False)
        new = 1 - local.labels[chosen]
        wanted = frame.wanted.copy()
        wanted[local.edges[chosen]] = frame.lengths[new]
        price = price_of_labels(local.model, frame.lengths, local.labels, chosen, new, 2)
        after = whole_energy(frame, linearised, patch.moving, wanted)
        assert price == pytest.approx(after - before, rel=1e-6, abs=1e-10)


def test_annealing_changes_only_the_core_and_leaves_a_sound_allowed_mesh(frame, linearised, palette):
    patch = disk(frame)
    core = set(patch.moving[: patch.core].tolist())

    def labelled(one: Framework) -> set[tuple[int, int, int]]:
        return {(int(a), int(b), int(n)) for (a, b), n in zip(one.mesh.edges, one.labels, strict=True)}

    flipped = 0
    for seed in range(4):
        local = local_model(frame, linearised, patch, DAMPING)
        annealed_patch(local, frame.lengths, palette.allowed.copy(), 30.0, 100, np.random.default_rng(seed))
        found = put_back(frame, [local])
        assert found.mesh.is_closed_manifold
        assert found.mesh.genus == 0
        assert palette.allowed[tuple(found.labels[found.mesh.face_edges].T)].all()
        changed = labelled(found) ^ labelled(frame)
        assert changed
        assert all(a in core and b in core for a, b, _ in changed)
        flipped += len(set(map(tuple, found.mesh.edges.tolist())) - set(map(tuple, frame.mesh.edges.tolist())))
    assert flipped > 0
