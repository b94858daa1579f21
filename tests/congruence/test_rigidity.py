import numpy as np
import pytest
from exact_shapes import icosahedron, tetrahedron
from hypothesis import given
from hypothesis import strategies as st
from quadratic_problem import pebble, rows

from drkid.congruence.rigidity import edge_vectors, infinitesimal_motions, rigidity_matrix, self_stresses

OCTAHEDRON = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
OCTAHEDRON_EDGES = np.array([(a, b) for a in range(6) for b in range(a + 1, 6) if a // 2 != b // 2])
SEEDS = st.integers(0, 2**32 - 1)


def test_edge_vectors_are_unit_vectors_towards_the_second_vertex(potato):
    direction, length = edge_vectors(potato.vertices, potato.edges)
    np.testing.assert_allclose(length, potato.edge_lengths, rtol=1e-14)
    ends = potato.vertices[potato.edges]
    np.testing.assert_allclose(ends[:, 0] + direction * length[:, None], ends[:, 1], atol=1e-14)


@pytest.mark.parametrize("place", [0.0, np.nan])
def test_edges_without_a_direction_are_refused(place):
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [place, 0, 0]])
    for function in (edge_vectors, rigidity_matrix, infinitesimal_motions):
        with pytest.raises(np.linalg.LinAlgError, match="no length"):
            function(vertices, np.array([(0, 1), (0, 2)]))


def test_rigidity_matrix_is_written_edge_by_edge():
    mesh = pebble()
    expected, _ = rows(mesh.vertices, mesh.edges)
    np.testing.assert_allclose(rigidity_matrix(mesh.vertices, mesh.edges), expected, atol=1e-15)


@pytest.mark.parametrize("name", ["potato", "ring"])
def test_rigidity_matrix_is_the_derivative_of_the_lengths(name, request):
    mesh = request.getfixturevalue(name)
    way, step = np.random.default_rng(0).normal(size=mesh.vertices.shape), 1e-5
    ahead, behind = (mesh.moved(mesh.vertices + s * way).edge_lengths for s in (step, -step))
    numeric = (ahead - behind) / (2 * step)
    slope = rigidity_matrix(mesh.vertices, mesh.edges) @ way.ravel()
    np.testing.assert_allclose(slope, numeric, atol=1e-7)


@given(SEEDS)
def test_rigid_motions_stretch_nothing_and_scaling_stretches_by_the_length(seed):
    rng = np.random.default_rng(seed)
    mesh = pebble()
    jacobian = rigidity_matrix(mesh.vertices, mesh.edges)
    motion = rng.normal(size=3) + np.cross(rng.normal(size=3), mesh.vertices)
    np.testing.assert_allclose(jacobian @ motion.ravel(), 0, atol=1e-13)
    np.testing.assert_allclose(jacobian @ mesh.vertices.ravel(), mesh.edge_lengths, rtol=1e-12)


CONVEX = {
    "tetrahedron": (tetrahedron().vertices, tetrahedron().edges),
    "octahedron": (OCTAHEDRON, OCTAHEDRON_EDGES),
    "icosahedron": (icosahedron().vertices, icosahedron().edges),
}


@pytest.mark.parametrize("name", CONVEX)
def test_convex_deltahedra_are_rigid_and_without_self_stress(name):
    vertices, edges = CONVEX[name]
    assert len(edges) == 3 * len(vertices) - 6
    assert infinitesimal_motions(vertices, edges) == 0
    assert self_stresses(vertices, edges).shape == (0, len(edges))


@pytest.mark.parametrize("name", CONVEX)
def test_every_edge_taken_out_sets_one_motion_free(name):
    vertices, edges = CONVEX[name]
    for e in range(len(edges)):
        assert infinitesimal_motions(vertices, np.delete(edges, e, axis=0)) == 1


def test_the_edges_of_a_cube_leave_six_motions():
    corners = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    edges = np.array([(a, b) for a in range(8) for b in range(a + 1, 8) if np.abs(corners[a] - corners[b]).sum() == 1])
    assert len(edges) == 12
    assert infinitesimal_motions(corners, edges) == 6
    assert len(self_stresses(corners, edges)) == 0


@given(SEEDS)
def test_bricard_octahedra_of_the_first_kind_flex(seed):
    """Opposite vertices are turned into one another by half a turn about one axis (Bricard 1897)."""
    half = np.random.default_rng(seed).uniform(-1, 1, size=(3, 3))
    vertices = np.empty((6, 3))
    vertices[::2], vertices[1::2] = half, half * [-1, -1, 1]
    assert infinitesimal_motions(vertices, OCTAHEDRON_EDGES) >= 1
    assert len(self_stresses(vertices, OCTAHEDRON_EDGES)) == infinitesimal_motions(vertices, OCTAHEDRON_EDGES)
    generic = vertices + 0.3 * np.random.default_rng(seed + 1).normal(size=(6, 3))
    assert infinitesimal_motions(generic, OCTAHEDRON_EDGES) == 0


def test_a_flat_vertex_moves_and_stresses_the_star_around_it():
    vertices = np.vstack([OCTAHEDRON, OCTAHEDRON[[0, 2, 4]].mean(axis=0)])  # in the middle of a face
    edges = np.vstack([OCTAHEDRON_EDGES, [(0, 6), (2, 6), (4, 6)]])
    assert infinitesimal_motions(vertices, edges) == 1
    (stress,) = self_stresses(vertices, edges)
    star = np.isin(edges, [0, 2, 4, 6]).all(axis=1)
    assert np.abs(stress[star]).min() > 0.1
    np.testing.assert_allclose(stress[~star], 0, atol=1e-12)


def test_a_torus_has_six_self_stresses_that_balance_at_every_vertex(ring):
    stresses = self_stresses(ring.vertices, ring.edges)
    assert len(stresses) >= 6
    assert len(stresses) == infinitesimal_motions(ring.vertices, ring.edges) + 6  # E = 3V − 6 + 6 g
    np.testing.assert_allclose(stresses @ stresses.T, np.eye(len(stresses)), atol=1e-12)
    direction, _ = edge_vectors(ring.vertices, ring.edges)
    for stress in stresses:
        force = np.zeros(ring.vertices.shape)
        np.add.at(force, ring.edges[:, 0], stress[:, None] * direction)
        np.add.at(force, ring.edges[:, 1], -stress[:, None] * direction)
        np.testing.assert_allclose(force, 0, atol=1e-12)


def test_self_stresses_cannot_be_written_to(ring):
    with pytest.raises(ValueError, match="read-only"):
        self_stresses(ring.vertices, ring.edges)[0, 0] = 1


def test_counts_do_not_change_with_place_size_and_numbering(ring):
    rng = np.random.default_rng(3)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    order = rng.permutation(len(ring.vertices))
    renumbered = np.argsort(order)[ring.edges]
    vertices = 7.5 * (ring.vertices @ turn)[order] + 3
    assert infinitesimal_motions(vertices, renumbered) == infinitesimal_motions(ring.vertices, ring.edges)
