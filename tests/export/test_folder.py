import json
from dataclasses import asdict, replace
from pathlib import Path

import pytest

from drkid.errors import KitFolderError
from drkid.export import KitDocument, require_writable, write_kit


def names(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


def test_the_folder_holds_what_kit_json_names_and_nothing_else(kit_folder):
    document = json.loads((kit_folder / "kit.json").read_text())
    parts = {part["file"] for c in document["classes"] for part in c["parts"]}
    hardware = {item["file"] for item in document["hardware"] if "file" in item}
    fixed = {"kit.json", "surface.ply", "simplified.ply", "assembled.ply", "bom.csv", "bom.json"}
    assert names(kit_folder) == fixed | parts | hardware


def test_the_document_obeys_its_own_schema_and_states_resolved_parameters(kit, kit_folder):
    document = KitDocument.model_validate_json((kit_folder / "kit.json").read_bytes())
    assert document.metrics.pieces == len(kit.assembly.pieces)
    for name in ("thickness_mm", "clearance_mm", "rod_clearance_mm", "min_wall_mm", "knuckle_wall_mm", "size_mm"):
        assert document.spec[name] > 0, name
    assert document.spec["bed_mm"] == [220, 220, 250]
    assert document.convergence[0].iteration == 0
    assert document.convergence[-1].iteration == kit.decomposition.iterations


def test_the_rigidity_is_written_as_measured(kit, kit_folder):
    found = json.loads((kit_folder / "kit.json").read_text())["metrics"]["rigidity"]
    measured = asdict(kit.decomposition.rigidity)
    assert found == {name: value for name, value in measured.items() if value is not None}
    allowed = KitDocument.model_json_schema()["$defs"]["RigidityDocument"]["properties"]
    assert set(allowed) == set(measured)


def test_an_existing_folder_is_refused_and_left_as_it_is(kit, kit_folder):
    before = (kit_folder / "kit.json").read_bytes()
    with pytest.raises(KitFolderError, match="exists"):
        write_kit(kit, kit_folder)
    assert (kit_folder / "kit.json").read_bytes() == before


def test_force_replaces_a_kit_whole(kit, tmp_path):
    folder = write_kit(kit, tmp_path / "kit")
    (folder / "left-over.txt").write_text("old")
    write_kit(kit, folder, force=True)
    assert "left-over.txt" not in names(folder)
    assert [path.name for path in tmp_path.iterdir()] == ["kit"]


def test_force_does_not_replace_what_is_no_kit(kit, tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(KitFolderError, match="not a kit"):
        write_kit(kit, tmp_path, force=True)
    assert (tmp_path / "thesis.tex").read_text() == "years of work"
    with pytest.raises(KitFolderError, match="not a kit"):
        require_writable(tmp_path / "thesis.tex", force=True)


def test_an_empty_folder_may_be_taken_with_force(kit, tmp_path):
    folder = tmp_path / "empty"
    folder.mkdir()
    assert "kit.json" in names(write_kit(kit, folder, force=True))


def test_parents_are_made(kit, tmp_path):
    assert (write_kit(kit, tmp_path / "a" / "b") / "kit.json").is_file()


def test_a_place_that_cannot_be_written_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(KitFolderError, match="cannot be written"):
        require_writable(tmp_path / "file" / "kit", force=False)


@pytest.mark.parametrize("existing", [False, True])
def test_a_failure_half_way_leaves_nothing_and_loses_nothing(kit, tmp_path, monkeypatch, existing):
    folder = tmp_path / "kit"
    before = write_kit(kit, folder) / "kit.json" if existing else None
    content = before.read_bytes() if before else b""
    written = Path.write_bytes

    def full_disk(path: Path, data: bytes) -> int:
        if path.name == "bom.json":
            raise OSError(28, "No space left on device")
        return written(path, data)

    monkeypatch.setattr(Path, "write_bytes", full_disk)
    with pytest.raises(KitFolderError, match="No space left"):
        write_kit(kit, folder, force=True)
    assert [path.name for path in tmp_path.iterdir()] == (["kit"] if existing else [])
    assert not existing or (folder / "kit.json").read_bytes() == content


def test_an_interruption_leaves_nothing(kit, tmp_path, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(Path, "write_bytes", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_kit(kit, tmp_path / "kit")
    assert list(tmp_path.iterdir()) == []


def test_long_histories_are_thinned_with_both_ends_kept(kit, tmp_path):
    record = kit.decomposition.convergence[0]
    many = tuple(replace(record, iteration=i) for i in range(5000))
    long = replace(kit, decomposition=replace(kit.decomposition, convergence=many))
    found = KitDocument.model_validate_json((write_kit(long, tmp_path / "kit") / "kit.json").read_bytes()).convergence
    assert len(found) == 500
    assert (found[0].iteration, found[-1].iteration) == (0, 4999)
