import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from drkid.remesh.edge_collapse import collapse_to
from drkid.remesh.edge_flip import flip_edge, flip_towards_valence_six
from drkid.remesh.half_edge import half_edges, mesh_of


def deviation(mesh):
    return int(((mesh.valence - 6) ** 2).sum())


@given(st.integers(0, 10**6))
def test_a_flip_exchanges_one_edge_and_goes_back_in_three(potato, choice):
    edges = half_edges(potato)
    h = choice % len(edges.origin)
    flip_edge(*edges, h)
    flipped = mesh_of(edges, potato.vertices)
    assert flipped.is_closed_manifold
    assert flipped.euler_characteristic == potato.euler_characteristic
    old, new = ({tuple(e) for e in m.edges.tolist()} for m in (potato, flipped))
    assert len(old - new) == len(new - old) == 1
    assert np.array_equal(edges.origin[edges.start], np.arange(len(potato.vertices)))
    assert np.array_equal(edges.twin[edges.twin], np.arange(len(edges.origin)))
    flip_edge(*edges, h)
    assert {tuple(e) for e in mesh_of(edges, potato.vertices).edges.tolist()} == old


def test_valences_come_nearer_to_six(blob):
    rough = collapse_to(blob, 300)
    found, flips = flip_towards_valence_six(rough)
    assert flips > 0
    assert deviation(found) < deviation(rough)
    assert found.is_closed_manifold
    assert found.genus == rough.genus
    assert np.array_equal(found.vertices, rough.vertices)
    assert found.valence.min() >= min(4, rough.valence.min())
    assert found.volume > 0


def test_a_second_pass_finds_nothing(blob):
    found, _ = flip_towards_valence_six(collapse_to(blob, 300))
    again, flips = flip_towards_valence_six(found)
    assert flips == 0
    assert np.array_equal(again.faces, found.faces)


def test_sharp_edges_are_not_cut_off(fine_box):
    found, _ = flip_towards_valence_six(collapse_to(fine_box, 150))
    before = collapse_to(fine_box, 150)
    assert abs(found.volume - before.volume) < 0.02 * before.volume


@settings(max_examples=25)
@given(st.integers(30, 120))
def test_no_normal_turns_by_a_right_angle(potato, count):
    rough = collapse_to(potato, count)
    found, flips = flip_towards_valence_six(rough)
    assume(flips)
    closest = {tuple(sorted(f)): n for f, n in zip(rough.faces.tolist(), rough.face_normals, strict=True)}
    changed = [i for i, f in enumerate(found.faces.tolist()) if tuple(sorted(f)) not in closest]
    assert len(changed) >= 2
    normals = found.vertex_normals[found.faces[changed]].mean(axis=1)
    assert (np.einsum("ij,ij->i", normals, found.face_normals[changed]) > 0).all()
