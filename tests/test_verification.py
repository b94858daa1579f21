import json
import shutil
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from drkid import verification
from drkid.errors import KitFolderError
from drkid.export.kit_document import part_name
from drkid.export.layout import part_label
from drkid.export.ply import ply_bytes
from drkid.export.stl import stl_bytes
from drkid.export.three_mf import PlateObject, three_mf_bytes
from drkid.kit import BRIDGE, WALL, Finding
from drkid.mesh import TriMesh, rounded
from drkid.parts.pocket import pocket
from drkid.solid import Solid
from drkid.verification import verify_kit


@pytest.fixture
def copy(kit_folder, tmp_path) -> Path:
    return Path(shutil.copytree(kit_folder, tmp_path / "kit"))


def failures(folder: Path) -> set[str]:
    return {check.name for check in verify_kit(folder).checks if not check.passed}


def edit(folder: Path, change) -> None:
    path = folder / "kit.json"
    document = json.loads(path.read_text())
    change(document)
    path.write_text(json.dumps(document))


def test_a_kit_as_written_bears_out_all_that_it_states(kit_folder):
    found = verify_kit(kit_folder)
    assert found.passed
    assert len(found.checks) > 20


def metric(name, factor):
    def change(document):
        document["metrics"][name] *= factor

    return change


def nudge_piece(document):
    document["pieces"][3]["transform"][3] += 5


def mirror_piece(document):
    matrix = np.array(document["pieces"][3]["transform"]).reshape(4, 4) @ np.diag([1, 1, -1, 1])
    document["pieces"][3]["transform"] = matrix.ravel().tolist()


def drop_joint(document):
    document["joints"].pop()


def swap_steps(document):
    steps = document["assembly"]
    steps[1]["face"], steps[-1]["face"] = steps[-1]["face"], steps[1]["face"]


def other_status(document):
    document["outcome"]["status"] = "stalled" if document["outcome"]["status"] == "converged" else "converged"


def one_part_more(document):
    document["classes"][0]["parts"][0]["count"] += 1


def farther(document):
    document["metrics"]["hausdorff"]["surface_assembled"]["max_percent"] += 0.1


def stiffer(document):
    document["metrics"]["rigidity"]["stiffness_percent"] *= 1.01


def with_another_softest_mode(document):
    document["metrics"]["rigidity"]["softest"] += 1e-3


def better_verdict(document):
    closure = document["metrics"]["assembly"]["closure"]
    closure["verdict"] = "closes" if closure["verdict"] != "closes" else "closes with strain"


def straighter(document):
    document["metrics"]["assembly"]["closure"]["drift"]["max_mm"] *= 0.5


def roomier(document):
    document["metrics"]["assembly"]["closure"]["budget"]["reserve_mm"] += 0.1


def looser(document):
    document["metrics"]["assembly"]["swing"]["inward_degrees"] += 1


def shorter_border(document):
    document["metrics"]["assembly"]["building"]["border_mean_mm"] *= 0.9


def longer_class(document):
    document["classes"][0]["edge_lengths"] = [1.1 * x for x in document["classes"][0]["edge_lengths"]]


def larger_part(document):
    for part in document["classes"][0]["parts"]:
        part["corners"] = [[1.1 * x for x in corner] for corner in part["corners"]]


def displaced_connector(document):
    document["classes"][0]["parts"][0]["sides"][0]["connector_frame"][7] += 2


def joint_of_no_sides(document):
    document["joints"][0]["edge"] = document["pieces"][0]["corners"][:1] * 2


@pytest.mark.parametrize(
    ("change", "name"),
    [
        (better_verdict, "virtual assembly"),
        (straighter, "drift"),
        (roomier, "tolerance budget"),
        (looser, "swing of the joints"),
        (shorter_border, "building"),
        (longer_class, "corners of the parts"),
        (larger_part, "drift"),
        (displaced_connector, "drift"),
        (joint_of_no_sides, "virtual assembly"),
        (metric("error_max", 0.9), "largest error, mm"),
        (metric("error_mean_percent", 1.01), "mean error, %"),
        (metric("mean_edge", 1.001), "mean edge, mm"),
        (nudge_piece, "placement"),
        (mirror_piece, "placement"),
        (drop_joint, "joints"),
        (swap_steps, "assembly order"),
        (other_status, "outcome"),
        (one_part_more, "counts"),
        (farther, "d_H surface_assembled max, %"),
        (stiffer, "stiffness, %"),
        (with_another_softest_mode, "softest mode"),
    ],
)
def test_a_false_statement_is_found(copy, change, name):
    edit(copy, change)
    assert name in failures(copy)


def test_a_kit_that_states_no_rigidity_is_not_asked_for_it(copy):
    edit(copy, lambda document: document["metrics"].pop("rigidity"))
    found = verify_kit(copy)
    assert found.passed
    assert "softest mode" not in {check.name for check in found.checks}


def test_an_assembly_whose_rigidity_cannot_be_computed_fails(copy, monkeypatch):
    def degenerate(_mesh):
        raise np.linalg.LinAlgError("an edge has no length")

    monkeypatch.setattr(verification, "rigidity", degenerate)
    assert failures(copy) == {"rigidity"}


def test_a_part_whose_solid_lies_off_its_frame_is_found(copy, kit):
    mesh = kit.part_set.parts[0].solid.mesh()
    file = next((copy / "parts").glob("A*.stl"))
    file.write_bytes(stl_bytes(mesh.moved(mesh.vertices + np.array([1.0, 0.0, 0.0]))))
    assert "swing of the joints" in failures(copy)


