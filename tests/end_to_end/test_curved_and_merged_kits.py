"""Curved and merged kits written and read back."""

import json

import numpy as np
import pytest

from drkid.pipeline import make_kit
from drkid.spec import KitSpec
from drkid.verification import verify_kit

COMMON = {"faces": 60, "method": "pressure", "classes": 2, "tolerance_percent": 40, "max_iterations": 200}


@pytest.fixture(scope="module", params=["curved", "merged"])
def written(request, potato_file, tmp_path_factory):
    kind = {"patch": "curved", "curved_classes": 3} if request.param == "curved" else {"merge": 2, "mark_depth_mm": 0.4}
    kit = make_kit(potato_file, KitSpec(**COMMON, **kind))
    return kit, kit.write(tmp_path_factory.mktemp("kits") / request.param)


def test_a_written_kit_checks_out(written) -> None:
    failed = [check for check in verify_kit(written[1]).checks if not check.passed]
    assert not failed


def test_the_document_has_what_the_format_says(written) -> None:
    kit, folder = written
    document = json.loads((folder / "kit.json").read_text())
    if kit.spec.merge:
        assert all("face" not in piece and len(piece["faces"]) == 2 for piece in document["pieces"])
        assert {len(piece["corners"]) for piece in document["pieces"]} == {4}
        assert {len(c["edge_lengths"]) for c in document["classes"]} == {4}
        assert len(document["joints"]) == 60 * 3 // 2 - 30
        assert document["metrics"]["merged"]["triangles"] == 60
    else:
        assert [patch["class"] for patch in document["patches"]] == [c["id"] for c in document["classes"]]
        for patch, own in zip(document["patches"], document["classes"], strict=True):
            corners = np.array(own["parts"][0]["corners"])
            apart = np.linalg.norm(np.array(patch["vertices"])[:, None] - corners[None], axis=2)
            assert apart.min(axis=0).max() < 1e-3 or own["parts"][0]["handedness"] == "left"
        assert document["metrics"]["curved"]["surface_curved"]["mean_percent"] > 0


def test_the_same_kit_comes_out_again(written, potato_file) -> None:
    kit, _ = written
    again = make_kit(potato_file, kit.spec)
    for one, other in zip(kit.part_set.parts, again.part_set.parts, strict=True):
        assert other.solid.volume == pytest.approx(one.solid.volume, rel=1e-6)


@pytest.mark.parametrize("size", [{}, {"mean_edge_mm": 60.0}], ids=["found", "mean edge"])
def test_the_tolerance_that_is_asked_is_kept_whatever_the_size(potato_file, size) -> None:
    """Finer processes have finer clearances, from which a size is guessed before it is known, than they have pieces."""
    tolerance = {"merge_tolerance_mm": 1.0, "documents": False}
    spec = KitSpec(**COMMON, **size, **tolerance, merge=2, process="sla", merge_shift_percent=0)
    kit = make_kit(potato_file, spec)
    assert 0.5 < kit.metrics.merged.misfit_max_mm <= 1.0
    assert kit.spec.merge_tolerance_mm <= 1.0 + 1e-9
