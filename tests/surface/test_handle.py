"""Handles closed: the smallest ones, near where they are, and told."""

import re

import numpy as np
import pytest
import scipy.ndimage as ndi
from hypothesis import given, settings
from hypothesis import strategies as st
from voxel_shapes import ball, ring, volume_of

from drkid.errors import InputError
from drkid.intersection import self_intersections
from drkid.pipeline import read_surface
from drkid.spec import KitSpec
from drkid.surface import extract_surface, handle, voxel_surface
from drkid.surface.handle import without_handles
from drkid.surface.marching_cubes import grid_surface

UNIT = np.ones(3)


def bored():
    """A ball with a tunnel of one voxel through it, off its middle."""
    mask = ball()
    mask[16, 13, :] = False
    return np.pad(mask, 2)


def wired():
    """A block with a wire of one voxel from one face to the next: a handle that is better cut than filled."""
    mask = np.zeros((24, 24, 24), bool)
    mask[4:14, 4:14, 4:14] = True
    mask[9, 9, 14:20] = mask[9, 9:19, 19] = mask[9, 18, 9:20] = mask[9, 14:19, 9] = True
    return mask


def noisy_ring():
    """A wide ring with a tunnel of one voxel through its tube."""
    mask = np.pad(ring(), 2)
    mask[8, 19, :] = False
    return mask


def genus(mask):
    return grid_surface(mask)[0].genus


@pytest.mark.parametrize(("make", "way", "most_voxels"), [(bored, "filled", 2), (wired, "cut", 2)])
def test_the_smaller_of_both_ways_is_taken(make, way, most_voxels):
    mask = make()
    assert genus(mask) == 1
    found, (closing,) = without_handles(mask, 0, UNIT)
    assert genus(found) == 0
    assert (closing.way, closing.handles) == (way, 1)
    assert closing.voxels <= most_voxels
    assert closing.across <= 2
    assert ((found >= mask) if way == "filled" else (found <= mask)).all()
    assert np.linalg.norm(np.argwhere(found != mask) - closing.centre, axis=1).max() < 6


def test_the_wide_ring_is_kept_and_the_narrow_tunnel_closed():
    mask = noisy_ring()
    assert genus(mask) == 2
    found, (closing,) = without_handles(mask, 1, UNIT)
    assert genus(found) == 1
    assert closing.voxels <= 2
    np.testing.assert_allclose(closing.centre[:2], (8, 19), atol=1)
    nothing_left, both = without_handles(mask, 0, UNIT)
    assert genus(nothing_left) == 0
    assert both[1].voxels > 20
    assert both[1].way == "cut"


def test_of_three_handles_the_wide_ring_outlasts_a_bore_and_a_wire():
    mask = noisy_ring()
    mask[11:29, 22, 8] = True
    assert genus(mask) == 3
    found, closed = without_handles(mask, 1, UNIT)
    assert genus(found) == 1
    assert {one.way for one in closed} == {"filled", "cut"}
    assert all(one.voxels < 10 for one in closed)  # the ring itself takes about fifty
    assert not found[16:24, 14:19, :].any()
    assert (found != mask).sum() < 60


@settings(max_examples=4)
@given(st.permutations([0, 1, 2]), st.tuples(*[st.booleans()] * 3), st.integers(16, 27))
def test_a_band_is_cut_where_it_is_narrowest(order, mirrored, narrow):
    mask = np.zeros((44, 30, 34), bool)
    mask[4:14, 4:24, 4:14] = mask[30:40, 4:24, 4:14] = mask[4:40, 4:24, 4:8] = True
    mask[12:32, 10:17, 12] = True  # a band seven wide, one thick
    mask[narrow : narrow + 2, [10, 11, 15, 16], 12] = False  # but for one place
    mask = mask.transpose(order)[tuple(slice(None, None, -1 if flip else 1) for flip in mirrored)]
    found, (closing,) = without_handles(np.ascontiguousarray(mask), 0, UNIT)
    assert genus(found) == 0
    assert (closing.way, closing.voxels) == ("cut", 3)


def test_what_has_few_enough_handles_is_left_alone():
    for mask, most in ((np.pad(ball(), 2), 0), (noisy_ring(), 2), (noisy_ring(), 5)):
        found, closed = without_handles(mask, most, UNIT)
        assert closed == ()
        assert (found == mask).all()


@settings(max_examples=8)
@given(st.integers(0, 10_000), st.integers(0, 3))
def test_noise_comes_down_to_the_genus_asked(seed, most):
    noise = ndi.gaussian_filter(np.random.default_rng(seed).random((13, 12, 11)), 1.2)
    mask = (noise > np.quantile(noise, 0.5)).astype(np.uint8)
    surface = extract_surface(volume_of(mask), KitSpec(max_genus=most, smooth=False))
    assert surface.mesh.genus <= most
    assert surface.mesh.is_closed_manifold
    assert surface.mesh.component_count == 1
    kept = extract_surface(volume_of(mask), KitSpec(smooth=False))
    assert bool(surface.mesh.genus < kept.mesh.genus) == any("--max-genus):" in note for note in surface.notes)