def test_one_pocket_that_is_wider_than_the_others_is_found(copy, kit):
    """By a fiftieth of a millimetre: half a per cent of its volume."""
    part = kit.part_set.parts[0]
    frame = part.side_frames[1].copy()
    frame[:3, 3] += 0.02 * frame[:3, 0]
    solid = part.solid - pocket(kit.part_set.dimensions).moved(frame)
    (copy / part_name(part)).write_bytes(stl_bytes(rounded(solid.mesh())))
    found = {check.name: check for check in verify_kit(copy).checks if not check.passed}
    assert set(found) == {"pockets are alike"}
    assert f"{part_label(part_name(part))} side 2" in found["pockets are alike"].detail


def test_pockets_that_are_too_tight_for_the_stated_clearance_are_found(copy):
    edit(copy, lambda document: document["spec"].update(clearance_mm=0.3))
    assert "clearance of the pockets" in failures(copy)


def test_a_wall_that_is_too_thin_is_found_unless_it_is_told(copy, kit):
    part = kit.part_set.parts[0]
    low, high = part.solid.bounds
    middle, wall = part.corners.mean(axis=0), kit.part_set.dimensions.min_wall_mm / 2
    groove = Solid.box([*middle[:2] - 1, low[2] - 1], [*middle[:2] + 1, high[2] - wall])
    (copy / part_name(part)).write_bytes(stl_bytes(rounded((part.solid - groove).mesh())))
    found = {check.name: check for check in verify_kit(copy).checks if not check.passed}
    assert set(found) == {"walls of the parts"}
    assert f"{part_label(part_name(part))}: {wall:.2f} mm is not told" in found["walls of the parts"].detail
    name = f"class {part.name}" if part.handedness == "any" else f"class {part.name} ({part.handedness})"
    thin = Finding(name, WALL, 2 * wall, wall, "mm", "at least")
    edit(copy, lambda document: document["findings"].append(asdict(thin)))
    assert not failures(copy)


def plate_of(slab: Solid, name: str, lift_mm: float = 0.0) -> bytes:
    matrix = np.eye(4)
    matrix[:3, 3] = 50, 50, lift_mm
    return three_mf_bytes("plate", [PlateObject(name, "#000000", slab.mesh(), [matrix])])


def test_what_bridges_too_far_on_a_plate_is_found_unless_it_is_told(copy):
    (copy / "plates").mkdir()
    file = copy / "plates" / "plate_01.3mf"
    slab = Solid.box([0, 0, 0], [30, 30, 6])
    file.write_bytes(plate_of(slab - Solid.box([8, 8, -1], [17, 22, 4]), "A_left"))
    assert not failures(copy)
    file.write_bytes(plate_of(slab - Solid.box([8, 8, -1], [20, 22, 4]), "A_left"))
    assert failures(copy) == {"bridges on the plates"}
    wide = Finding("class A (left)", BRIDGE, 10.0, 12.0, "mm", "at most")
    edit(copy, lambda document: document["findings"].append(asdict(wide)))
    assert not failures(copy)
    file.write_bytes(plate_of(slab, "A_left", lift_mm=0.5))
    assert failures(copy) == {"plates"}


@pytest.mark.parametrize(("apart_mm", "found"), [(31.0, set()), (29.0, {"plates"})])
def test_items_that_lie_in_one_another_are_found(copy, apart_mm, found):
    (copy / "plates").mkdir()
    slab = Solid.box([0, 0, 0], [30, 30, 5])
    there = np.eye(4)
    there[0, 3] = apart_mm
    plate = three_mf_bytes("plate", [PlateObject("A_left", "#000000", slab.mesh(), [np.eye(4), there])])
    (copy / "plates" / "plate_01.3mf").write_bytes(plate)
    assert failures(copy) == found


def test_a_broken_plate_is_named(copy):
    (copy / "plates").mkdir()
    (copy / "plates" / "plate_01.3mf").write_bytes(b"{nonsense")
    with pytest.raises(KitFolderError, match="plate_01"):
        verify_kit(copy)


def test_a_kit_that_states_no_assembly_has_to_close(copy):
    """Four classes within 5 % leave gaps of more than a millimetre."""
    edit(copy, lambda document: document["metrics"].pop("assembly"))
    assert failures(copy) == {"virtual assembly"}


def test_a_surface_with_a_hole_is_found(copy, kit):
    (copy / "surface.ply").write_bytes(ply_bytes(kit.surface.submesh(np.arange(1, len(kit.surface.faces)))))
    assert "surface.ply is one closed surface" in failures(copy)


def test_a_part_that_is_no_solid_is_found(copy, kit):
    mesh = kit.part_set.parts[0].solid.mesh()
    file = next((copy / "parts").glob("A*.stl"))
    file.write_bytes(stl_bytes(TriMesh(mesh.vertices, mesh.faces[1:])))
    assert "parts are solids" in failures(copy)


def test_a_parts_list_that_miscounts_is_found(copy):
    rows = json.loads((copy / "bom.json").read_text())
    rows[0]["count"] += 1
    (copy / "bom.json").write_text(json.dumps(rows))
    assert "parts list" in failures(copy)


@pytest.mark.parametrize("name", ["kit.json", "assembled.ply", "bom.json"])
@pytest.mark.parametrize("how", ["missing", "broken"])
def test_a_missing_or_broken_file_is_named(copy, name, how):
    if how == "missing":
        (copy / name).unlink()
    else:
        (copy / name).write_bytes(b"{nonsense")
    with pytest.raises(KitFolderError) as caught:
        verify_kit(copy)
    assert caught.value.exit_status == 2
    assert "kit" in str(caught.value)


def test_assembled_without_classes_is_refused(copy, kit):
    (copy / "assembled.ply").write_bytes(ply_bytes(kit.decomposition.mesh))
    with pytest.raises(KitFolderError, match="piece_class"):
        verify_kit(copy)
