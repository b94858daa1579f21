"""inspect_source: the facts, and the warnings that come before a failed kit."""

import json

import numpy as np
import pytest
import scipy.ndimage as ndi
import trimesh

from drkid import inspection
from drkid.data import nucleus_path
from drkid.errors import InputError
from drkid.inspection import inspect_source
from drkid.spec import DEFAULT_FACES, KitSpec
from drkid.surface import extract_surface
from drkid.volume import read_volume

GRID = np.indices((60, 30, 30)).transpose(1, 2, 3, 0)


@pytest.fixture(autouse=True)
def no_remeshes(monkeypatch):
    """The table of distances takes two remeshes; tests of its own are in test_expected_distance and test_cli."""
    monkeypatch.setattr(inspection, "expected_distances", lambda *_: ())


def save(path, xyz):
    np.save(path, np.ascontiguousarray(np.asarray(xyz).T))
    return path


def ball(centre, radius):
    return np.linalg.norm(GRID - centre, axis=-1) < radius


def test_a_label_volume_is_told_label_by_label(tmp_path):
    values = np.zeros((60, 30, 30), np.uint16)
    values[ball((14, 14, 14), 10)] = 3
    values[ball((50, 14, 14), 11)] = 8
    values[0:3, 0:3, 0:3] = 3
    found = inspect_source(save(tmp_path / "a.npy", values), KitSpec(label=3, spacing=(2, 2, 2), unit="nm"))
    assert found.volume is not None
    assert found.volume.kind == "labels"
    assert [(one.label, one.voxels, one.touches_border) for one in found.volume.labels] == [
        (3, int((values == 3).sum()), True),
        (8, int((values == 8).sum()), True),
    ]
    assert found.volume.labels[1].first == (40, 4, 4)
    assert found.volume.labels[1].last == (59, 24, 24)
    assert found.component_count == 2
    assert [(one.component, one.voxels, one.genus) for one in found.components] == [
        (1, int((values == 3).sum()) - 27, 0),
        (2, 27, 0),
    ]
    assert [one.touches_border for one in found.components] == [False, True]
    assert found.taken.label == 3
    assert found.unit == "nm"
    assert found.taken.volume == pytest.approx(8 * 4 / 3 * np.pi * 1000, rel=0.03)


def test_it_foretells_what_make_takes():
    spec = KitSpec(vertices=60)
    found = inspect_source(nucleus_path(), spec)
    surface = extract_surface(read_volume(nucleus_path(), spec), spec)
    assert found.taken.area == pytest.approx(surface.mesh.areas.sum())
    assert (found.taken.vertices, found.taken.faces, found.taken.genus) == (60, 116, 0)
    assert found.taken.mean_edge is not None
    assert found.taken.faces * np.sqrt(3) / 4 * found.taken.mean_edge**2 == pytest.approx(found.taken.area)
    assert inspect_source(nucleus_path(), KitSpec()).taken.faces == DEFAULT_FACES


def test_a_density_is_told_with_its_range_and_threshold(tmp_path):
    density = ndi.gaussian_filter(ball((14, 14, 14), 9).astype(np.float32), 1)
    found = inspect_source(save(tmp_path / "a.npy", density), KitSpec())
    assert found.volume is not None
    assert found.volume.density_range == (0, float(density.max()))
    assert found.taken.threshold == found.volume.otsu_threshold
    assert found.volume.labels == ()


def test_specks_have_no_genus(tmp_path):
    mask = ball((14, 14, 14), 9)
    mask[50, 20, 20] = True
    found = inspect_source(save(tmp_path / "a.npy", mask), KitSpec())
    assert [one.genus for one in found.components] == [0, None]


