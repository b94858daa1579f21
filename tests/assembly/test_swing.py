import numpy as np
import pytest
from exact_shapes import decomposed, geodesic, icosahedron, potato

from drkid.assembly import assemble
from drkid.assembly.swing import sectors
from drkid.kit import Assembly, AssemblyFigures
from drkid.parts import make_parts
from drkid.spec import KitSpec


def assembly(mesh, connector="none", **values) -> Assembly:
    spec = KitSpec(connector=connector, **values)
    d = decomposed(mesh)
    parts = make_parts(d, spec)
    return assemble(d.mesh.scaled(parts.scale_mm_per_unit), parts, spec=spec)


def figures(mesh, **values) -> AssemblyFigures:
    return assembly(mesh, **values).figures


@pytest.mark.parametrize("degrees", [0.0, 5.5, 12.0])
@pytest.mark.parametrize("mesh", [icosahedron(), geodesic(), potato(1, 0.03)])
def test_bevels_leave_the_swing_that_they_were_made_for(mesh, degrees) -> None:
    found = figures(mesh, swing_degrees=degrees).swing
    assert found.wanted_degrees == degrees
    assert found.inward_degrees == pytest.approx(degrees, abs=0.01)
    assert found.outward_degrees >= degrees - 0.01
    assert found.blocked == 0


def test_straight_sides_touch_where_they_lie() -> None:
    """Two upright sides at a bend δ reach into one another inside: 180° − δ is less than their two right angles."""
    found = figures(icosahedron(), thickening="perpendicular").swing
    assert found.inward_degrees == pytest.approx(-41.81, abs=0.01)
    assert found.outward_degrees == pytest.approx(41.81, abs=0.01)
    assert found.blocked == 30


def test_keys_that_lean_leave_bevels_the_room_that_they_have_without() -> None:
    """And no note tells how far what is rigid turns, be it made to touch."""
    for thickening in ("bisector", "perpendicular"):
        plain, keyed = (
            assembly(icosahedron(), connector, size_mm=90, thickness_mm=6, thickening=thickening)
            for connector in ("none", "box")
        )
        one, other = plain.figures.swing, keyed.figures.swing
        assert other.inward_degrees == pytest.approx(one.inward_degrees, abs=0.01)
        assert other.outward_degrees == pytest.approx(one.outward_degrees, abs=0.01)
        assert other.blocked == one.blocked
    assert any("may turn by less than" in note for note in plain.notes)
    assert not any("turn" in note for note in keyed.notes)


def test_sectors_are_the_angles_of_the_outermost_corners() -> None:
    points = np.array([[0.0, 1.0, 1.0], [0.0, 1.0, -2.0], [3.0, 9.0, 1.0], [3.0, 9.0, -2.0], [1.0, 0.0, 0.0]])
    assert np.degrees(sectors(points, np.eye(4))) == pytest.approx([45.0, 63.4349], abs=1e-4)
