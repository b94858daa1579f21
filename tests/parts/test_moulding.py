import numpy as np
import pytest
from exact_shapes import decomposed, potato

from drkid.kit import Finding, PartSet
from drkid.parts import make_parts
from drkid.spec import KitSpec

ROUNDING_DEGREES = 1e-3


def moulded(**spec: object) -> PartSet:
    return make_parts(decomposed(potato(3), 2), KitSpec(process="injection", **spec))


def unmet(parts: PartSet, what: str) -> list[Finding]:
    return [finding for finding in parts.findings if what in finding.what and not finding.is_met]


def test_every_wall_of_a_piece_has_draft_and_none_hides_from_the_mould() -> None:
    """But bevels, for which findings say it."""
    parts = moulded(marks=False, retention="glue")
    upright = {finding.subject for finding in unmet(parts, "draft of side")}
    for part in parts.parts:
        mesh = part.solid.mesh()
        broad = mesh.areas > 1e-6
        normals, middles = mesh.face_normals[broad], mesh.corners[broad].mean(axis=1)
        draft = np.degrees(np.arcsin(np.abs(normals[:, 2])))
        assert draft.min() >= 1.0 - ROUNDING_DEGREES or f"class {part.name}" in upright
        for place in middles[:: max(1, len(middles) // 40)]:
            line = part.solid.body.ray_cast((*place[:2], 50.0), (*place[:2], -50.0))
            assert len(line) <= 2  # in at one face of the mould, out at the other


def test_what_has_no_draft_or_hides_is_named() -> None:
    named = moulded()
    assert {f.subject for f in unmet(named, "draft of")} >= {"marks", "connector"}
    assert [f.available for f in named.findings if "undercut" in f.what] == [named.dimensions.detent_mm]
    assert not unmet(moulded(marks=False, connector="none"), "draft of its")


def test_a_key_s_leaning_pockets_are_undercuts() -> None:
    parts = moulded(connector="box")
    (found,) = (f for f in parts.findings if f.what == "undercut of leaning pockets")
    assert found.available == pytest.approx(0.5, abs=0.5)
    assert found.available > 0