@pytest.mark.parametrize("thickness", [4.0, 9.0])
def test_thickness_is_that_of_a_slab_in_a_volume_and_in_a_mesh(thickness, tmp_path):
    slab = np.zeros((30, 30, 30), bool)
    slab[3:27, 4:26, 8 : 8 + int(thickness)] = True
    volume = inspect_source(save(tmp_path / "a.npy", slab), KitSpec(spacing=(0.5, 0.5, 0.5), unit="um"))
    trimesh.creation.box((24, 22, thickness)).subdivide().subdivide().export(tmp_path / "a.stl")
    mesh = inspect_source(tmp_path / "a.stl", KitSpec(unit="um"))
    assert volume.thickness is not None
    assert mesh.thickness is not None
    assert volume.thickness.typical == pytest.approx(thickness / 2, abs=0.25)
    assert volume.thickness.typical_voxels == pytest.approx(thickness, abs=0.5)
    assert volume.thickness.thin_voxels == pytest.approx(thickness, abs=1)
    assert mesh.thickness.typical == pytest.approx(thickness)
    assert mesh.thickness.thin_voxels is None


def test_a_thin_neck_is_warned_of_until_the_pieces_are_small_enough(tmp_path):
    x, y, z = np.moveaxis(GRID, -1, 0)
    bones = ball((14, 14, 14), 12) | ball((46, 14, 14), 12) | (np.hypot(y - 14, z - 14) < 3) & (x > 14) & (x < 46)
    path = save(tmp_path / "a.npy", bones)
    coarse, fine = (inspect_source(path, KitSpec(faces=faces)) for faces in (60, 2000))
    assert coarse.thickness is not None
    assert coarse.thickness.thin == pytest.approx(6, abs=1)
    assert any("thin places" in warning for warning in coarse.warnings)
    assert fine.warnings == ()


def test_border_and_too_few_faces_are_warned_of(tmp_path):
    cut = inspect_source(save(tmp_path / "a.npy", ball((3, 14, 14), 9)), KitSpec())
    assert any("cut off" in warning for warning in cut.warnings)
    trimesh.creation.torus(2.0, 0.8).export(tmp_path / "a.ply")
    few = inspect_source(tmp_path / "a.ply", KitSpec(faces=4, classes=2))
    assert (few.taken.faces, few.taken.mean_edge, few.taken.genus) == (None, None, 1)
    assert any("too few" in warning for warning in few.warnings)


def test_a_mesh_is_told_as_such(potato, tmp_path):
    trimesh.Trimesh(potato.vertices, potato.faces, process=False).export(tmp_path / "a.stl")
    found = inspect_source(tmp_path / "a.stl", KitSpec())
    assert found.volume is None
    assert found.mesh is not None
    assert (found.mesh.vertices, found.mesh.faces, found.mesh.bodies, found.mesh.closed) == (162, 320, 1, True)
    np.testing.assert_allclose(found.mesh.extents, potato.extents, rtol=1e-6)
    assert found.format == ".stl"


def test_the_dictionary_is_json_and_whole(potato, tmp_path):
    trimesh.Trimesh(potato.vertices, potato.faces, process=False).export(tmp_path / "a.ply")
    for path in (nucleus_path(), tmp_path / "a.ply"):
        found = inspect_source(path, KitSpec())
        back = json.loads(json.dumps(found.to_dict()))
        assert back["sha256"] == found.sha256
        assert back["taken"]["mean_edge"] == found.taken.mean_edge
        assert (back["volume"] is None) != (back["mesh"] is None)


def test_bad_inputs_are_the_same_input_errors(tmp_path):
    save(tmp_path / "zero.npy", np.zeros((5, 5, 5), np.uint8))
    for name in ("zero.npy", "missing.nii", "missing.stl", "what.doc"):
        with pytest.raises(InputError):
            inspect_source(tmp_path / name, KitSpec())


def test_real_shapes_are_warned_of_where_they_are_thin(shared_data):
    warned = {
        name: any("thin places" in warning for warning in inspect_source(shared_data / name, KitSpec()).warnings)
        for name in (
            "urocell_mito_bean.nii.gz",
            "golgi_vesicle.mrc",
            "spot_uv_seams.obj",
            "urocell_mito_branched.nii.gz",
        )
    }
    assert list(warned.values()) == [False, False, True, True]
