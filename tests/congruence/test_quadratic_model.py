import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from quadratic_problem import assert_models_agree, dense_problem, pebble, room

from drkid.congruence.quadratic_model import (
    compliance,
    connectivity,
    price_of_flip,
    price_of_labels,
    push,
    stretch,
    take_flip,
    take_label,
)

LENGTHS = np.array([0.9, 1.0, 1.15])
SEEDS = st.integers(0, 2**32 - 1)


@pytest.fixture(scope="module")
def mesh():
    return pebble()


@pytest.fixture(scope="module")
def problem(mesh):
    return dense_problem(mesh)


@pytest.fixture(scope="module")
def labels(mesh):
    return np.random.default_rng(5).integers(3, size=len(mesh.edges))


def other_diagonal(mesh, edge):
    """The corners opposite an edge."""
    faces = mesh.faces[mesh.edge_faces[edge]]
    return faces[~np.isin(faces, mesh.edges[edge])]


def test_connectivity_is_a_writable_copy(potato):
    net = connectivity(potato)
    for name in ("faces", "face_edges", "edges", "edge_faces", "valence"):
        array = getattr(net, name)
        np.testing.assert_array_equal(array, getattr(potato, name))
        array[0] = -1
        assert (getattr(potato, name)[0] != -1).all()


def test_joined_are_the_ends_of_edges_and_no_others(potato):
    joined = connectivity(potato).joined
    assert joined.sum() == 2 * len(potato.edges)
    a, b = potato.edges.T
    assert joined[a, b].all()
    assert joined[b, a].all()


def test_compliance_and_stretch_are_products_with_the_rows(mesh, problem, labels):
    model = problem.model(mesh.edges, LENGTHS[labels])
    for a, b in np.random.default_rng(0).integers(len(mesh.edges), size=(50, 2)):
        found = compliance(model.inverse, mesh.edges[a], model.direction[a], mesh.edges[b], model.direction[b])
        assert found == pytest.approx(model.coupling[a, b], abs=1e-10)
        value = stretch(model.shift, mesh.edges[a], model.direction[a])
        assert value == pytest.approx(LENGTHS[labels[a]] - model.length[a] - model.residual[a], abs=1e-12)


def test_push_moves_the_mesh_as_one_wanted_length_more_does(mesh, problem, labels):
    wanted = LENGTHS[labels]
    model = problem.model(mesh.edges, wanted)
    push(model.inverse, model.shift, mesh.edges[7], model.direction[7], 0.3)
    wanted[7] += 0.3
    np.testing.assert_allclose(model.shift, problem.minimiser(mesh.edges, wanted), atol=1e-10)


@pytest.mark.parametrize("count", [1, 2, 3])
@settings(max_examples=30)
@given(seed=SEEDS)
def test_price_of_labels_is_the_difference_of_two_solves(mesh, problem, labels, count, seed):
    rng = np.random.default_rng(seed)
    changed = rng.choice(len(labels), count, replace=False)
    new = (labels[changed] + rng.integers(1, 3, size=count)) % 3
    price = price_of_labels(problem.model(mesh.edges, LENGTHS[labels]), LENGTHS, labels, changed, new, count)
    after = labels.copy()
    after[changed] = new
    expected = problem.minimum(mesh.edges, LENGTHS[after]) - problem.minimum(mesh.edges, LENGTHS[labels])
    assert price == pytest.approx(expected, abs=1e-11)


def test_only_the_first_edges_of_a_proposal_count(mesh, problem, labels):
    model = problem.model(mesh.edges, LENGTHS[labels])
    changed, new = np.array([3, 4, 5]), (labels[3:6] + 1) % 3
    alone = price_of_labels(model, LENGTHS, labels, changed[:1], new[:1], 1)
    assert price_of_labels(model, LENGTHS, labels, changed, new, 1) == alone
    assert price_of_labels(model, LENGTHS, labels, changed, new, 0) == 0


def test_the_model_after_many_labels_is_the_model_made_anew(mesh, problem, labels):
    rng = np.random.default_rng(1)
    model, now = problem.model(mesh.edges, LENGTHS[labels]), labels.copy()
    for edge in rng.integers(len(labels), size=300).tolist():
        new = (now[edge] + 1) % 3
        take_label(model, mesh.edges, edge, LENGTHS[new] - LENGTHS[now[edge]])
        now[edge] = new
    assert_models_agree(model, problem.model(mesh.edges, LENGTHS[now]))


def flipped(model, position, edges, edge, ends, wanted):
    """Price and take the exchange of an edge for the one between `ends`; the price."""
    move = room(model)
    along = position[ends[1]] - position[ends[0]]
    length = np.linalg.norm(along)
    move.ends[:], move.direction[:] = ends, along / length
    found = price_of_flip(
        1 - model.coupling[edge, edge],
        compliance(model.inverse, move.ends, move.direction, edges[edge], model.direction[edge]),
        compliance(model.inverse, move.ends, move.direction, move.ends, move.direction),
        model.residual[edge],
        wanted - length - stretch(model.shift, move.ends, move.direction),
    )
    take_flip(model, edges, edge, length, found, move)
    edges[edge] = ends
    return found.price


@settings(max_examples=30)
@given(seed=SEEDS)
def test_price_of_flip_is_the_difference_of_two_solves(mesh, problem, labels, seed):
    rng = np.random.default_rng(seed)
    edge, wanted = int(rng.integers(len(labels))), LENGTHS[labels]
    edges = mesh.edges.copy()
    model, before = problem.model(edges, wanted), problem.minimum(edges, wanted)
    wanted[edge] = LENGTHS[rng.integers(3)]
    price = flipped(model, mesh.vertices, edges, edge, other_diagonal(mesh, edge), wanted[edge])
    assert price == pytest.approx(problem.minimum(edges, wanted) - before, abs=1e-10)
    assert_models_agree(model, problem.model(edges, wanted))


def test_the_model_after_many_exchanges_and_labels_is_the_model_made_anew(mesh, problem, labels):
    """The algebra holds for exchanges with any pair of vertices, not for diagonals alone."""
    rng = np.random.default_rng(2)
    edges, wanted = mesh.edges.copy(), LENGTHS[labels]
    model = problem.model(edges, wanted)
    for edge in rng.permutation(len(edges))[:40].tolist():
        a, b = rng.choice(len(mesh.vertices), 2, replace=False)
        wanted[edge] = np.linalg.norm(mesh.vertices[a] - mesh.vertices[b]) + 0.1 * rng.normal()
        flipped(model, mesh.vertices, edges, edge, np.array([a, b]), wanted[edge])
        other, step = int(rng.integers(len(edges))), 0.05 * rng.normal()
        take_label(model, edges, other, step)
        wanted[other] += step
    assert_models_agree(model, problem.model(edges, wanted), 1e-7)


def test_an_edge_without_which_the_model_is_singular_is_never_flipped():
    found = price_of_flip(1e-12, 0.1, 0.5, 0.2, 0.1)
    assert found.price == np.inf
    assert found.release == found.load == 0
