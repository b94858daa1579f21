"""Every script in examples/ runs, and what it says holds."""

import json
from pathlib import Path

import pytest
from conftest import REPOSITORY
from scripts import load_script

EXAMPLES = REPOSITORY / "examples"


def test_every_example_is_run_here():
    tested = {name.removeprefix("test_") for name in globals() if name.startswith("test_")}
    assert {path.stem for path in EXAMPLES.glob("*.py")} <= tested


@pytest.fixture(scope="module")
def written_kit(tmp_path_factory):
    folder = tmp_path_factory.mktemp("examples") / "kit"
    return load_script(EXAMPLES / "first_kit.py").main(str(folder), faces=80, rounds=1), folder


def test_first_kit(written_kit):
    kit, folder = written_kit
    document = json.loads((folder / "kit.json").read_text())
    assert sum(one["count"] for one in document["classes"]) == kit.metrics.pieces == 80
    assert len(kit.part_set.parts) == 2


def test_classes_and_error(capsys):
    few, many = load_script(EXAMPLES / "classes_and_error.py").main(classes=(1, 12), faces=80, iterations=300)
    assert many.metrics.error_max_percent < few.metrics.error_max_percent
    assert len(capsys.readouterr().out.splitlines()) == 3


def test_processes(capsys):
    kits = load_script(EXAMPLES / "processes.py").main(faces=60, rounds=0)
    assert kits["sla"].spec.size_mm < kits["fdm"].spec.size_mm
    said = capsys.readouterr().out
    assert all(f"{kit.spec.size_mm:.0f}" in said for kit in kits.values())


def test_density_map():
    _otsu, low, middle, high = load_script(EXAMPLES / "density_map.py").main()
    assert low > middle > high > 0


def test_convergence_plot(written_kit, tmp_path):
    pytest.importorskip("matplotlib", reason="needs the extra figures")
    picture = load_script(EXAMPLES / "convergence_plot.py").main(str(written_kit[1]), str(tmp_path / "plot.png"))
    assert Path(picture).read_bytes().startswith(b"\x89PNG")
