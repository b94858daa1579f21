from dataclasses import replace
from pathlib import Path

import pytest

from drkid.kit import Rigidity
from drkid.terminal import show_kit


@pytest.mark.parametrize(
    ("rigidity", "row"),
    [
        (None, "not measured"),
        (Rigidity("stiff", 0.2, 91.2, 9.0), "stiff: 91 % of a round shell's stiffness"),
        (Rigidity("soft", 0.01, 3.3, 40.0, 1.0, 0.01), "soft: 3.3 % of a round shell's stiffness"),
        (
            Rigidity("may snap through", 0.03, 12.4, 20.0, 15.0, 0.2, 30.0),
            "may snap through: 12 % of a round shell's stiffness, a second state 12 mm away behind 0.08 mm of play",
        ),
    ],
)
def test_the_row_of_the_rigidity_is_in_millimetres_of_the_print(kit, rigidity, row, capsys):
    shown = replace(kit, metrics=replace(kit.metrics, rigidity=rigidity, mean_edge=40.0))
    show_kit(shown, Path("kit"), 1.0)
    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith("rigidity")]
    assert [line.removeprefix("rigidity").strip() for line in lines] == [row]
