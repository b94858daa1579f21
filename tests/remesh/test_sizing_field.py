"""Edges shorter where the surface bends more: the field itself, and the meshes that follow it."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from remeshed import check, surface_of
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from drkid.measure import edge_spread, hausdorff, sample, smallest_angle_degrees
from drkid.mesh import TriMesh
from drkid.remesh import simplify
from drkid.remesh.centroidal_voronoi import energy_and_gradient
from drkid.remesh.farthest_point import farthest_points
from drkid.remesh.sizing_field import CONTRAST, GRADATION, curvature, goals, sizing_field
from drkid.spec import KitSpec


@pytest.fixture(scope="module")
def egg() -> TriMesh:
    """An ellipsoid three times as long as wide: its tips bend three times as much as its waist."""
    sphere = trimesh.creation.icosphere(subdivisions=4)
    return TriMesh(np.asarray(sphere.vertices) * (3.0, 1.0, 1.0), np.asarray(sphere.faces))


def test_curvature_is_that_of_the_textbook(egg):
    sphere = trimesh.creation.icosphere(subdivisions=4)
    ball = TriMesh(2 * np.asarray(sphere.vertices), np.asarray(sphere.faces))
    assert np.median(curvature(ball, 0.1)) == pytest.approx(np.sqrt(2) / 2, rel=0.01)
    bend = curvature(egg, 0.02)
    waist, tip = np.abs(egg.vertices[:, 0]) < 0.05, np.abs(egg.vertices[:, 0]) > 2.999
    assert np.median(bend[waist]) == pytest.approx(np.hypot(1, 1 / 9), rel=0.02)
    assert bend[tip].max() == pytest.approx(3 * np.sqrt(2), rel=0.1)


def test_noise_averages_out(egg):
    rng = np.random.default_rng(0)
    rough = egg.moved(egg.vertices + 0.003 * rng.normal(size=egg.vertices.shape))  # a twentieth of an edge
    assert np.corrcoef(curvature(rough, 0.3), curvature(egg, 0.3))[0, 1] > 0.9
    assert np.median(curvature(rough, 0.3) / curvature(egg, 0.3)) < 1.2


@pytest.mark.parametrize("adapt", [0.25, 1.0])
def test_lengths_are_smooth_bounded_and_made_by_the_number_of_vertices(egg, adapt):
    sizing = sizing_field(egg, 200, adapt)
    a, b = sizing.length[egg.edges].T
    assert (np.abs(a - b) <= GRADATION * egg.edge_lengths * (1 + 1e-9)).all()
    assert sizing.length.max() / sizing.length.min() <= CONTRAST**adapt * (1 + 1e-9)
    mass = np.bincount(egg.faces.ravel(), np.repeat(egg.areas / 3, 3))
    assert (mass / sizing.length**2).sum() == pytest.approx(200 * np.sqrt(3) / 2, rel=0.05)
    assert np.corrcoef(sizing.length, curvature(egg, 0.1))[0, 1] < -0.8
    assert np.allclose(sizing(egg.vertices), sizing.length, rtol=1e-6)


def test_a_sharp_box_has_its_short_edges_at_its_sharp_ones(fine_box):
    sizing = sizing_field(fine_box, 100, 1.0)
    middle = np.argmin(np.linalg.norm(fine_box.vertices - fine_box.vertices.mean(axis=0) - (0, 0, 0.35), axis=1))
    corner = np.argmax(np.linalg.norm(fine_box.vertices, axis=1))
    assert sizing.length[corner] < 0.7 * sizing.length[middle]


def test_goals_keep_the_mean_edge(egg, potato):
    assert (goals(potato, None) == potato.mean_edge).all()
    mesh = simplify(surface_of(egg), KitSpec(vertices=60, newton_iterations=2)).mesh
    wanted = goals(mesh, sizing_field(egg, 60, 1.0))
    assert wanted[mesh.edges].mean() == pytest.approx(mesh.mean_edge)
    assert wanted.min() < 0.8 * wanted.max()


def test_seeds_lie_closer_where_edges_are_to_be_short(egg):
    sizing = sizing_field(egg, 150, 1.0)
    points = farthest_points(egg, 150, np.random.default_rng(0), sizing)
    apart = cKDTree(points).query(points, k=2)[0][:, 1]
    assert np.corrcoef(apart, sizing(points))[0, 1] > 0.5


@settings(max_examples=5)
@given(st.integers(0, 1000))
def test_the_gradient_with_a_density_is_that_of_finite_differences(potato, seed):
    rng = np.random.default_rng(seed)
    seeds, density = sample(potato, 12, rng), 0.2 + rng.random(len(potato.faces))
    _, gradient = energy_and_gradient(potato, seeds, density)
    way, step = rng.normal(size=seeds.shape), 1e-5
    ahead, behind = (energy_and_gradient(potato, seeds + sign * step * way, density)[0] for sign in (1, -1))
    assert (ahead - behind) / (2 * step) == pytest.approx((gradient * way).sum(), rel=1e-4, abs=1e-6)


@pytest.mark.parametrize("count", [80, 250])
def test_edges_get_shorter_where_an_ellipsoid_bends_more(egg, count):
    plain, half, full = (simplify(surface_of(egg), KitSpec(vertices=count, adapt=adapt)) for adapt in (0.0, 0.5, 1.0))
    for found in (half, full):
        check(found.mesh, egg, count)
        assert (np.diff(found.energy) <= 1e-12 * found.energy[0]).all()
        assert any("unequal on purpose (--adapt" in note for note in found.notes)
    assert plain.notes == ()
    assert edge_spread(plain.mesh) < edge_spread(half.mesh) < edge_spread(full.mesh)
    bend = curvature(egg, 0.1)
    for found, least in ((half, 0.5), (full, 0.7)):
        middles = found.mesh.vertices[found.mesh.edges].mean(axis=1)
        there = bend[cKDTree(egg.vertices).query(middles)[1]]
        assert np.corrcoef(np.log(there), np.log(found.mesh.edge_lengths))[0, 1] < -least
    far = [hausdorff(egg, found.mesh, np.random.default_rng(0), 20_000).max for found in (plain, half, full)]
    assert max(far[1:]) < far[0]
    assert smallest_angle_degrees(full.mesh) > 25


@pytest.mark.parametrize(("name", "vertices"), [("ring", 90), ("cup", 60), ("thin_ring", 100), ("box", 60)])
def test_every_kind_of_shape_can_be_adapted_to(request, name, vertices):
    mesh = request.getfixturevalue(name)
    check(simplify(surface_of(mesh), KitSpec(vertices=vertices, adapt=1.0)).mesh, mesh, vertices)


@settings(max_examples=5)
@given(st.integers(0, 99), st.sampled_from([1e-3, 1.0, 1e4]))
def test_motion_and_scale_carry_the_adapted_mesh_with_them(potato, seed, scale):
    spec = KitSpec(vertices=30, newton_iterations=3, adapt=1.0)
    turn = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    moved = TriMesh(scale * (potato.vertices @ turn.T + [1.0, 2.0, -3.0]), potato.faces)
    one, two = (simplify(surface_of(m), spec).mesh for m in (potato, moved))
    assert np.array_equal(one.faces, two.faces)
    expected = scale * (one.vertices @ turn.T + [1.0, 2.0, -3.0])
    assert np.allclose(two.vertices, expected, atol=1e-5 * scale)
