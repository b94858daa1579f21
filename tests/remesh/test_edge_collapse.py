import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drkid.measure import hausdorff
from drkid.mesh import TriMesh
from drkid.remesh.edge_collapse import collapse_edge, collapse_to
from drkid.remesh.half_edge import half_edges, mesh_of


@pytest.mark.parametrize("name", ["blob", "ring", "cup", "fine_box"])
def test_a_manifold_stays_one_down_to_the_number(request, name):
    mesh = request.getfixturevalue(name)
    for count in (200, 60):
        found = collapse_to(mesh, count)
        assert len(found.vertices) == count
        assert found.is_closed_manifold
        assert found.genus == mesh.genus
        assert found.component_count == 1
        assert found.volume > 0
        assert found.valence.min() >= 3


def test_vertices_are_those_of_the_surface(blob):
    found = collapse_to(blob, 100)
    known = {tuple(v) for v in blob.vertices.round(9).tolist()}
    assert all(tuple(v) in known for v in found.vertices.round(9).tolist())


def test_the_surface_stays_near_and_flat_parts_go_first(blob, fine_box):
    rng = np.random.default_rng(0)
    assert hausdorff(blob, collapse_to(blob, 200), rng, 5000).max < 0.05 * blob.diagonal
    plate = collapse_to(fine_box, 80)
    assert plate.volume == pytest.approx(fine_box.volume, rel=0.05)


def test_a_tetrahedron_cannot_be_collapsed():
    tetrahedron = TriMesh(np.eye(4)[:, :3], np.array([[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]]))
    assert len(collapse_to(tetrahedron, 3).vertices) == 4


def test_handles_keep_as_many_vertices_as_they_need(ring):
    found = collapse_to(ring, 4)
    assert len(found.vertices) >= 7
    assert found.is_closed_manifold
    assert found.genus == 1


@settings(max_examples=10)
@given(st.floats(1e-6, 1e6), st.integers(0, 10))
def test_scale_and_place_change_no_choice(potato, scale, shift):
    plain = collapse_to(potato, 40)
    power = 2.0 ** round(np.log2(scale))  # so that nothing is rounded otherwise
    other = collapse_to(TriMesh(potato.vertices * power, potato.faces), 40)
    assert np.array_equal(plain.faces, other.faces)
    moved = collapse_to(potato.moved(potato.vertices + shift), 40)
    assert moved.is_closed_manifold
    assert moved.volume == pytest.approx(plain.volume, rel=0.1)


@given(st.integers(0, 10**6))
def test_one_collapse_keeps_the_euler_characteristic(potato, choice):
    edges = half_edges(potato)
    h = choice % len(edges.origin)
    collapse_edge(*edges, h)
    found = mesh_of(edges, potato.vertices)
    assert len(found.vertices) == len(potato.vertices) - 1
    assert len(found.faces) == len(potato.faces) - 2
    assert found.euler_characteristic == potato.euler_characteristic
    assert found.is_closed_manifold


@given(st.integers(0, 10**6))
def test_half_edges_stay_consistent_through_a_collapse(potato, choice):
    edges = half_edges(potato)
    h = choice % len(edges.origin)
    gone = edges.origin[edges.twin[h]]
    collapse_edge(*edges, h)
    left = np.flatnonzero(edges.origin >= 0)
    assert np.array_equal(edges.twin[edges.twin[left]], left)
    used = np.setdiff1d(np.arange(len(potato.vertices)), [gone])
    assert np.array_equal(edges.origin[edges.start[used]], used)
