"""The softest mode and folds, against frameworks whose second states and barriers are known in closed form."""

import numpy as np
import pytest
import trimesh
from exact_shapes import icosahedron
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from drkid.congruence import softest_mode
from drkid.congruence.rigidity import rigidity_matrix
from drkid.congruence.softest_mode import (
    PLAY,
    REACH,
    ROUND,
    Fold,
    Mode,
    rigid_motions,
    rigidity,
    second_state,
    softest_modes,
)
from drkid.mesh import TriMesh

OCTAHEDRON_FACES = np.array(
    [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)]
)  # antipodes are 0 and 1, 2 and 3, 4 and 5


def octahedron() -> TriMesh:
    return TriMesh(np.repeat(np.eye(3), 2, axis=0) * np.tile([[1], [-1]], (3, 1)), OCTAHEDRON_FACES)


def line_symmetric_octahedron() -> TriMesh:
    """Bricard's first flexible octahedron: each vertex is its antipode, turned by half a turn about z."""
    points = np.array([[1.0, 0.2, 0.3], [0.3, 1.1, -0.4], [0.5, -0.4, 1.2]])
    return TriMesh(np.stack([points, points * [-1, -1, 1]], axis=1).reshape(-1, 3), OCTAHEDRON_FACES)


def capped(height: float) -> TriMesh:
    """The icosahedron of edge 1 with a low pyramid on one face: inside out it is a second state, 2 heights away.

    Nothing else needs to move; vertex 12 is the apex.
    """
    solid = icosahedron()
    solid = solid.scaled(1 / solid.mean_edge)
    a, b, c = solid.faces[0]
    apex = solid.corners[0].mean(axis=0) + height * solid.face_normals[0]
    faces = np.vstack([solid.faces[1:], [(a, b, 12), (b, c, 12), (c, a, 12)]])
    return TriMesh(np.vstack([solid.vertices, apex]), faces)


def cap_modes(height: float):
    """The modes of the capped icosahedron, its faces' mean edge, and by how much each one lifts the apex."""
    mesh = capped(height)
    modes = softest_modes(mesh.vertices / mesh.mean_edge, mesh.edges)
    normal, base = icosahedron().face_normals[0], icosahedron().faces[0]
    lifts = [float((m.flex[12] - m.flex[base].mean(axis=0)) @ normal) for m in modes]
    return modes, mesh.mean_edge, lifts


def play_that_passes(height: float) -> float:
    """Spokes shorter and the base's sides longer by p put the apex into the base's plane."""
    radius = 1 / np.sqrt(3)
    return (np.hypot(radius, height) - radius) / (1 + radius)


@pytest.mark.parametrize("solid", [octahedron, icosahedron])
def test_regular_solids_are_stiff(solid):
    found = rigidity(solid())
    assert found.firmness == "stiff"
    assert found.stiffness_percent > 50
    assert found.second_state_percent is None
    assert found.sway_percent < 3


def test_a_geodesic_sphere_is_as_stiff_as_lamb_says(geodesic_spheres):
    off = [abs(rigidity(sphere).stiffness_percent - 100) for sphere in geodesic_spheres]
    assert max(off) < 3


@pytest.mark.parametrize("most_dense", [0, 1000])
@pytest.mark.parametrize("name", ["pebble", "ring", "potato"])
def test_modes_are_the_least_singular_values_beside_the_rigid_motions(name, most_dense, request, monkeypatch):
    mesh = request.getfixturevalue(name)
    monkeypatch.setattr(softest_mode, "MOST_DENSE", most_dense)
    points = mesh.vertices / mesh.mean_edge
    jacobian = rigidity_matrix(points, mesh.edges)
    values = np.sort(np.linalg.svd(jacobian, compute_uv=False)[: 3 * len(points) - 6])
    modes = softest_modes(points, mesh.edges)
    np.testing.assert_allclose([m.value for m in modes], values[: len(modes)], rtol=1e-7, atol=1e-9)
    for mode in modes:
        np.testing.assert_allclose(jacobian @ mode.flex.ravel(), mode.value * mode.tension, atol=1e-9)
        np.testing.assert_allclose(rigid_motions(points).T @ mode.flex.ravel(), 0, atol=1e-9)


