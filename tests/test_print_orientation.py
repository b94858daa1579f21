import numpy as np
import pytest

from drkid.mesh import TriMesh
from drkid.print_orientation import print_orientation, widest_bridge_mm
from drkid.solid import Solid


def lying(mesh: TriMesh, longest_bridge_mm: float = np.inf) -> TriMesh:
    return mesh.moved(mesh.vertices @ print_orientation(mesh, longest_bridge_mm).T)


def test_a_pocketed_slab_is_printed_with_its_pocket_up():
    slab = Solid.box([0, 0, 0], [30, 30, 6]) - Solid.box([8, 8, -1], [22, 22, 4])
    mesh = slab.mesh()
    turn = print_orientation(mesh)
    assert turn @ [0, 0, -1] == pytest.approx([0, 0, 1])
    assert widest_bridge_mm(mesh) == pytest.approx(14, abs=0.02)
    assert widest_bridge_mm(mesh.moved(mesh.vertices @ turn.T)) == 0


def test_a_gallery_around_a_foot_bridges_its_own_width_and_not_the_foots() -> None:
    """20 wide around a foot of 12: a free ring that is 4 wide everywhere but in its corners."""
    mushroom = (Solid.box([-6, -6, 0], [6, 6, 5]) + Solid.box([-10, -10, 5], [10, 10, 8])).mesh()
    corner = 8 * np.sqrt(2) / (1 + np.sqrt(2))  # the circle between the corner of the foot and both sides
    assert widest_bridge_mm(mushroom) == pytest.approx(corner, abs=0.02)


def test_patches_that_touch_at_a_vertex_alone_are_two_bridges() -> None:
    """Two square pockets, corner to corner in their roof."""
    pockets = Solid.box([-8, -8, -1], [0, 0, 4]) + Solid.box([0, 0, -1], [8, 8, 4])
    mesh = (Solid.box([-12, -12, 0], [12, 12, 6]) - pockets).mesh()
    assert widest_bridge_mm(mesh) == pytest.approx(8, abs=0.02)


def test_a_bridge_that_is_too_long_goes_before_one_that_leaves_less_free() -> None:
    """A slab with a ring of overhang, wide across but narrow to bridge, on one face, and a deep pocket in the other."""
    slab = Solid.hull([[sign * x, way * x, z] for x, z in ((15, 0), (19, 3)) for sign in (-1, 1) for way in (-1, 1)])
    mesh = (slab - Solid.box([-8, -8, 1], [8, 8, 4])).mesh()
    assert widest_bridge_mm(lying(mesh)) == pytest.approx(16, abs=0.02)
    assert widest_bridge_mm(lying(mesh, 10.0)) < 6
