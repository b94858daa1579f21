"""M_i of a volume: what is chosen, what is said, and that it is always one closed outward surface."""

import numpy as np
import pytest
import scipy.ndimage as ndi
from hypothesis import given, settings
from hypothesis import strategies as st
from voxel_shapes import ball, ellipsoid, places, ring, volume_of

from drkid.errors import InputError, SpecError
from drkid.formats import is_mesh_path
from drkid.intersection import self_intersections
from drkid.kit import Surface
from drkid.measure import distance_to_surface
from drkid.spec import KitSpec
from drkid.surface import extract_surface
from drkid.volume import read_volume


def sound(surface: Surface) -> Surface:
    """The promises that hold for every surface."""
    mesh = surface.mesh
    assert mesh.is_closed_manifold
    assert mesh.component_count == 1
    assert mesh.volume > 0
    assert (2 * mesh.areas / mesh.side_lengths.max(axis=1)).min() > 1e-9 * mesh.diagonal
    assert 0 <= surface.max_displacement_voxels <= 1
    return surface


def said(surface: Surface, *words: str) -> bool:
    return any(all(word in note for word in words) for note in surface.notes)


def labels() -> np.ndarray:
    """Two balls: label 5 the larger, label 9 in two parts."""
    values = np.zeros((50, 30, 30), np.uint16)
    values[:27, :27, :27][ball()] = 5
    values[30:45, 5:20, 5:20][ball(15, 5)] = 9
    values[46:50, 24:28, 24:28] = 9
    return values


# ---- what is chosen


def test_the_largest_label_is_taken_and_said():
    surface = sound(extract_surface(volume_of(labels(), kind="labels"), KitSpec()))
    assert surface.source.label == 5
    assert said(surface, "label 5", "largest of 2")
    np.testing.assert_allclose(surface.mesh.vertices.mean(0), (13.2, 12.9, 13.3), atol=0.1)


def test_the_asked_label_is_taken_and_its_debris_dropped():
    surface = sound(extract_surface(volume_of(labels(), kind="labels"), KitSpec(label=9)))
    assert (surface.source.label, surface.components, surface.debris_dropped) == (9, 2, 1)
    assert said(surface, "64 voxels", "left out")
    assert not said(surface, "largest")


def test_an_unknown_label_is_refused_with_those_that_are_there():
    with pytest.raises(InputError, match=r"no label 7.*5 \(.* voxels\), 9 \("):
        extract_surface(volume_of(labels(), kind="labels"), KitSpec(label=7))
    many = np.repeat(np.arange(1, 41, dtype=np.uint8), 27).reshape(40, 3, 9)
    with pytest.raises(InputError, match="and 28 smaller ones"):
        extract_surface(volume_of(many, kind="labels"), KitSpec(label=99))


def test_components_are_counted_by_size():
    spec = KitSpec(label=9, component=2)
    surface = sound(extract_surface(volume_of(labels(), kind="labels"), spec))
    assert surface.source.component == 2
    assert surface.mesh.vertices[:, 0].min() > 45
    assert surface.touches_border
    with pytest.raises(InputError, match=r"no component 3.*1 to 2"):
        extract_surface(volume_of(labels(), kind="labels"), KitSpec(label=9, component=3))


def test_nothing_and_next_to_nothing_are_refused():
    empty = np.zeros((9, 9, 9), np.uint8)
    with pytest.raises(InputError, match="holds no object"):
        extract_surface(volume_of(empty), KitSpec())
    empty[4, 4, 4] = 1
    with pytest.raises(InputError, match=r"too small.*found: 1 voxel;"):
        extract_surface(volume_of(empty), KitSpec())
    with pytest.raises(InputError, match="same value"):
        extract_surface(volume_of(np.full((9, 9, 9), 0.5), kind="density"), KitSpec())


