from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_linearisation import across, plain_linearised, plain_offsets
from quadratic_problem import DenseProblem, assert_models_agree, dense_problem, pebble, room, small_ring

from drkid.congruence.framework import Framework
from drkid.congruence.quadratic_model import (
    compliance,
    connectivity,
    price_of_flip,
    price_of_labels,
    push,
    quadratic_model,
    stretch,
    take_flip,
    take_label,
)
from drkid.congruence.target import Target

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


def framework_near(mesh, seed):
    """A framework off the mesh, whose target is the mesh itself."""
    rng = np.random.default_rng(seed)
    vertices = mesh.vertices + 0.1 * rng.normal(size=mesh.vertices.shape)
    return Framework(mesh.moved(vertices), rng.integers(3, size=len(mesh.edges)), LENGTHS)


@pytest.mark.parametrize("make", [pebble, small_ring])
@pytest.mark.parametrize(("weight", "damping"), [(0.0, 0.3), (0.3, 0.05), (1.0, 0.01)])
def test_the_model_of_a_framework_is_that_of_plain_dense_algebra(make, weight, damping):
    frame = framework_near(make(), 3)
    target = Target(make())
    offset, normals = plain_offsets(target, frame.mesh.vertices)
    dense = DenseProblem(frame.mesh.vertices.copy(), offset, across(normals), frame.stiffness, weight, damping)
    assert_models_agree(quadratic_model(frame, target, weight, damping), dense.model(frame.mesh.edges, frame.wanted))


def test_the_model_of_a_framework_is_stationary_at_its_shift(mesh):
    """H y = −gradient, the residual is what y leaves, and inverse and coupling are symmetric."""
    frame, target = framework_near(mesh, 4), Target(mesh)
    plain, model = plain_linearised(frame, target, 0.3), quadratic_model(frame, target, 0.3, 0.05)
    hessian = plain.hessian + 0.05**2 * np.eye(len(plain.hessian))
    np.testing.assert_allclose(hessian @ model.shift, -plain.gradient, atol=1e-10)
    np.testing.assert_allclose(hessian @ model.inverse, np.eye(len(hessian)), atol=1e-9)
    np.testing.assert_array_equal(model.inverse, model.inverse.T)
    np.testing.assert_array_equal(model.coupling, model.coupling.T)
    assert np.linalg.eigvalsh(model.coupling).min() > -1e-12
    assert np.diag(model.coupling).max() < 1
    for edge, ends in enumerate(frame.mesh.edges):
        left = -frame.residual[edge] - stretch(model.shift, ends, model.direction[edge])
        assert model.residual[edge] == pytest.approx(left, abs=1e-12)


def test_a_framework_without_a_model_is_told(mesh):
    """One with an edge without length, and one that nothing holds in place."""
    frame, target = framework_near(mesh, 5), Target(mesh)
    vertices = frame.mesh.vertices.copy()
    vertices[mesh.edges[11, 0]] = vertices[mesh.edges[11, 1]]
    with pytest.raises(np.linalg.LinAlgError, match="no length"):
        quadratic_model(frame.moved(vertices, LENGTHS), target, 0.3, 0.05)
    row = np.arange(len(vertices))[:, None] * [1.0, 0.0, 0.0]
    with pytest.raises(np.linalg.LinAlgError):
        quadratic_model(frame.moved(row, LENGTHS), target, 0.0, 0.0)


def test_the_model_shares_no_array_with_the_framework(mesh):
    frame = framework_near(mesh, 6)
    model = quadratic_model(frame, Target(mesh), 0.3, 0.05)
    for name, array in zip(model._fields, model, strict=True):
        assert array.flags.writeable, name
        assert array.flags.c_contiguous, name
    assert not np.shares_memory(model.position, frame.mesh.vertices)
    assert not np.shares_memory(model.length, frame.mesh.edge_lengths)


def test_threads_make_the_same_model(mesh):
    frames, target = [framework_near(mesh, seed) for seed in range(8)], Target(mesh)
    with ThreadPoolExecutor(4) as pool:
        for frame, found in zip(frames, pool.map(lambda f: quadratic_model(f, target, 0.3, 0.05), frames), strict=True):
            for one, other in zip(found, quadratic_model(frame, target, 0.3, 0.05), strict=True):
                np.testing.assert_array_equal(one, other)


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
