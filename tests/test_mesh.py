import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from drkid.mesh import TriMesh, _order, summed

TETRAHEDRON = TriMesh(
    np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float),
    np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]),
)


def two_tetrahedra_sharing_a_vertex() -> TriMesh:
    other = TETRAHEDRON.moved(-TETRAHEDRON.vertices).flipped()
    faces = np.where(other.faces == 0, 0, other.faces + 3)
    return TriMesh(np.vstack([TETRAHEDRON.vertices, other.vertices[1:]]), np.vstack([TETRAHEDRON.faces, faces]))


def test_tetrahedron_has_its_textbook_numbers():
    assert TETRAHEDRON.volume == pytest.approx(1 / 6)
    assert (len(TETRAHEDRON.edges), TETRAHEDRON.euler_characteristic, TETRAHEDRON.genus) == (6, 2, 0)
    assert TETRAHEDRON.valence.tolist() == [3, 3, 3, 3]
    assert TETRAHEDRON.is_closed_manifold
    assert TETRAHEDRON.areas.sum() == pytest.approx(1.5 + np.sqrt(3) / 2)


def test_arrays_cannot_be_written_to():
    for array in (TETRAHEDRON.vertices, TETRAHEDRON.faces, TETRAHEDRON.edges, TETRAHEDRON.face_normals):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_the_given_arrays_stay_the_callers_own():
    vertices = np.zeros((3, 3))
    TriMesh(vertices, np.array([[0, 1, 2]]))
    vertices[0] = 1
    assert vertices[0, 0] == 1


@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        (np.zeros((3, 2)), [[0, 1, 2]], "vertices must be"),
        (np.zeros((3, 3)), [[0, 1, 2, 2]], "faces must be"),
        (np.zeros((3, 3)), [[0, 1, 3]], "faces name vertices 0 to 3, there are 3"),
    ],
)
def test_malformed_arrays_are_named(vertices, faces, message):
    with pytest.raises(ValueError, match=message):
        TriMesh(vertices, np.array(faces))


def test_genus_of_a_torus_and_of_two_bodies(ring, potato):
    assert ring.genus == 1
    both = TriMesh(
        np.vstack([ring.vertices, potato.vertices]), np.vstack([ring.faces, potato.faces + len(ring.vertices)])
    )
    assert (both.component_count, both.genus) == (2, 1)


def test_open_misoriented_and_pinched_meshes_are_told_apart():
    opened = TETRAHEDRON.submesh(np.arange(3))
    assert (opened.open_edges, opened.misoriented_edges, opened.pinched_vertices) == (3, 0, 0)
    twisted = TriMesh(TETRAHEDRON.vertices, np.vstack([TETRAHEDRON.faces[:3], TETRAHEDRON.faces[3:, ::-1]]))
    assert (twisted.open_edges, twisted.misoriented_edges) == (0, 3)
    pinched = two_tetrahedra_sharing_a_vertex()
    assert (pinched.open_edges, pinched.misoriented_edges, pinched.pinched_vertices) == (0, 0, 1)
    for mesh in (opened, twisted, pinched):
        assert not mesh.is_closed_manifold


def test_edge_faces_put_first_the_face_that_runs_upwards(potato):
    for edge, (first, second) in list(zip(potato.edges.tolist(), potato.edge_faces.tolist(), strict=True))[::7]:
        assert edge in [potato.faces[first][[i, (i + 1) % 3]].tolist() for i in range(3)]
        assert edge[::-1] in [potato.faces[second][[i, (i + 1) % 3]].tolist() for i in range(3)]


def test_edge_faces_refuse_an_open_mesh():
    with pytest.raises(ValueError, match="closed"):
        _ = TETRAHEDRON.submesh(np.arange(3)).edge_faces


def test_vertex_normals_of_a_sphere_point_outwards():
    sphere = trimesh.creation.icosphere(subdivisions=3)
    mesh = TriMesh(np.asarray(sphere.vertices), np.asarray(sphere.faces))
    assert np.einsum("ij,ij->i", mesh.vertex_normals, mesh.vertices).min() > 0.999


@given(st.integers(0, 2**32 - 1), st.floats(0.01, 100))
def test_relabelling_and_scaling_change_no_topology(seed, factor):
    rng = np.random.default_rng(seed)
    order = rng.permutation(4)
    faces = np.argsort(order)[TETRAHEDRON.faces][rng.permutation(4)]
    mesh = TriMesh(TETRAHEDRON.vertices[order], faces).scaled(factor)
    assert mesh.is_closed_manifold
    assert mesh.volume == pytest.approx(factor**3 / 6)
    assert sorted(mesh.edge_lengths) == pytest.approx(sorted(TETRAHEDRON.edge_lengths * factor))


def test_flipped_looks_inwards_and_submesh_keeps_only_what_it_uses(potato):
    assert potato.flipped().volume == pytest.approx(-potato.volume)
    few = potato.submesh(np.array([3, 5]))
    assert len(few.faces) == 2
    assert len(few.vertices) <= 6
    assert few.corners == pytest.approx(potato.corners[[3, 5]])


def test_a_moved_mesh_keeps_what_is_known_of_its_topology_and_nothing_else():
    before = TETRAHEDRON.flipped().flipped()
    known = before.edge_faces, before.valence, before.genus, before.mean_edge, before.volume
    after = before.moved(2.0 * before.vertices)
    assert after.edge_faces is known[0]
    assert after.valence is known[1]
    assert (after.genus, after.mean_edge, after.volume) == pytest.approx((known[2], 2 * known[3], 8 * known[4]))
    fresh = TriMesh(after.vertices, after.faces)
    assert (fresh.edges == after.edges).all()
    assert (fresh.face_edges == after.face_edges).all()


@given(st.integers(0, 999), st.sampled_from([1, 2**60]))
def test_edges_are_the_sorted_pairs_and_sides_stand_in_their_order(seed, stride):
    """With few vertices, and with numbers so large that keys have no room for their places."""
    rng = np.random.default_rng(seed)
    faces = np.array([rng.choice(9, 3, replace=False) for _ in range(rng.integers(0, 12))]).reshape(-1, 3)
    mesh = TriMesh(np.zeros((9, 3)), faces)
    pairs, index = np.unique(np.sort(mesh.half_edges, axis=1), axis=0, return_inverse=True)
    assert np.array_equal(mesh.edges, pairs)
    assert np.array_equal(mesh.face_edges.ravel(), index.ravel())
    assert np.array_equal(mesh.sides_by_edge, np.argsort(index.ravel(), kind="stable"))
    assert mesh.used_vertices == len(np.unique(faces))
    keys = stride * rng.integers(0, 5, 40)
    assert np.array_equal(_order(keys), np.argsort(keys, kind="stable"))


def test_sums_are_added_in_the_order_given():
    rng = np.random.default_rng(0)
    index, values = rng.integers(0, 7, 500), rng.normal(size=(500, 2))
    expected = np.zeros((9, 2))
    np.add.at(expected, index, values)
    assert np.array_equal(summed(index, values, 9), expected)
