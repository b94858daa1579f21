from itertools import combinations

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from drkid.congruence.perfect_matching import perfect_matching
from drkid.errors import SpecError
from drkid.mesh import TriMesh


def solid(name: str) -> TriMesh:
    made = trimesh.creation.icosahedron() if name == "icosahedron" else trimesh.creation.box()
    return TriMesh(np.asarray(made.vertices), np.asarray(made.faces))


def is_perfect(mesh: TriMesh, matched) -> bool:
    return bool((matched[mesh.face_edges].sum(axis=1) == 1).all())


def best_by_trying_all(mesh: TriMesh, weights) -> float:
    """The largest total over every choice of half as many edges as faces that touches each face once."""
    count = len(mesh.faces) // 2
    choices = np.array(list(combinations(range(len(mesh.edges)), count)))
    faces = np.sort(mesh.edge_faces[choices].reshape(len(choices), -1), axis=1)
    perfect = choices[(np.diff(faces, axis=1) > 0).all(axis=1)]
    assert len(perfect) > 1
    return float(weights[perfect].sum(axis=1).max())


@pytest.mark.parametrize("name", ["potato", "ring", "pebble"])
def test_every_face_has_exactly_one_matched_edge(name, request):
    mesh = request.getfixturevalue(name)
    matched = perfect_matching(mesh.edge_faces, mesh.edge_lengths)
    assert is_perfect(mesh, matched)
    assert matched.sum() == len(mesh.faces) // 2


@given(st.integers(0, 1000))
def test_no_matching_of_a_box_weighs_more(seed):
    mesh = solid("box")
    weights = np.random.default_rng(seed).normal(size=len(mesh.edges))
    matched = perfect_matching(mesh.edge_faces, weights)
    assert is_perfect(mesh, matched)
    assert weights[matched].sum() == pytest.approx(best_by_trying_all(mesh, weights), abs=1e-4)


@given(st.integers(0, 1000), st.floats(-5, 5), st.floats(0.01, 100))
def test_shift_and_scale_of_the_weights_change_nothing(seed, shift, scale):
    mesh = solid("icosahedron")
    weights = np.random.default_rng(seed).normal(size=len(mesh.edges))
    matched = perfect_matching(mesh.edge_faces, weights)
    other = perfect_matching(mesh.edge_faces, scale * weights + shift)
    assert weights[other].sum() == pytest.approx(weights[matched].sum(), abs=1e-4)


def test_equal_weights_still_match_every_face(pebble):
    assert is_perfect(pebble, perfect_matching(pebble.edge_faces, np.zeros(len(pebble.edges))))


def test_numbering_of_the_edges_does_not_matter(pebble):
    order = np.random.default_rng(3).permutation(len(pebble.edges))
    matched = perfect_matching(pebble.edge_faces, pebble.edge_lengths)
    shuffled = perfect_matching(pebble.edge_faces[order], pebble.edge_lengths[order])
    np.testing.assert_array_equal(shuffled, matched[order])


def test_faces_around_a_bridge_cannot_be_matched():
    """A star: one face in the middle and three beside it, of which only one can have the middle one."""
    star = np.array([[0, 1], [0, 2], [0, 3]])
    with pytest.raises(SpecError, match="cannot be matched") as caught:
        perfect_matching(star, np.ones(3))
    assert caught.value.found == "1 pairs of 4 faces"