@pytest.mark.parametrize("name", ["pebble", "ring"])
def test_what_no_movement_takes_up_is_a_self_stress(name, request):
    mesh = request.getfixturevalue(name)
    points = mesh.vertices / mesh.mean_edge
    jacobian = rigidity_matrix(points, mesh.edges)
    rests = [m.rest for m in softest_modes(points, mesh.edges)]
    np.testing.assert_allclose(jacobian.T @ np.stack(rests, axis=1), 0, atol=1e-7)
    largest = max(float(np.linalg.norm(rest)) for rest in rests)
    assert largest > 1e-3 if mesh.genus else largest < 1e-5


def test_the_length_equation_holds_to_second_order(pebble):
    """y · (length along the mode) is σ t + S t², up to t³."""
    points = pebble.vertices / pebble.mean_edge
    unit = pebble.moved(points)
    for mode in softest_modes(points, pebble.edges):
        off = []
        for t in (0.02, 0.01):
            change = unit.moved(points + t * mode.flex).edge_lengths - unit.edge_lengths
            off.append(abs(mode.tension @ change - mode.value * t - mode.curvature * t**2))
        assert off[0] < 1e-5
        assert off[1] < 0.2 * off[0]


@pytest.mark.parametrize("height", [0.04, 0.02, 0.01])
def test_a_flat_cap_folds_half_way_to_its_second_state(height):
    modes, mean_edge, lifts = cap_modes(height)
    fold = modes[0].fold()
    assert fold is not None
    assert fold.barrier * lifts[0] * mean_edge == pytest.approx(-height, rel=10 * height**2)
    assert fold.second * lifts[0] * mean_edge == pytest.approx(-2 * height, rel=10 * height**2)


def test_the_play_at_the_barrier_converges_in_proportion_to_the_height():
    """From below: the tension that the other edges take is of the order of the height."""
    off = []
    for height in (0.04, 0.02, 0.01):
        modes, mean_edge, _ = cap_modes(height)
        fold = modes[0].fold()
        assert fold is not None
        off.append(1 - fold.play * mean_edge / play_that_passes(height))
    assert 0 < off[0] < 0.1
    assert off[1] < 0.56 * off[0]
    assert off[2] < 0.56 * off[1]


def test_newton_finds_the_cap_turned_inside_out():
    mesh, (modes, mean_edge, _) = capped(0.06), cap_modes(0.06)
    fold = modes[0].fold()
    assert fold is not None
    state = second_state(mesh.vertices / mean_edge, mesh.edges, fold)
    assert state is not None
    found, inside_out = mesh.moved(state * mean_edge), capped(-0.06)
    np.testing.assert_allclose(found.edge_lengths, mesh.edge_lengths, rtol=1e-9)
    assert found.volume == pytest.approx(inside_out.volume, rel=1e-9)
    assert found.volume < mesh.volume


@pytest.mark.parametrize(("height", "snaps"), [(0.03, False), (0.08, True), (0.3, False)])
def test_a_cap_may_snap_through_if_play_passes_and_the_eye_sees_it(height, snaps):
    mesh = capped(height)
    found = rigidity(mesh)
    assert (found.firmness == "may snap through") is snaps
    assert (found.second_state_percent is not None) is snaps
    if snaps:
        assert found.barrier_percent == pytest.approx(100 * play_that_passes(height) / mesh.mean_edge, rel=0.15)
        assert found.barrier_percent < 100 * PLAY
        assert found.second_state_percent == pytest.approx(2 * found.fold_percent, rel=0.05)


def test_a_vertex_in_a_flat_face_is_a_flex_that_second_order_stops():
    found = rigidity(capped(0.0))
    assert found.firmness == "soft"
    assert found.softest < 1e-9
    assert found.fold_percent is None
    height = np.sqrt((1 / np.sqrt(3) + PLAY) ** 2 - (1 - PLAY) ** 2 / 3)  # spokes longer, sides of the base shorter
    assert found.sway_percent / 100 == pytest.approx(height, rel=0.1)


def test_bricards_octahedron_is_stopped_by_nothing():
    mesh = line_symmetric_octahedron()
    found = rigidity(mesh)
    assert found.firmness == "soft"
    assert found.softest < 1e-9
    assert found.sway_percent == 100 * REACH
    assert rigidity(mesh.moved(mesh.vertices + 0.1 * np.eye(6, 3))).softest > 1e-3


def test_stiffness_is_the_softest_value_at_equal_faces(pebble):
    found = rigidity(pebble)
    assert found.stiffness_percent == pytest.approx(100 * found.softest * np.sqrt(len(pebble.faces)) / ROUND)


