"""Handles of meshes closed: the thin one goes, the wide one stays, and nothing else moves."""

import numpy as np
import pytest
import trimesh
from handled_shapes import MAJOR, MINOR, barred_torus, bored_torus, double_torus, torus
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from drkid.errors import InputError
from drkid.intersection import self_intersections
from drkid.mesh import TriMesh
from drkid.surface import loop_surgery
from drkid.surface.loop_surgery import MOST_REMOVED, without_mesh_handles


def sound(mesh: TriMesh, genus: int) -> None:
    assert mesh.is_closed_manifold
    assert mesh.component_count == 1
    assert mesh.genus == genus
    assert mesh.volume > 0
    assert len(self_intersections(mesh)) == 0


def unmoved(before: TriMesh, after: TriMesh) -> float:
    """The share of the area of faces that are still there, corner for corner."""
    kept = {face.tobytes() for face in before.corners} & {face.tobytes() for face in after.corners}
    return sum(trimesh.triangles.area(np.frombuffer(face).reshape(1, 3, 3))[0] for face in kept) / before.areas.sum()


def test_the_thin_bar_is_cut_and_the_wide_ring_stays():
    mesh = barred_torus()
    found, (closing,) = without_mesh_handles(mesh, 1)
    sound(found, 1)
    assert closing.way == "cut"
    np.testing.assert_allclose(closing.centre[1:], (0.4, 0.0), atol=0.1)
    assert abs(closing.centre[0]) < 1.4
    assert closing.around == pytest.approx(2 * np.pi * 0.25, rel=0.3)
    assert unmoved(mesh, found) > 1 - 1.5 * MOST_REMOVED
    assert found.volume < mesh.volume
    far = np.abs(found.vertices[:, 1] - 0.4) > 0.4
    assert set(map(bytes, found.vertices[far])) <= set(map(bytes, mesh.vertices))


def test_the_thin_bore_is_filled_flush():
    mesh = bored_torus()
    found, (closing,) = without_mesh_handles(mesh, 1)
    sound(found, 1)
    assert closing.way == "filled"
    np.testing.assert_allclose(closing.centre[:2], (MAJOR, 0.0), atol=0.1)
    plain = torus(48)
    assert found.volume == pytest.approx(plain.volume, rel=0.01)
    assert found.volume - mesh.volume > 0.8 * (plain.volume - mesh.volume)


def test_of_two_rings_the_thinner_one_is_cut():
    mesh = double_torus()
    assert mesh.genus == 2
    found, (closing,) = without_mesh_handles(mesh, 1)
    sound(found, 1)
    assert closing.way == "cut"
    assert closing.centre[0] < 0
    assert closing.around == pytest.approx(2 * np.pi * 0.45, rel=0.25)


def test_the_wide_ring_goes_last_and_only_in_part():
    found, closed = without_mesh_handles(barred_torus(), 0)
    sound(found, 0)
    assert [one.way for one in closed] == ["cut", "cut"]
    assert closed[0].around < closed[1].around
    assert closed[1].around == pytest.approx(2 * np.pi * MINOR, rel=0.2)
    assert found.areas.sum() > (1 - 3 * MOST_REMOVED) * torus().areas.sum()


def test_a_coarse_mesh_of_a_few_faces_is_closed_too():
    coarse = trimesh.creation.torus(2.0, 0.5, major_sections=5, minor_sections=3)
    mesh = TriMesh(np.asarray(coarse.vertices), np.asarray(coarse.faces))
    found, (closing,) = without_mesh_handles(mesh, 0)
    sound(found, 0)
    assert closing.around == pytest.approx(3 * np.sqrt(3) * 0.5, rel=1e-6)


def test_what_has_few_enough_handles_is_left_alone(potato, ring):
    for mesh, most in ((potato, 0), (ring, 1), (ring, 5)):
        assert without_mesh_handles(mesh, most) == (mesh, ())


@settings(max_examples=5)
@given(st.integers(0, 99), st.sampled_from([1e-3, 1.0, 1e4]))
def test_motion_and_scale_carry_the_closing_with_them(seed, scale):
    mesh, turn = barred_torus(size=28), Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    plain, (one,) = without_mesh_handles(mesh, 1)
    moved, (two,) = without_mesh_handles(mesh.moved(scale * (mesh.vertices @ turn.T + (1.0, -2.0, 3.0))), 1)
    sound(moved, 1)
    assert two.around == pytest.approx(scale * one.around, rel=0.05)
    assert moved.volume == pytest.approx(scale**3 * plain.volume, rel=0.02)


def test_caps_that_would_cut_the_surface_are_refused(ring, monkeypatch):
    monkeypatch.setattr(loop_surgery, "_cuts", lambda *_: True)
    with pytest.raises(InputError, match=r"1 of 1 handles cannot be closed.*genus 0 at most \(--max-genus\).*genus 1"):
        without_mesh_handles(ring, 0)
