"""From volumes and meshes made hard on purpose to M_s: the right mesh, and what the user is told."""

import re

import numpy as np
import pytest
import trimesh
from handled_shapes import barred_torus, double_torus
from remeshed import check, surface_of
from voxel_shapes import ball, ellipsoid, places, ring, volume_of

from drkid.errors import SpecError
from drkid.mesh import Bools, TriMesh
from drkid.remesh import simplify
from drkid.spec import KitSpec
from drkid.surface import extract_surface

Spacing = tuple[float, float, float]


def flat_voxels() -> tuple[Bools, Spacing]:
    spacing = (1.0, 1.0, 7.0)
    return ellipsoid((60, 50, 10), (29.0, 24.0, 31.0), (25.0, 18.0, 24.0), spacing), spacing


def cut_off() -> tuple[Bools, Spacing]:
    return ball()[13:], (1.0, 1.0, 1.0)


def dumb_bell() -> tuple[Bools, Spacing]:
    """Two balls and a bridge of one voxel."""
    mask = np.zeros((60, 27, 27), bool)
    mask[:27] = mask[33:] = ball()
    mask[20:40, 13, 13] = True
    return mask, (1.0, 1.0, 1.0)


def debris_and_cavity() -> tuple[Bools, Spacing]:
    mask = np.zeros((50, 27, 27), bool)
    mask[:27] = ball() & ~ball(27, 4)
    mask[40:44, 3:7, 3:7] = True
    return mask, (1.0, 1.0, 1.0)


def nearly_closed() -> tuple[Bools, Spacing]:
    """A disk with a slit of one voxel from its rim to beyond its middle."""
    x, y, _ = np.moveaxis(places((40, 40, 14)), -1, 0)
    mask = np.hypot(x - 19.5, y - 19.5) < 17
    mask[14:, 19, :] = False
    return mask, (1.0, 1.0, 1.0)


CASES = {
    flat_voxels: (),
    cut_off: ("closed flat there",),
    dumb_bell: (),
    debris_and_cavity: ("1 of 2 taken", "1 enclosed cavity filled"),
    nearly_closed: (),
}


@pytest.mark.parametrize("make", CASES, ids=lambda make: make.__name__)
def test_volumes_come_out_as_one_sound_mesh(make):
    mask, spacing = make()
    surface = extract_surface(volume_of(mask.astype(np.uint8), spacing), KitSpec())
    for words in CASES[make]:
        assert any(words in note for note in surface.notes)
    check(simplify(surface, KitSpec(vertices=150)).mesh, surface.mesh, 150)
    solid = mask if make is not debris_and_cavity else ball()
    mean_shift = (surface.mesh.volume - solid.sum() * np.prod(spacing)) / surface.mesh.areas.sum()
    assert abs(mean_shift) < 0.1 * max(spacing)


def tube(length: float, radius: float) -> TriMesh:
    capsule = trimesh.creation.capsule(length, radius, count=[24, 24])
    return TriMesh(np.asarray(capsule.vertices), np.asarray(capsule.faces))


@pytest.mark.parametrize(("length", "vertices"), [(20.0, 40), (20.0, 150), (60.0, 120)])
def test_long_thin_tubes_stay_tubes(length, vertices):
    mesh = tube(length, 1.0)
    check(simplify(surface_of(mesh), KitSpec(vertices=vertices)).mesh, mesh, vertices)


@pytest.mark.parametrize("make", [double_torus, barred_torus])
@pytest.mark.parametrize("vertices", [60, 200])
def test_two_handles_are_kept(make, vertices):
    mesh = make()
    assert mesh.genus == 2
    check(simplify(surface_of(mesh), KitSpec(vertices=vertices)).mesh, mesh, vertices)


@pytest.mark.parametrize("vertices", [4, 5, 6, 8, 12])
def test_a_handful_of_vertices_is_still_a_closed_mesh(potato, vertices):
    found = simplify(surface_of(potato), KitSpec(vertices=vertices)).mesh
    assert len(found.vertices) == vertices
    assert found.is_closed_manifold
    assert (found.genus, found.component_count) == (0, 1)
    inscribed = 8 / (9 * np.sqrt(3)) / (4 / 3 * np.pi)  # of a ball's volume, by the regular tetrahedron
    assert inscribed * potato.volume < found.volume < 1.3 * potato.volume


def test_handles_that_are_noise_leave_a_ring_that_can_be_built():
    mask = ring()
    mask[6, 17, :] = mask[17, 6, :] = False
    kept, closed = (extract_surface(volume_of(mask), KitSpec(max_genus=most)) for most in (None, 1))
    assert (kept.mesh.genus, closed.mesh.genus) == (3, 1)
    assert sum(bool(re.match("a handle closed", note)) for note in closed.notes) == 2
    check(simplify(closed, KitSpec(vertices=100)).mesh, closed.mesh, 100)
    with pytest.raises(SpecError, match="3 handles"):
        simplify(kept, KitSpec(vertices=9))