@given(st.integers(0, 2**32 - 1))
def test_place_scale_and_numbering_change_nothing(seed):
    rng = np.random.default_rng(seed)
    mesh = capped(0.08)
    order = rng.permutation(len(mesh.vertices))
    turned = mesh.vertices[order] @ Rotation.random(rng=rng).as_matrix() * rng.uniform(0.01, 100) + rng.normal(size=3)
    other = rigidity(TriMesh(turned, np.argsort(order)[rng.permutation(mesh.faces)]))
    found = rigidity(mesh)
    assert other.firmness == found.firmness
    for name in ("softest", "stiffness_percent", "sway_percent", "fold_percent", "barrier_percent"):
        assert getattr(other, name) == pytest.approx(getattr(found, name), rel=1e-6), name
    assert other.second_state_percent == pytest.approx(found.second_state_percent, rel=1e-6)


def test_it_is_the_same_every_time(potato):
    assert rigidity(potato) == rigidity(potato)


VALUES = st.floats(0.001, 1)


@given(value=VALUES, curvature=VALUES, share=st.floats(0, 0.35), sign=st.sampled_from([1.0, -1.0]))
def test_barrier_and_second_state_are_where_the_strain_is_greatest_and_least(value, curvature, share, sign):
    """Also with self-stresses, as handles have them; sizes are such that all is within reach."""
    flex = np.full((1, 3), 1e-4)
    mode = Mode(value, flex, np.array([1.0, 0.0]), sign * curvature, np.array([0.0, share * curvature]))

    def strain(t: float) -> float:
        along = value * t + mode.curvature * t**2
        return along**2 + (share * curvature * t**2) ** 2

    fold = mode.fold()
    assert fold is not None
    for t, sense in ((fold.barrier, 1), (fold.second, -1)):
        assert t * sign < 0
        assert sense * strain(t) >= max(sense * strain(0.98 * t), sense * strain(1.02 * t))
    assert abs(fold.barrier) < abs(fold.second)


def test_strong_self_stress_leaves_no_second_state():
    mode = Mode(0.1, np.full((1, 3), 0.1), np.array([1.0, 0.0]), 0.5, np.array([0.0, 0.2]))
    assert mode.fold() is None


def test_sway_is_the_movement_at_which_the_play_is_used_up(pebble):
    for mode in softest_modes(pebble.vertices / pebble.mean_edge, pebble.edges):
        sway = mode.sway(PLAY)
        shift = np.copysign(sway / mode.swing, mode.curvature)
        assert sway == REACH or mode.play(shift) == pytest.approx(PLAY)
        assert mode.sway(PLAY / 2) < sway or sway == REACH


def test_a_mesh_with_an_edge_of_no_length_is_refused():
    mesh = octahedron()
    points = mesh.vertices.copy()
    points[2] = points[0]
    with pytest.raises(np.linalg.LinAlgError, match="no length"):
        rigidity(mesh.moved(points))


def test_a_second_state_that_is_not_there_is_not_found(pebble):
    """A mode whose curvature is invented foretells a state that no lengths allow."""
    points = pebble.vertices / pebble.mean_edge
    mode = softest_modes(points, pebble.edges)[-1]
    invented = Mode(mode.value, mode.flex, mode.tension, 5 * abs(mode.curvature) + 1, np.zeros_like(mode.rest)).fold()
    assert invented is not None
    assert second_state(points, pebble.edges, invented) is None


def test_a_way_on_which_two_vertices_meet_leads_nowhere():
    mesh = octahedron()
    points = mesh.vertices / mesh.mean_edge
    flex = np.zeros((6, 3))
    flex[2] = points[0] - points[2]
    mode = Mode(1.0, flex, np.full(12, 12**-0.5), -1.0, np.zeros(12))
    assert second_state(points, mesh.edges, Fold(mode, 0.5, 1.0, PLAY)) is None


def test_lanczos_that_does_not_converge_is_reported(potato, monkeypatch):
    def never(*_args, **_options):
        raise softest_mode.ArpackNoConvergence("no convergence", np.zeros(0), np.zeros((0, 0)))

    monkeypatch.setattr(softest_mode, "eigsh", never)
    with pytest.raises(np.linalg.LinAlgError, match="no convergence"):
        rigidity(potato)


@pytest.fixture(scope="module")
def geodesic_spheres() -> list[TriMesh]:
    spheres = [trimesh.creation.icosphere(subdivisions=n) for n in (2, 3)]
    return [TriMesh(np.asarray(s.vertices), np.asarray(s.faces)) for s in spheres]
