import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from drkid.measure import edge_spread, hausdorff
from drkid.remesh.closest_point import ClosestPoint
from drkid.remesh.dislocation_glide import glide
from drkid.remesh.edge_collapse import collapse_to
from drkid.remesh.offset_surface import offset_surface
from drkid.remesh.polish import polished
from drkid.remesh.surface_fit import surface_fit


@pytest.fixture(scope="module")
def rough(blob):
    return collapse_to(blob, 120)


@pytest.fixture(scope="module")
def fit(blob):
    return surface_fit(ClosestPoint(blob), 120, np.random.default_rng(0))


def test_polish_betters_edges_valences_distance_and_volume(blob, rough, fit):
    found = polished(rough, fit, np.random.default_rng(0))
    assert edge_spread(found) < 0.1 < edge_spread(rough)
    assert np.isin(found.valence, (5, 6, 7)).all()
    assert (found.valence != 6).sum() < 0.6 * (rough.valence != 6).sum()
    before, after = (hausdorff(blob, m, np.random.default_rng(0), 5000) for m in (rough, found))
    assert after.mean < 0.5 * before.mean
    assert after.max < before.max
    assert abs(found.volume / blob.volume - 1) < 0.005


@settings(max_examples=10)
@given(st.integers(0, 99), st.integers(40, 150))
def test_what_polish_keeps(potato, seed, count):
    rough = collapse_to(potato, count)
    rng = np.random.default_rng(seed)
    found = polished(rough, surface_fit(ClosestPoint(potato), count, rng), rng)
    assert len(found.vertices) == len(rough.vertices)
    assert found.is_closed_manifold
    assert found.genus == rough.genus
    assert found.component_count == 1
    assert found.volume > 0


def test_handles_are_kept(ring):
    rough = collapse_to(ring, 80)
    rng = np.random.default_rng(0)
    found = polished(rough, surface_fit(ClosestPoint(ring), 80, rng), rng)
    assert found.genus == 1
    assert found.is_closed_manifold
    assert abs(found.volume / ring.volume - 1) < 0.02


@settings(max_examples=10)
@given(st.integers(0, 99), st.sampled_from([1e-3, 1.0, 1e4]))
def test_a_step_goes_with_motion_and_scale(blob, rough, seed, scale):
    turn = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    shift = np.array([1.0, -2.0, 3.0])

    def step(move):
        surface, mesh = (m.moved(move(m.vertices)) for m in (blob, rough))
        return surface_fit(ClosestPoint(surface), 120, np.random.default_rng(0)).stepped(mesh).vertices

    moved = step(lambda points: scale * (points @ turn.T + shift))
    assert np.allclose(moved, scale * (step(lambda points: points) @ turn.T + shift), atol=1e-6 * scale)


def test_glides_without_heat_only_better(rough):
    def cost(mesh):
        errors = mesh.edge_lengths / rough.mean_edge - 1
        return (errors**2).sum() + 0.01 * ((mesh.valence - 6) ** 4).sum()

    found = glide(rough, 3, 0.0, np.random.default_rng(0))
    assert cost(found) < cost(rough)
    assert found.is_closed_manifold
    assert found.euler_characteristic == rough.euler_characteristic


def test_no_sweep_changes_nothing(rough):
    found = glide(rough, 0, 1.0, np.random.default_rng(0))
    assert np.array_equal(found.faces, rough.faces)
    assert np.array_equal(found.vertices, rough.vertices)


def test_the_vertices_lie_on_the_offset_surface(rough, fit):
    found = polished(rough, fit, np.random.default_rng(0))
    offset = ClosestPoint(offset_surface(fit.closest, found))
    to_offset, to_surface = (
        np.linalg.norm(c(found.vertices)[0] - found.vertices, axis=1).mean() for c in (offset, fit.closest)
    )
    assert to_offset < 0.2 * to_surface


def test_a_mesh_on_the_surface_moves_it_nowhere(blob, rough):
    assert np.allclose(offset_surface(ClosestPoint(blob), rough).vertices, blob.vertices, atol=1e-9)
