"""The command line as a person types it: exit statuses, messages, and nothing half-written."""

import json
import math
import re
import subprocess
import sys

import numpy as np
import pytest

import drkid
from drkid import __version__
from drkid.cli import run
from drkid.commands import NOT_TYPED, _spec
from drkid.spec import KitSpec

QUICK = ["--faces", "40", "--method", "pressure", "--classes", "3", "--max-iterations", "300"]


def plain(text: str) -> str:
    """Without line breaks and frames, which depend on the terminal's width."""
    return re.sub(r"[\s│]+", " ", text)


def test_help_names_the_commands_and_imports_no_numerical_library():
    code = (
        "import sys; from drkid.cli import run; status = run(['--help']);"
        "print(status, [m for m in ('numpy', 'scipy', 'numba', 'pydantic') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    for name in ("make", "inspect", "check", "schema"):
        assert name in done.stdout
    assert done.stdout.splitlines()[-1] == "0 []"


def test_version(capsys):
    assert run(["--version"]) == 0
    assert __version__ in capsys.readouterr().out


def test_help_of_make_shows_every_parameter_with_its_default(capsys):
    assert run(["make", "--help"]) == 0
    text = plain(capsys.readouterr().out)
    for name, field in KitSpec.model_fields.items():
        if name in NOT_TYPED:
            assert f"--{name.replace('_', '-')}" not in text
            continue
        assert f"--{name.replace('_', '-')}" in text
        if field.default is not None and not isinstance(field.default, tuple):
            assert f"[default: {field.default}]" in text
    for flag in ("--out", "--force", "--json", "--spec"):
        assert flag in text


def test_make_then_check_then_make_again_from_kit_json(potato_file, tmp_path, capsys):
    first, again = tmp_path / "first", tmp_path / "again"
    status = run(["make", str(potato_file), "--out", str(first), "--tolerance-percent", "30", *QUICK])
    shown = plain(capsys.readouterr().out)
    assert status == 0
    assert "40 in 3 classes" in shown
    assert "first" in shown
    assert run(["check", str(first)]) == 0
    assert "40 of 40 checks passed" in plain(capsys.readouterr().out)
    assert run(["make", str(potato_file), "--out", str(again), "--spec", str(first / "kit.json")]) == 0
    for path in first.rglob("*.stl"):
        assert path.read_bytes() == (again / path.relative_to(first)).read_bytes()
    for name in ("assembled.ply", "bom.csv"):
        assert (first / name).read_bytes() == (again / name).read_bytes()


def test_a_tolerance_out_of_reach_writes_the_kit_and_exits_with_three(potato_file, tmp_path, capsys):
    folder = tmp_path / "kit"
    status = run(["make", str(potato_file), "--out", str(folder), "--tolerance-percent", "1e-6", "--json", *QUICK])
    summary = json.loads(capsys.readouterr().out)
    assert status == 3
    assert summary["outcome"]["status"] == "stalled"
    assert summary["folder"] == str(folder)
    assert summary["metrics"] == json.loads((folder / "kit.json").read_text())["metrics"]
    assert run(["check", str(folder), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["passed"]


def test_check_exits_with_one_for_a_kit_that_lies(kit_folder, tmp_path, capsys):
    folder = tmp_path / "kit"
    folder.mkdir()
    for path in kit_folder.rglob("*"):
        if path.is_file():
            (folder / path.relative_to(kit_folder)).parent.mkdir(exist_ok=True)
            (folder / path.relative_to(kit_folder)).write_bytes(path.read_bytes())
    text = (folder / "kit.json").read_text()
    (folder / "kit.json").write_text(text.replace('"genus": 0', '"genus": 1'))
    assert run(["check", str(folder)]) == 1
    assert "FAIL genus" in plain(capsys.readouterr().out)


def test_schemas_are_json_schemas(capsys):
    assert run(["schema"]) == 0
    assert "pieces" in json.loads(capsys.readouterr().out)["properties"]
    assert run(["schema", "spec"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert set(document["properties"]) == set(KitSpec.model_fields)
    assert document["properties"]["faces"]["description"]
    assert run(["schema", "cat"]) == 2


def test_inspect_as_text_and_as_json(potato_file, capsys):
    assert run(["inspect", str(potato_file)]) == 0
    text = plain(capsys.readouterr().out)
    assert "make would take" in text
    assert run(["inspect", str(potato_file), "--faces", "40", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["taken"]["faces"], found["taken"]["vertices"], found["taken"]["genus"]) == (40, 22, 0)


def test_inspect_of_the_bundled_nucleus(capsys):
    assert run(["inspect"]) == 0
    text = plain(capsys.readouterr().out)
    assert "47191" in text
    assert "um" in text


def refused(arguments: list[str], capsys) -> str:
    assert run(arguments) == 2
    captured = capsys.readouterr()
    assert "Traceback" not in captured.err
    assert captured.out == ""
    return plain(captured.err)


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["--faces", "3"], ["faces", "greater than or equal to 4"]),
        (["--faces", "41"], ["41", "even number"]),
        (["--faces", "8", "--classes", "9"], ["9", "8 faces"]),
        (["--thickness-mm", "-1"], ["thickness_mm", "greater than 0"]),
        (["--spacing", "1,2"], ["spacing"]),
        (["--process", "wood"], ["wood", "fdm"]),
        (["--facs", "40"], ["--facs", "--faces"]),
        (["--classes", "11"], ["11", "--method pressure"]),
        (["--spec", "nowhere.toml"], ["nowhere.toml", "cannot be read"]),
        (["--label", "3"], ["label"]),
        (["--printer", "ender-2"], ["printer", "ender-3", "ender-2"]),
        (["--printer", "ender-3", "--bed", "300x300x300"], ["printer is ender-3", "bed_mm"]),
        (["--bed", "300x300"], ["bed_mm"]),
        (["--spares", "few"], ["spares", "whole number", "5%", "few"]),
        (["--price-per-kg", "-3"], ["price_per_kg", "greater than or equal to 0"]),
        (["--mould-price", "900"], ["mould_price is given", "price_per_kg is not"]),
        (["--paper", "a5"], ["paper", "a4", "a5"]),
        (["--net-scale", "0"], ["net_scale", "greater than 0"]),
    ],
)
def test_bad_parameters_are_explained_and_nothing_is_written(flags, words, potato_file, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = refused(["make", str(potato_file), "--out", "kit", *flags], capsys)
    for word in words:
        assert word in text
    assert list(tmp_path.iterdir()) == []


def test_the_parts_list_of_a_kit_follows_printer_spares_and_prices(potato_file, tmp_path, capsys):
    prices = ["--price-per-kg", "300", "--mould-price", "900", "--spares", "10%", "--printer", "prusa-mini"]
    flags = ["--tolerance-percent", "50", "--no-documents", *prices, *QUICK]
    assert run(["make", str(potato_file), "--out", str(tmp_path / "kit"), "--json", *flags]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["spec"]["bed_mm"] == [180, 180, 180]
    rows = json.loads((tmp_path / "kit" / "bom.json").read_text())
    assert all(row["spare"] == math.ceil(row["count"] / 10) for row in rows)
    printed = [row for row in rows if row["file"]]
    assert all(row["mould_cost"] == 900 for row in printed)
    assert summary["cost"]["printed"] == pytest.approx(sum(row["total_cost"] for row in printed))
    assert summary["cost"]["moulding"]["moulds_cost"] == 900 * len(printed)
    assert {row["picture"] for row in rows} == {None}
    assert not (tmp_path / "kit" / "plates").exists()


def test_more_classes_than_the_faces_that_vertices_give(potato_file, tmp_path, capsys):
    arguments = ["make", str(potato_file), "--out", str(tmp_path / "k"), "--vertices", "12", "--classes", "21"]
    assert "21 classes cannot be made of 20 faces" in refused(arguments, capsys)


def test_an_existing_folder_needs_force(kit_folder, potato_file, capsys):
    before = (kit_folder / "kit.json").read_bytes()
    text = refused(["make", str(potato_file), "--out", str(kit_folder)], capsys)
    assert "exists" in text
    assert "--force" in text
    assert (kit_folder / "kit.json").read_bytes() == before


def test_an_unwritable_folder_is_refused_before_anything_is_computed(potato_file, tmp_path, capsys):
    (tmp_path / "file").write_text("")
    text = refused(["make", str(potato_file), "--out", str(tmp_path / "file" / "kit")], capsys)
    assert "cannot be written" in text


def test_a_print_too_small_for_its_hinges_is_refused_with_remedies(potato_file, tmp_path, capsys):
    text = refused(["make", str(potato_file), "--out", str(tmp_path / "k"), "--size-mm", "40", *QUICK], capsys)
    for word in ("does not fit", "class", "size"):
        assert word in text
    assert list(tmp_path.iterdir()) == []


def test_parameters_come_from_toml_and_flags_override_them(potato_file, tmp_path, capsys):
    spec = tmp_path / "spec.toml"
    spec.write_text(
        'faces = 60\nmethod = "pressure"\nclasses = 3\nmax_iterations = 200\nconnector = "none"\n'
        "tolerance_percent = 50\n"
    )
    arguments = ["make", str(potato_file), "--out", str(tmp_path / "kit"), "--spec", str(spec), "--vertices", "22"]
    assert run([*arguments, "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["metrics"]["pieces"] <= 40
    assert summary["spec"]["connector"] == "none"


@pytest.mark.parametrize(
    ("file", "flags", "expected"),
    [
        ({"rounds": 7}, {"seconds": 5.0}, {"rounds": None, "seconds": 5.0}),
        ({"rounds": 7}, {"seed": 3}, {"rounds": 7, "seed": 3}),
        (
            {"method": "palette", "classes": 2, "rounds": 7, "tolerance_percent": 0.1},
            {"method": "pressure"},
            {"classes": 7, "rounds": None, "tolerance_percent": None},
        ),
        (
            {"method": "pressure", "classes": 7, "tolerance_percent": 1.5},
            {"method": "palette"},
            {"classes": 2, "tolerance_percent": None},
        ),
        (
            {"method": "pressure", "classes": 7, "tolerance_percent": 1.5},
            {"multisets": "ssl"},
            {"method": "palette", "classes": 1, "tolerance_percent": None},
        ),
        (
            {"classes": 5, "tolerance_percent": 2.0},
            {"method": "pressure"},
            {"classes": 5, "tolerance_percent": 2.0},
        ),
        ({"method": "pressure", "classes": 6}, {"method": "pressure"}, {"classes": 6}),
        ({"size_mm": 200.0}, {"fit": True}, {"size_mm": None, "fit": True}),
        ({"size_mm": 200.0}, {"mean_edge_mm": 40.0}, {"size_mm": None, "mean_edge_mm": 40.0}),
        (
            {"process": "fdm", "clearance_mm": 0.2, "thickness_mm": 6.9, "knuckles": 2},
            {"process": "sla"},
            {"process": "sla", "clearance_mm": None, "thickness_mm": None, "knuckles": None},
        ),
        ({"process": "fdm", "clearance_mm": 0.3}, {"process": "fdm"}, {"clearance_mm": 0.3}),
        ({"connector": "hinge", "thickness_mm": 6.9}, {"connector": "snap"}, {"thickness_mm": None}),
    ],
)
def test_a_flag_takes_the_place_of_what_a_file_has_chosen_for_another(file, flags, expected, tmp_path):
    path = tmp_path / "kit.json"
    path.write_text(json.dumps({"spec": file}))
    spec = _spec(path, flags)
    assert {name: getattr(spec, name) for name in expected} == expected


@pytest.mark.parametrize("content", ["[1, 2]", "{broken", '{"spec": {"colour": 3}}'])
def test_a_spec_file_that_holds_no_parameters(content, potato_file, tmp_path, capsys):
    path = tmp_path / "spec.json"
    path.write_text(content)
    text = refused(["make", str(potato_file), "--out", str(tmp_path / "kit"), "--spec", str(path)], capsys)
    assert "spec.json" in text or "colour" in text


def test_an_interruption_says_so_and_leaves_nothing(potato_file, tmp_path, capsys, monkeypatch):
    def interrupted(*_args, **_kwargs):
        raise KeyboardInterrupt

    monkeypatch.setattr("drkid.pipeline.decompose", interrupted)
    assert run(["make", str(potato_file), "--out", str(tmp_path / "kit"), *QUICK]) == 130
    assert "nothing was written" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_the_folder_is_named_after_the_input(tmp_path, potato_file, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run(["make", str(potato_file), "--tolerance-percent", "50", "--connector", "none", *QUICK]) == 0
    assert (tmp_path / "potato-kit" / "kit.json").is_file()


def test_python_dash_m(tmp_path):
    command = [sys.executable, "-m", "drkid", "--version"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=True)
    assert done.stdout.strip() == __version__


def test_the_package_offers_its_names_and_no_others():
    assert drkid.KitSpec is KitSpec
    assert callable(drkid.make_kit)
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        _ = drkid.nonsense


def test_inspect_recommends_faces_for_a_distance(potato_file, capsys):
    assert run(["inspect", str(potato_file), "--for-distance-percent", "1.2"]) == 0
    text = plain(capsys.readouterr().out)
    assert "expected distance from the surface" in text
    assert re.search(r"recommended --faces \d+: [\d.]+ % mean", text)
    assert run(["inspect", str(potato_file), "--for-distance-percent", "1.2", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["recommended"]["mean_percent"] <= 1.2
    assert [row["faces"] for row in found["distances"]] == [80, 120, 172, 260, 400, 600, 1000]
    assert "above 0" in refused(["inspect", str(potato_file), "--for-distance-percent", "0"], capsys)


def test_max_genus_is_typed_and_told(tmp_path, capsys):
    block = np.zeros((14, 14, 14), np.uint8)
    block[2:12, 2:12, 2:12] = 1
    block[6, 6, :] = 0
    np.save(tmp_path / "block.npy", block)
    assert run(["inspect", str(tmp_path / "block.npy"), "--max-genus", "0", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["taken"]["genus"] == 0
    assert any("a handle closed (--max-genus): 1 voxel filled" in note for note in found["notes"])
