"""A slice of `benchmarks/fabrication.py`: kits for different processes and connectors, read back and proven."""

import pytest

import drkid
from drkid.verification import verify_kit

KITS = {
    "fdm": {"process": "fdm", "rounds": 20, "faces": 60, "tolerance_percent": 2},
    "sla": {"process": "sla", "classes": 4, "rounds": 20, "tolerance_percent": 1, "connector": "snap"},
    "injection": {
        "process": "injection",
        "rounds": 20,
        "tolerance_percent": 2,
        "bevel_variants": 2,
        "connector": "box",
    },
}


@pytest.mark.parametrize("process", KITS)
def test_kits_of_every_process_fit_and_are_proven_from_their_files(process, tmp_path) -> None:
    spec = drkid.KitSpec.parse({"faces": 60, "fit": True, "documents": False} | KITS[process])
    kit = drkid.make_kit(None, spec)
    found = verify_kit(kit.write(tmp_path / "kit"))
    assert [check.name for check in found.checks if not check.passed] == []
    figures = kit.metrics.assembly
    assert figures is not None
    assert figures.overlap is not None
    assert figures.closure.verdict == "closes"
    assert (figures.overlap.pairs, figures.overlap.swung) == (0, 0)
    assert figures.closure.gaps.p95_mm <= 2 * kit.part_set.dimensions.clearance_mm
    walls = [finding for finding in kit.part_set.findings if "wall between" in finding.what]
    assert walls
    assert all(finding.is_met for finding in walls)