def test_contradictions_are_refused():
    density = ndi.gaussian_filter(ball().astype(float), 1)
    with pytest.raises(SpecError, match="both given"):
        extract_surface(volume_of(labels(), kind="labels"), KitSpec(label=5, threshold=1.0))
    with pytest.raises(SpecError, match="label is for label volumes"):
        extract_surface(volume_of(density, kind="density"), KitSpec(label=5))
    with pytest.raises(InputError, match=r"nothing inside.*0 to"):
        extract_surface(volume_of(density, kind="density"), KitSpec(threshold=2.0))
    with pytest.raises(InputError, match="nothing outside"):
        extract_surface(volume_of(density, kind="density"), KitSpec(threshold=-1.0))


def test_a_given_label_or_threshold_decides_how_integers_are_read():
    grey = (ndi.gaussian_filter(ball().astype(float), 1) * 200).astype(np.uint8)
    as_density = sound(extract_surface(volume_of(grey, kind="labels"), KitSpec(threshold=100)))
    assert (as_density.source.label, as_density.source.threshold) == (None, 100)
    as_label = sound(extract_surface(volume_of(labels(), kind="density"), KitSpec(label=9)))
    assert as_label.source.label == 9
    mask = volume_of(ball().astype(np.uint8))
    both = [extract_surface(mask, spec).mesh for spec in (KitSpec(), KitSpec(threshold=0.5))]
    np.testing.assert_array_equal(both[0].vertices, both[1].vertices)


# ---- topology


def test_a_ring_has_one_handle():
    surface = sound(extract_surface(volume_of(ring()), KitSpec()))
    assert surface.mesh.genus == 1
    assert said(surface, "1 handle;")
    assert not said(extract_surface(volume_of(ball()), KitSpec()), "handle")


def test_cavities_are_filled_and_counted():
    hollow = ball() & ~ball(27, 4)
    filled, plain = (sound(extract_surface(volume_of(mask), KitSpec())) for mask in (hollow, ball()))
    assert (filled.cavities_filled, plain.cavities_filled) == (1, 0)
    assert said(filled, "1 enclosed cavity filled")
    np.testing.assert_array_equal(filled.mesh.vertices, plain.mesh.vertices)


def test_a_ball_at_the_border_is_closed_flat_there():
    half = ball()[13:]
    surface = sound(extract_surface(volume_of(half), KitSpec(smooth=False)))
    assert surface.touches_border
    assert said(surface, "x low", "closed flat")
    assert surface.mesh.genus == 0
    assert surface.mesh.vertices[:, 0].min() == -0.5
    hollow_at_the_border = (ball() & ~ball(27, 4))[13:]
    assert extract_surface(volume_of(hollow_at_the_border), KitSpec()).cavities_filled == 0


def test_a_whole_volume_is_a_block():
    surface = sound(extract_surface(volume_of(np.ones((4, 5, 6), np.uint8)), KitSpec(smooth=False)))
    assert surface.mesh.genus == 0
    np.testing.assert_allclose(surface.mesh.extents, (4, 5, 6))


@settings(max_examples=30)
@given(st.integers(0, 10_000), st.floats(0.3, 0.6), st.booleans())
def test_noise_still_gives_a_closed_manifold(seed, share, smooth):
    noise = ndi.gaussian_filter(np.random.default_rng(seed).random((14, 13, 12)), 0.6)
    mask = noise < np.quantile(noise, share)
    sound(extract_surface(volume_of(mask.astype(np.uint8)), KitSpec(smooth=smooth)))


@settings(max_examples=30)
@given(st.integers(0, 10_000))
def test_noisy_densities_give_a_closed_manifold(seed):
    noise = ndi.gaussian_filter(np.random.default_rng(seed).random((14, 13, 12)), 0.8)
    surface = sound(extract_surface(volume_of(noise, kind="density"), KitSpec()))
    assert surface.max_displacement_voxels == 0


# ---- geometry

SHAPES = {
    "ball": (ball(), (1.0, 1.0, 1.0), np.array((13.2, 12.9, 13.3)), np.full(3, 9.0)),
    "flat voxels": (
        ellipsoid((50, 40, 18), (24.3, 19.1, 23.7), (20, 15, 18), (1, 1, 2.7)),
        (1.0, 1.0, 2.7),
        np.array((24.3, 19.1, 23.7)),
        np.array((20.0, 15.0, 18.0)),
    ),
    "small units": (
        ellipsoid((50, 40, 40), (0.39, 0.31, 0.29), (0.32, 0.2, 0.24), (0.016, 0.016, 0.015)),
        (0.016, 0.016, 0.015),
        np.array((0.39, 0.31, 0.29)),
        np.array((0.32, 0.2, 0.24)),
    ),
}


