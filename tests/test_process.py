import json
from pathlib import Path

import pytest

from drkid.errors import SpecError
from drkid.process import PROCESSES
from drkid.spec import KitSpec


def written(folder: Path, text: str) -> str:
    path = folder / "my-printer.toml"
    path.write_text(text)
    return str(path)


def test_an_own_process_goes_into_the_parameters_and_comes_back(tmp_path) -> None:
    spec = KitSpec.parse({"process": written(tmp_path, "based_on = 'sla'\nclearance_mm = 0.3\nrods_mm = [1.2]")})
    assert spec.process == "my-printer"
    assert spec.preset.clearance_mm == 0.3
    assert spec.preset.rods_mm == (1.2,)
    assert spec.preset.min_wall_mm == PROCESSES["sla"].min_wall_mm
    again = KitSpec.parse(json.loads(spec.model_dump_json()))
    assert again.preset == spec.preset


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("clearance_mm = 0.3", ["missing", "based_on"]),
        ("based_on = 'wood'", ["based_on", "fdm", "wood"]),
        ("based_on = 'fdm'\nnozzle = 0.4", ["no nozzle", "clearance_mm"]),
        ("based_on = 'fdm'\nmin_wall_mm = 0", ["min_wall_mm", "thinnest wall", "greater than 0", "0"]),
        ("based_on = fdm", ["cannot be read"]),
    ],
)
def test_what_is_wrong_in_a_process_is_named(tmp_path, text, words) -> None:
    with pytest.raises(SpecError) as caught:
        KitSpec.parse({"process": written(tmp_path, text)})
    for word in words:
        assert word in str(caught.value)


def test_a_process_file_that_is_missing_is_named() -> None:
    with pytest.raises(SpecError, match=r"nowhere\.toml"):
        KitSpec.parse({"process": "nowhere.toml"})
