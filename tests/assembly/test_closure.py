import numpy as np
import pytest
from exact_shapes import icosahedron, potato
from hinged import framework_of, graph_of, triangles
from hypothesis import given, settings
from hypothesis import strategies as st

from drkid.assembly.closure import Joining, Play, joined
from drkid.mesh import TriMesh

PLAY = Play(slip_mm=0.4, rod_mm=0.3, accuracy_mm=0.1)
SIZE = 20.0  # mm that the unit of the shapes is printed at


def joining(mesh: TriMesh, change=0.0, play: Play = PLAY) -> Joining:
    graph = graph_of(mesh)
    return joined(
        framework_of(mesh, change),
        tuple(triangles(mesh, change)),
        tuple(mesh.corners),
        np.arange(len(mesh.faces)),
        3 * np.zeros_like(graph.pieces) + graph.sides,
        play,
    )


def test_an_exact_kit_closes_where_it_belongs() -> None:
    closure = joining(icosahedron().scaled(SIZE)).closure
    assert closure.verdict == "closes"
    assert closure.gaps.max_mm < 1e-9
    assert closure.drift.max_mm < 1e-6
    assert closure.budget.gap_mm < 1e-9
    assert closure.budget.reserve_mm == pytest.approx(0.7 - closure.budget.scatter_mm)


def test_one_piece_of_a_wrong_length_does_not_close() -> None:
    mesh = icosahedron().scaled(SIZE)
    change = np.zeros((20, 3))
    change[7, 0] = 6.0
    found = joining(mesh, change)
    assert found.closure.verdict == "does not close"
    assert 7 in found.closure.budget.joint
    assert found.closure.gaps.max_mm > 0.8
    assert found.closure.budget.reserve_mm < 0


@pytest.mark.parametrize(("slip", "verdict"), [(1.0, "closes"), (0.6, "closes with strain"), (0.4, "does not close")])
def test_the_verdict_goes_by_the_largest_gap(slip, verdict) -> None:
    mesh = icosahedron().scaled(SIZE)
    change = np.zeros((20, 3))
    change[7, 0] = 3.0
    largest = joining(mesh, change).closure.gaps.max_mm
    found = joining(mesh, change, Play(slip * largest, 0.0, 0.1)).closure
    assert found.verdict == verdict
    assert found.play_mm == pytest.approx(slip * largest)


def test_without_clearance_only_an_exact_kit_closes() -> None:
    tight = Play(0.0, 0.0, 0.1)
    mesh = icosahedron().scaled(SIZE)
    assert joining(mesh, play=tight).closure.verdict == "closes"
    change = np.zeros((20, 3))
    change[7, 0] = 0.5
    assert joining(mesh, change, tight).closure.verdict == "does not close"


@pytest.mark.parametrize("seed", range(2))
def test_gaps_and_drift_grow_with_the_class_error(seed) -> None:
    mesh = potato(seed).scaled(SIZE)
    error = np.random.default_rng(seed).standard_normal((len(mesh.faces), 3))
    found = [joining(mesh, size * error).closure for size in (0.002, 0.02, 0.1)]
    for measure in (lambda c: c.gaps.mean_mm, lambda c: c.drift.mean_mm, lambda c: c.chain.max_mm):
        values = [measure(closure) for closure in found]
        assert values == sorted(values)
        assert values[0] > 0


@settings(max_examples=5, deadline=None)
@given(seed=st.integers(0, 20))
def test_numbering_does_not_matter(seed) -> None:
    rng = np.random.default_rng(seed)
    mesh = potato(seed).scaled(SIZE)
    error = 0.05 * rng.standard_normal((len(mesh.faces), 3))
    faces, vertices = rng.permutation(len(mesh.faces)), rng.permutation(len(mesh.vertices))
    other = TriMesh(mesh.vertices[np.argsort(vertices)], vertices[mesh.faces[faces]])
    one, two = joining(mesh, error).closure, joining(other, error[faces]).closure
    assert two.verdict == one.verdict
    assert two.gaps.mean_mm == pytest.approx(one.gaps.mean_mm, rel=1e-3)
    assert two.gaps.max_mm == pytest.approx(one.gaps.max_mm, rel=1e-2)
    assert two.drift.mean_mm == pytest.approx(one.drift.mean_mm, rel=1e-2)
    assert two.budget.scatter_mm == pytest.approx(one.budget.scatter_mm, rel=0.05)