def distance_to_ellipsoid(points, centre, radii):
    """First-order distance."""
    unit = (points - centre) / radii
    length = np.linalg.norm(unit, axis=1)
    return np.abs(length - 1) * length / np.linalg.norm(unit / radii, axis=1)


@pytest.mark.parametrize("name", SHAPES)
def test_smoothing_brings_the_surface_to_the_shape_without_shrinking_it(name):
    mask, spacing, centre, radii = SHAPES[name]
    surfaces = {smooth: sound(extract_surface(volume_of(mask, spacing), KitSpec(smooth=smooth))) for smooth in (0, 1)}
    error = {
        smooth: np.sqrt((distance_to_ellipsoid(surface.mesh.vertices, centre, radii) ** 2).mean())
        for smooth, surface in surfaces.items()
    }
    true_volume = 4 / 3 * np.pi * np.prod(radii)
    voxel_volume = mask.sum() * np.prod(spacing)
    assert error[1] < 0.5 * error[0]
    assert error[1] < 0.16 * np.prod(spacing) ** (1 / 3)
    assert surfaces[1].mesh.volume == pytest.approx(true_volume, rel=0.02)
    assert surfaces[1].mesh.volume == pytest.approx(voxel_volume, rel=0.02)
    assert surfaces[0].max_displacement_voxels == 0 < surfaces[1].max_displacement_voxels
    assert not len(self_intersections(surfaces[1].mesh))
    same_faces = surfaces[1].mesh.faces == surfaces[0].mesh.faces
    moved = np.linalg.norm((surfaces[1].mesh.vertices - surfaces[0].mesh.vertices) / spacing, axis=1).max()
    assert same_faces.all()
    assert moved == pytest.approx(surfaces[1].max_displacement_voxels, rel=1e-9)


def test_smoothing_straightens_normals():
    mask, spacing, centre, radii = SHAPES["ball"]
    angle = []
    for smooth in (False, True):
        mesh = extract_surface(volume_of(mask, spacing), KitSpec(smooth=smooth)).mesh
        outward = (mesh.corners.mean(axis=1) - centre) / radii**2
        outward /= np.linalg.norm(outward, axis=1, keepdims=True)
        angle.append(np.degrees(np.arccos(np.clip((outward * mesh.face_normals).sum(axis=1), -1, 1))).mean())
    assert angle[1] < 0.4 * angle[0]


def test_a_density_is_met_between_the_voxels():
    centre, radius = np.array((13.2, 12.9, 13.3)), 9.0
    density = 20 - np.linalg.norm(places((27, 27, 27)) - centre, axis=-1)
    surface = sound(extract_surface(volume_of(density, kind="density"), KitSpec(threshold=20 - radius)))
    np.testing.assert_allclose(np.linalg.norm(surface.mesh.vertices - centre, axis=1), radius, atol=0.03)


def test_a_density_exactly_at_the_level_gives_no_flat_faces():
    stepped = ndi.gaussian_filter(ball().astype(np.float32), 1).round(1)
    surface = sound(extract_surface(volume_of(stepped, kind="density"), KitSpec(threshold=0.5)))
    assert surface.mesh.genus == 0


def test_otsu_is_said_aloud_and_parts_object_from_background():
    density = ndi.gaussian_filter(ball().astype(float), 1)
    surface = sound(extract_surface(volume_of(density, kind="density"), KitSpec()))
    threshold = surface.source.threshold
    assert threshold is not None
    assert 0.3 < threshold < 0.7
    assert said(surface, "Otsu", f"{threshold:.6g}")