@settings(max_examples=5)
@given(st.permutations([0, 1, 2]), st.tuples(*[st.booleans()] * 3), st.floats(0.01, 100), st.integers(1, 9))
def test_turns_mirrors_scale_and_label_change_nothing(order, mirrored, scale, label):
    values = noisy_ring().transpose(order)[tuple(slice(None, None, -1 if flip else 1) for flip in mirrored)]
    spec = KitSpec(max_genus=1, smooth=False)
    plain = extract_surface(volume_of(noisy_ring()), spec)
    turned = extract_surface(volume_of(values * np.uint8(label), (scale,) * 3), spec)
    assert turned.mesh.genus == plain.mesh.genus == 1
    assert turned.mesh.volume == pytest.approx(plain.mesh.volume * scale**3, rel=0.002)
    told = [re.search(r"closed \(--max-genus\): (\d+ voxels? \w+) at", note) for note in (*plain.notes, *turned.notes)]
    assert len({match[1] for match in told if match}) == 1


def test_the_place_and_size_are_told_in_the_sources_unit():
    surface = extract_surface(volume_of(bored(), (2.0, 2.0, 5.0), unit="nm"), KitSpec(max_genus=0))
    (note,) = (note for note in surface.notes if "--max-genus" in note)
    found = re.fullmatch(
        r"a handle closed \(--max-genus\): (\d+) voxels? filled at \((\S+), (\S+), (\S+)\) nm, (\S+) nm across", note
    )
    assert found is not None
    x, y, z, across = (float(found[i]) for i in (2, 3, 4, 5))
    assert (x, y) == (2 * 18, 2 * 15)
    assert 5 * 2 < z < 5 * 29
    assert across in (5, 10)
    assert int(found[1]) <= 2


def test_many_closings_are_summed_up():
    mask = np.zeros((70, 40, 8), np.uint8)
    mask[2:68, 2:38, 2:6] = 1
    mask[4:66:4, 4:36:8, :] = 0
    surface = extract_surface(volume_of(mask), KitSpec(max_genus=0))
    assert surface.mesh.genus == 0
    assert sum("a handle closed" in note for note in surface.notes) == 12
    assert any(re.match(r"52 more handles closed, with 52 voxels in all, 1 um across", note) for note in surface.notes)


def test_a_density_keeps_its_surface_away_from_the_handle():
    density = ndi.gaussian_filter(bored().astype(np.float32), 0.6)
    threshold = 0.75
    plain, closed = (
        extract_surface(volume_of(density, kind="density"), KitSpec(threshold=threshold, max_genus=most))
        for most in (None, 0)
    )
    assert (plain.mesh.genus, closed.mesh.genus) == (1, 0)
    far = [mesh.vertices[np.hypot(*(mesh.vertices[:, :2] - (18, 15)).T) > 4] for mesh in (plain.mesh, closed.mesh)]
    np.testing.assert_array_equal(*far)


def test_more_handles_closed_than_asked_are_told(monkeypatch):
    monkeypatch.setattr(voxel_surface, "without_handles", lambda mask, _, spacing: without_handles(mask, 0, spacing))
    surface = extract_surface(volume_of(noisy_ring()), KitSpec(max_genus=1))
    assert surface.mesh.genus == 0
    assert any("--max-genus 1 left 0" in note for note in surface.notes)
    monkeypatch.undo()
    surface = extract_surface(volume_of(noisy_ring()), KitSpec(max_genus=1))
    assert not any("left 0" in note for note in surface.notes)


def test_what_cannot_be_met_is_refused(monkeypatch):
    monkeypatch.setattr(handle, "_patches", lambda *_: [])
    with pytest.raises(InputError, match=r"1 of 1 handles cannot be closed.*genus 0 at most \(--max-genus\).*genus 1"):
        without_handles(bored(), 0, UNIT)


# ---- real shapes


@pytest.mark.parametrize(
    ("name", "most", "closed"),
    [
        ("urocell_mito_noise_tunnels.nii.gz", 0, 2),
        ("urocell_mito_genus3.nii.gz", 1, 2),
        ("urocell_mito_cavities_at_border.nii.gz", 0, 2),
        ("cells3d_nuclei_labels.ome.tif", 0, 1),
        ("emd_1832_density.map", 0, 9),
    ],
)
def test_handles_of_real_shapes(name, most, closed, shared_data):
    surface = read_surface(shared_data / name, KitSpec(max_genus=most))
    assert surface.mesh.genus == most
    assert surface.mesh.is_closed_manifold
    assert not len(self_intersections(surface.mesh))
    assert sum(bool(re.match(r"a handle closed.*(filled|cut) at .* across$", note)) for note in surface.notes) == closed
