import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drkid.mesh import TriMesh
from drkid.solid import CIRCLE_SEGMENTS, Solid, circle_outside, widest_circle_mm

CUBE = Solid.box((0, 0, 0), (1, 1, 1))


def shifted(solid: Solid, x: float, y: float = 0.0, z: float = 0.0) -> Solid:
    motion = np.eye(4)
    motion[:3, 3] = x, y, z
    return solid.moved(motion)


@given(st.floats(0.05, 0.95))
def test_union_difference_and_intersection_share_the_volume_out(x: float) -> None:
    other = shifted(CUBE, x, 0.1, 0.1)
    shared = (CUBE & other).volume
    assert shared == pytest.approx((1 - x) * 0.81)
    assert (CUBE + other).volume == pytest.approx(2 - shared)
    assert (CUBE - other).volume == pytest.approx(1 - shared)
    assert CUBE.minus_all([other, shifted(CUBE, -x, 0.1, 0.1)]).volume <= 1 - shared + 1e-12


def test_solids_apart_have_nothing_in_common_and_know_their_gap() -> None:
    other = shifted(CUBE, 1.5)
    assert (CUBE & other).is_empty
    assert CUBE.gap(other, 2.0) == pytest.approx(0.5)
    assert CUBE.gap(other, 0.25) == 0.25


def test_mesh_of_a_solid_makes_the_same_solid() -> None:
    ring = Solid.cylinder_along_x(2, 0, 1) - Solid.cylinder_along_x(1, -1, 2)
    mesh = ring.mesh()
    assert mesh.is_closed_manifold
    assert mesh.genus == 1
    assert mesh.volume == pytest.approx(ring.volume)
    assert Solid.of(mesh).volume == pytest.approx(ring.volume)


def test_open_mesh_is_refused() -> None:
    with pytest.raises(ValueError, match="not a manifold"):
        Solid.of(TriMesh(np.eye(3), np.array([[0, 1, 2]])))


@given(st.floats(0.1, 10))
def test_cylinder_is_nowhere_inside_its_circle(radius: float) -> None:
    outline = circle_outside(radius)
    middles = (outline + np.roll(outline, 1, axis=0)) / 2
    assert len(outline) == CIRCLE_SEGMENTS
    assert np.linalg.norm(middles, axis=1) == pytest.approx(radius)
    cylinder = Solid.cylinder_along_x(radius, -1, 3)
    assert cylinder.bounds[:, 0] == pytest.approx([-1, 3])
    assert cylinder.bounds[:, 2] == pytest.approx([-radius, radius])
    assert 0 < cylinder.volume / (4 * np.pi * radius**2) - 1 < 0.002


def test_mirroring_keeps_the_volume_positive() -> None:
    corner = Solid.hull([[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]])
    mirrored = corner.moved(np.diag([-1.0, 1, 1, 1]))
    assert mirrored.volume == pytest.approx(1.0)
    assert mirrored.bounds == pytest.approx(np.array([[-1, 0, 0], [0, 2, 3]]))


def test_cross_section_has_the_area_of_the_cut() -> None:
    (square,) = shifted(CUBE, 3.0).cross_section(0.5)
    x, y = square.T
    assert (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2 == pytest.approx(1.0)
    assert square.min(axis=0) == pytest.approx([3, 0])
    assert list(CUBE.cross_section(2.0)) == []


def test_widest_circle_of_a_union() -> None:
    left = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 6.0], [0.0, 6.0]])
    assert widest_circle_mm(left[None]) == pytest.approx(4, abs=0.02)
    assert widest_circle_mm(np.stack([left, left + np.array([3.0, 0.0])])) == pytest.approx(6, abs=0.02)
    assert widest_circle_mm(np.stack([left, left + np.array([5.0, 0.0])])) == pytest.approx(4, abs=0.02)


@pytest.mark.parametrize("off", [1e-5, 3e-5])
def test_corners_that_nearly_coincide_become_one(off) -> None:
    """A corner cut by planes that nearly meet in it: three edges of `off`, which single precision would fold over."""
    box = Solid.box((0, 0, 0), (20, 20, 20))
    cut = box.beyond(np.array([-1.0, -1.0, -1.0]), -(60 - off))
    clean = cut.without_needles()
    assert len(cut.mesh().vertices) == 10
    assert len(clean.mesh().vertices) == 8
    assert clean.volume == pytest.approx(box.volume, rel=1e-6)
    assert box.without_needles() is box


def flattest(solid: Solid) -> float:
    """Of all faces the least distance of a corner from the longest side."""
    mesh = solid.mesh()
    return float((2 * mesh.areas / mesh.side_lengths.max(axis=1)).min())


@pytest.mark.parametrize("off", [1e-6, 4e-5])
def test_no_corner_lies_on_the_side_opposite(off) -> None:
    """A tetrahedron with a fifth corner so near to one of its edges that single precision may take it across."""
    corners = np.array([[0.0, 0, 0], [30, 0, 0], [10, 20, 0], [12, 7, 25], [15, off, 0]])
    faces = np.array([[0, 2, 4], [4, 2, 1], [0, 4, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    flat = Solid.of(TriMesh(corners, faces))
    clean = flat.without_needles()
    assert flattest(flat) < 2 * off
    assert flattest(clean) > 1
    assert clean.mesh().is_closed_manifold
    assert clean.volume == pytest.approx(flat.volume, abs=1e-2)
