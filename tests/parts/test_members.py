import numpy as np
import pytest
from exact_shapes import decomposed, geodesic, icosahedron, potato, sixths
from scipy.spatial.transform import Rotation

from drkid.kit import Decomposition
from drkid.mesh import TriMesh
from drkid.parts.members import members_of


def turned(decomposition: Decomposition, seed: int) -> Decomposition:
    rotation = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    mesh = decomposition.mesh.moved(decomposition.mesh.vertices @ rotation.T + [3, -1, 2])
    d = decomposition
    return Decomposition(mesh, d.face_class, d.class_lengths, d.face_errors, 0, (), d.outcome)


@pytest.mark.parametrize("mesh", [icosahedron(), geodesic(), sixths()])
def test_congruent_faces_lie_exactly_on_their_class(mesh: TriMesh) -> None:
    d = decomposed(mesh)
    found = members_of(d)
    lengths = np.take_along_axis(mesh.side_lengths, found.face_side, 1)
    assert lengths == pytest.approx(d.class_lengths[d.face_class], rel=1e-5)
    assert np.abs(found.near).max() < 1e-5
    assert np.abs(found.far).max() < 1e-5


def test_hands_are_told_by_the_cyclic_order_of_the_sides() -> None:
    mesh = sixths()
    found = members_of(decomposed(mesh))
    rank = np.argsort(np.argsort(mesh.side_lengths, axis=1), axis=1)
    clockwise = np.isin(rank @ [9, 3, 1], [2 * 3 + 1, 2 * 9 + 3, 9 + 2])  # 021, 210, 102
    assert found.left.tolist() == clockwise.tolist()
    assert found.left.sum() == 24


def test_mirror_symmetric_classes_have_no_left_faces() -> None:
    assert not members_of(decomposed(geodesic())).left.any()


@pytest.mark.parametrize("factor", [0.8, 1.1])
def test_offsets_measure_how_far_the_mesh_edge_lies_inside_the_class_side(factor) -> None:
    d = decomposed(icosahedron())
    other = Decomposition(d.mesh, d.face_class, d.class_lengths * factor, d.face_errors, 0, (), d.outcome)
    inradius = d.mesh.mean_edge / (2 * np.sqrt(3))
    for offset in (members_of(other).near, members_of(other).far):
        assert offset == pytest.approx(np.full((20, 3), (factor - 1) * inradius))


def test_offsets_of_unlike_faces_differ_along_the_side() -> None:
    found = members_of(decomposed(potato(1), 6))
    assert (found.near <= found.far).all()
    assert np.ptp(found.far - found.near) > 0.01


def test_a_rigid_motion_changes_nothing() -> None:
    d = decomposed(potato(2), 6)
    still, moved = members_of(d), members_of(turned(d, 5))
    assert (still.turn == moved.turn).all()
    assert (still.left == moved.left).all()
    for name in ("bend_radians", "near", "far", "normals"):
        assert getattr(moved, name) == pytest.approx(getattr(still, name), abs=1e-9)


def test_a_mirror_image_exchanges_hands_and_nothing_else() -> None:
    d = decomposed(sixths())
    mirrored = TriMesh(d.mesh.vertices * [-1, 1, 1], d.mesh.faces[:, ::-1])
    one = members_of(d)
    other = members_of(Decomposition(mirrored, d.face_class, d.class_lengths, d.face_errors, 0, (), d.outcome))
    assert (one.left != other.left).all()
    assert other.bend_radians == pytest.approx(one.bend_radians)
    assert other.normals == pytest.approx(one.normals, abs=1e-9)