def test_other_components_and_cavities_of_a_density_leave_no_trace():
    density = ndi.gaussian_filter(ball().astype(float), 1)
    busy = density.copy()
    busy[12:15, 12:15, 12:15] = 0
    busy = np.pad(busy, ((0, 12), (0, 0), (0, 0)))
    busy[30:35, 10:15, 10:15] = 2
    plain = sound(extract_surface(volume_of(density, kind="density"), KitSpec(threshold=0.5)))
    found = sound(extract_surface(volume_of(busy, kind="density"), KitSpec(threshold=0.5)))
    assert (found.debris_dropped, found.cavities_filled, plain.cavities_filled) == (1, 1, 0)
    np.testing.assert_allclose(found.mesh.vertices, plain.mesh.vertices)


@settings(max_examples=30)
@given(st.tuples(*[st.integers(0, 5)] * 3), st.floats(0.01, 100), st.permutations([0, 1, 2]))
def test_shift_scale_and_turn_of_the_voxels_carry_over(shift, scale, order):
    blob = ellipsoid((16, 14, 12), (7.2, 6.4, 5.1), (6, 5, 4))
    base = extract_surface(volume_of(blob), KitSpec()).mesh
    moved = np.pad(blob, [(n, 1) for n in shift]).transpose(order)
    mesh = extract_surface(volume_of(moved, (scale, scale, scale)), KitSpec()).mesh
    expected = ((base.vertices + shift) * scale)[:, order]
    gap = distance_to_surface(base.moved((base.vertices + shift) * scale), mesh.vertices[:, np.argsort(order)])
    assert gap.max() < 0.2 * scale  # a cube may be cut along its other diagonal
    np.testing.assert_allclose(mesh.extents, np.ptp(expected, axis=0), atol=0.05 * scale)
    assert mesh.volume == pytest.approx(base.volume * scale**3, rel=0.005)


def test_progress_rises_to_one():
    told: list[float] = []
    extract_surface(volume_of(ball()), KitSpec(), lambda _what, fraction: told.append(fraction))
    assert told == sorted(told)
    assert told[-1] == 1


# ---- real shapes: outer genus as the data's table has it

GENUS = {
    "urocell_mito_bean.nii.gz": 0,
    "urocell_mito_elongated.nii.gz": 0,
    "urocell_mito_branched.nii.gz": 0,
    "urocell_mito_genus3.nii.gz": 3,
    "urocell_mito_noise_tunnels.nii.gz": 2,
    "urocell_mito_cavities_at_border.nii.gz": 2,
    "urocell_many_mitos_labels.nii.gz": 0,
    "wtc11_nucleus.ome.tif": 0,
    "cells3d_nuclei_labels.ome.tif": 1,
    "golgi_vesicle.mrc": 0,
    "emd_1832_density.map": 7,
    "emdb_soft_mask.map": 0,
    "er_thin_sheet.mrc.gz": 272,
    "celegans_embryo_cell.ply": 0,
    "asteroid_itokawa.obj": 0,
    "spot_uv_seams.obj": 0,
    "torus_genus1.stl": 1,
}
LEVEL = {"emd_1832_density.map": 0.3075, "emdb_soft_mask.map": 0.289}


@pytest.mark.parametrize("name", GENUS)
def test_real_shapes_are_read_whole(name, shared_data):
    path, spec = shared_data / name, KitSpec(threshold=LEVEL.get(name))
    if is_mesh_path(path):
        assert sound(extract_surface(path, spec)).mesh.genus == GENUS[name]
        return
    volume = read_volume(path, spec)
    surface = sound(extract_surface(volume, spec))
    assert surface.mesh.genus == GENUS[name]
    inside = volume.values >= LEVEL[name] if name in LEVEL else volume.values == surface.source.label
    numbered, _ = ndi.label(inside, np.ones((3, 3, 3)))
    inside = ndi.binary_fill_holes(np.pad(numbered == np.bincount(numbered.ravel())[1:].argmax() + 1, 1))
    spacing = np.asarray(volume.spacing)
    assert surface.mesh.volume == pytest.approx(inside.sum() * np.prod(spacing), rel=0.05)
    boundary = np.argwhere(inside & ~ndi.binary_erosion(inside)) - 1
    gap = distance_to_surface(surface.mesh.moved(surface.mesh.vertices / spacing), boundary[::7].astype(float))
    assert gap.mean() < 1
    assert ("border" in name or "many" in name) == surface.touches_border
