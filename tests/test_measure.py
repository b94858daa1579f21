import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from drkid.measure import (
    bend_radians,
    dihedral,
    distance_to_surface,
    edge_spread,
    hausdorff,
    project,
    sample,
    smallest_angle_degrees,
)
from drkid.mesh import TriMesh


def mesh_of(body: trimesh.Trimesh) -> TriMesh:
    return TriMesh(np.asarray(body.vertices), np.asarray(body.faces))


ICOSAHEDRON = mesh_of(trimesh.creation.icosahedron())
CUBE = mesh_of(trimesh.creation.box((2, 2, 2)))


def test_dihedrals_of_the_icosahedron_and_the_cube():
    assert 180 - np.degrees(bend_radians(ICOSAHEDRON)) == pytest.approx(np.full(30, 138.189685), abs=1e-5)
    bends = np.degrees(bend_radians(CUBE))
    assert sorted(bends.round(6)) == pytest.approx([0] * 6 + [90] * 12)
    assert dihedral(CUBE).mean_degrees == pytest.approx(60)


def test_turning_a_surface_inside_out_makes_convex_edges_concave():
    assert bend_radians(ICOSAHEDRON.flipped()) == pytest.approx(-bend_radians(ICOSAHEDRON))
    assert dihedral(ICOSAHEDRON).concave_percent == 0
    assert dihedral(ICOSAHEDRON.flipped()).concave_percent == 100


def test_distance_to_a_cube_is_exact_inside_outside_and_at_a_corner():
    points = np.array([[0, 0, 0], [3, 0, 0], [2, 2, 2], [1, 0.3, 0.2]], float)
    assert distance_to_surface(CUBE, points) == pytest.approx([1, 2, np.sqrt(3), 0])
    closest, face = project(CUBE, points)
    assert closest[1] == pytest.approx([1, 0, 0])
    assert CUBE.face_normals[face[1]] == pytest.approx([1, 0, 0])


def test_samples_lie_on_the_surface_and_share_it_by_area():
    points = sample(CUBE, 6000, np.random.default_rng(0))
    assert distance_to_surface(CUBE, points).max() < 1e-12
    assert (points[:, 0] > 1 - 1e-9).sum() == pytest.approx(1000, abs=2)
    assert points.mean(axis=0) == pytest.approx(np.zeros(3), abs=0.03)


def test_hausdorff_of_concentric_spheres_is_the_difference_of_radii():
    sphere = mesh_of(trimesh.creation.icosphere(subdivisions=4))
    found = hausdorff(sphere, sphere.scaled(1.1), np.random.default_rng(0), 4000)
    assert (found.mean, found.max) == pytest.approx((0.1, 0.1), rel=0.02)


def test_hausdorff_is_symmetric_and_blind_to_rigid_motion(potato):
    turned = Rotation.from_rotvec([0.3, 1.1, -0.4]).as_matrix()
    coarse = potato.moved(potato.vertices * 1.03)
    one = hausdorff(potato, coarse, np.random.default_rng(1), 20_000)
    other = hausdorff(coarse, potato, np.random.default_rng(2), 20_000)
    moved = hausdorff(
        potato.moved(potato.vertices @ turned.T + 5), coarse.moved(coarse.vertices @ turned.T + 5),
        np.random.default_rng(3), 20_000,
    )  # fmt: skip
    for found in (other, moved):
        assert found.mean == pytest.approx(one.mean, rel=0.01)
        assert found.max == pytest.approx(one.max, rel=0.02)


def test_hausdorff_sees_what_only_one_direction_has(potato):
    """A spike on one surface: its tip is far from the other, nothing of the other is far from it."""
    vertices = potato.vertices.copy()
    tip = int(np.argmax(vertices[:, 0]))
    vertices[tip, 0] += 1.0
    found = hausdorff(potato.moved(vertices), potato, np.random.default_rng(0), 2000)
    assert found.max == pytest.approx(1.0, abs=0.1)
    assert found.mean < 0.1


def test_quality_of_equilateral_and_of_right_triangles():
    assert edge_spread(ICOSAHEDRON) == pytest.approx(0, abs=1e-12)
    assert smallest_angle_degrees(ICOSAHEDRON) == pytest.approx(60)
    assert smallest_angle_degrees(CUBE) == pytest.approx(45)
    assert edge_spread(CUBE) > 0.1
