"""Kits of real shapes, written and read back; the nucleus ships with the package, the others may be absent."""

import json

import numpy as np
import pytest
import trimesh

import drkid
from drkid.verification import verify_kit

WITH_DOCUMENTS = {"wtc11_nucleus.ome.tif", "spot_uv_seams.obj"}  # the others without, in half the time
GOOD = {
    "urocell_mito_bean.nii.gz": {},
    "urocell_mito_elongated.nii.gz": {},
    "wtc11_nucleus.ome.tif": {},
    "cells3d_nuclei_labels.ome.tif": {"label": 12},
    "golgi_vesicle.mrc": {},
    "emdb_soft_mask.map": {},
    "celegans_embryo_cell.ply": {},
    "asteroid_itokawa.obj": {},
    "spot_uv_seams.obj": {},
}


@pytest.fixture(scope="module")
def nucleus(tmp_path_factory):
    """As by default, but for fewer pieces and fewer rounds than ten seconds hold."""
    kit = drkid.make_kit(None, drkid.KitSpec(faces=100, rounds=20))
    return kit, kit.write(tmp_path_factory.mktemp("nucleus") / "kit")


def test_the_bundled_nucleus_becomes_a_kit_that_bears_out_its_numbers(nucleus):
    kit, folder = nucleus
    found = verify_kit(folder)
    assert [check.name for check in found.checks if not check.passed] == []
    assert kit.source.voxel_unit == "um"
    assert kit.source.voxel_size == pytest.approx((0.26, 0.26, 0.29))


def test_by_default_it_takes_two_moulds_exactly(nucleus):
    kit, folder = nucleus
    document = json.loads((folder / "kit.json").read_text())
    assert kit.decomposition.outcome.status == "converged"
    assert (kit.metrics.pieces, kit.metrics.classes, kit.metrics.unique_piece_parts) == (100, 2, 2)
    assert {path.name for path in (folder / "parts").glob("?.stl")} == {"A.stl", "B.stl"}
    assert [one["mirror_symmetric"] for one in document["classes"]] == [True, True]
    assert len({length for one in document["classes"] for length in one["edge_lengths"]}) == 2
    mesh = trimesh.load_mesh(folder / "assembled.ply", process=False)
    sides = np.linalg.norm(np.diff(mesh.triangles[:, [0, 1, 2, 0]], axis=1), axis=2)
    lengths = np.array([one["edge_lengths"] for one in document["classes"]])
    of_class = {one["id"]: index for index, one in enumerate(document["classes"])}
    wanted = lengths[[of_class[piece["class"]] for piece in document["pieces"]]]
    assert [piece["face"] for piece in document["pieces"]] == list(range(100))
    assert np.abs(np.sort(sides, axis=1) - wanted).max() < 1e-6 * document["metrics"]["mean_edge"]


def test_a_kit_that_was_ended_by_the_clock_is_made_again_from_its_kit_json(tmp_path):
    kit = drkid.make_kit(None, drkid.KitSpec(faces=100, seconds=1e-3))
    folder = kit.write(tmp_path / "kit")
    values = json.loads((folder / "kit.json").read_text())["spec"]
    assert (values["seconds"], values["rounds"]) == (None, kit.metrics.iterations)
    again = drkid.make_kit(None, drkid.KitSpec.parse(values))
    assert again.spec == kit.spec
    assert again.metrics.iterations == kit.metrics.iterations
    assert (again.decomposition.mesh.vertices == kit.decomposition.mesh.vertices).all()
    assert (again.decomposition.mesh.faces == kit.decomposition.mesh.faces).all()
    other = again.write(tmp_path / "again")
    telling_seconds = {"kit.json", "report.html"}
    for path in (path for path in folder.rglob("*") if path.is_file() and path.name not in telling_seconds):
        assert path.read_bytes() == (other / path.relative_to(folder)).read_bytes()


def test_the_placed_parts_make_the_surface(nucleus):
    """The printed files alone, placed as kit.json says, cover the assembled surface within their thickness."""
    _, folder = nucleus
    document = json.loads((folder / "kit.json").read_text())
    assembled = trimesh.load_mesh(folder / "assembled.ply", process=False)
    parts = {part["file"]: trimesh.load_mesh(folder / part["file"]) for c in document["classes"] for part in c["parts"]}
    centres = np.asarray(assembled.triangles_center)
    for piece in document["pieces"]:
        placed = parts[piece["part"]].copy().apply_transform(np.reshape(piece["transform"], (4, 4)))
        low, high = placed.bounds
        assert (low < centres[piece["face"]]).all()
        assert (centres[piece["face"]] < high).all()
        normal = np.reshape(piece["transform"], (4, 4))[:3, 2]
        assert normal @ assembled.face_normals[piece["face"]] > 0.99


def test_the_volume_of_the_printed_object_is_that_of_the_voxels(nucleus):
    kit, folder = nucleus
    surface = trimesh.load_mesh(folder / "surface.ply", process=False)
    voxels = 47191 * np.prod(kit.source.voxel_size) * kit.part_set.scale_mm_per_unit**3
    assert surface.volume == pytest.approx(voxels, rel=0.03)


def test_the_seed_decides_the_kit(nucleus):
    kit, _ = nucleus
    again = drkid.make_kit(None, drkid.KitSpec.parse(kit.spec.model_dump(mode="json")))
    assert again.spec.rounds == 20
    assert (again.decomposition.mesh.vertices == kit.decomposition.mesh.vertices).all()


@pytest.mark.parametrize("name", GOOD)
def test_every_good_shape_becomes_a_kit(name, shared_data, tmp_path):
    spec = drkid.KitSpec(faces=172, rounds=20, documents=name in WITH_DOCUMENTS, **GOOD[name])
    kit = drkid.make_kit(shared_data / name, spec)
    found = verify_kit(kit.write(tmp_path / "kit"))
    assert [check.name for check in found.checks if not check.passed] == []
    assert kit.metrics.error_max_percent <= 5
    assert kit.metrics.surface_assembled.mean_percent < 2


@pytest.mark.parametrize("name", ["urocell_mito_bean.nii.gz", "asteroid_itokawa.obj"])
def test_the_papers_solver_makes_kits_of_real_shapes(name, shared_data, tmp_path):
    kit = drkid.make_kit(shared_data / name, drkid.KitSpec(method="pressure", faces=172, documents=False))
    assert verify_kit(kit.write(tmp_path / "kit")).passed
    assert kit.metrics.classes == 7
    assert kit.metrics.error_max_percent <= 5
    assert kit.metrics.surface_assembled.mean_percent < 2


@pytest.mark.parametrize("name", ["urocell_mito_genus3.nii.gz", "torus_genus1.stl"])
def test_handles_are_kept(name, shared_data, tmp_path):
    kit = drkid.make_kit(
        shared_data / name,
        drkid.KitSpec(
            method="pressure", faces=300, classes=8, max_iterations=300, bed_mm=(900, 900, 900), documents=False
        ),
    )
    assert kit.metrics.genus == {"urocell_mito_genus3.nii.gz": 3, "torus_genus1.stl": 1}[name]
    assert verify_kit(kit.write(tmp_path / "kit")).passed
