"""Tips of merged pieces: cut where they meet, by no more than that."""

import numpy as np
import pytest
from exact_shapes import decomposed, icosahedron
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from drkid.kit import WALL, MergedPiece
from drkid.mesh import TriMesh
from drkid.parts import make_parts
from drkid.parts.merged_truncation import tips_cut
from drkid.patches import make_patches
from drkid.rigid_fit import rigid_fit
from drkid.solid import Solid
from drkid.spec import KitSpec
from drkid.wall_thickness import thinnest_wall_mm


def nothing() -> Solid:
    return Solid.union([])


def dented(seed: int) -> TriMesh:
    """An icosahedron whose corners lie nearer or farther at random."""
    ball = icosahedron()
    return ball.moved(ball.vertices * (1 + 0.1 * np.random.default_rng(seed).standard_normal((12, 1))))


@settings(max_examples=3, phases=[Phase.generate])
@given(st.integers(0, 30), st.sampled_from([2, 5]))
def test_no_two_merged_pieces_share_anything_and_walls_stay(seed, merge) -> None:
    d, spec = decomposed(dented(seed)), KitSpec(merge=merge, size_mm=160, process="sla")
    patches = make_patches(d, d.mesh, spec)
    assert patches is not None
    parts = make_parts(d, spec, patches=patches)
    mesh = patches.decomposition.mesh.scaled(parts.scale_mm_per_unit)
    placed = [
        parts.parts[p.class_index].solid.moved(
            rigid_fit(parts.parts[p.class_index].corners, mesh.vertices[list(p.vertices)])
        )
        for p in parts.merged
    ]
    boxes = np.stack([solid.bounds for solid in placed])
    for a in range(len(placed)):
        for b in range(a + 1, len(placed)):
            if (boxes[a, 0] <= boxes[b, 1]).all() and (boxes[b, 0] <= boxes[a, 1]).all():
                assert (placed[a] & placed[b]).volume < 1e-5
    walls = [finding for finding in parts.findings if finding.what == WALL]
    assert len(walls) == len(parts.parts)
    assert all(finding.is_met for finding in walls)


@pytest.mark.parametrize(("together", "lost"), [(True, 5.0), (False, 0.0)])
def test_only_tips_of_pieces_with_a_vertex_in_common_are_cut(together, lost) -> None:
    """Two plates whose corners reach half a millimetre into one another."""
    plates = [Solid.box((0, 0, -1), (10, 10, 1)), Solid.box((-9.5, -9.5, -1), (0.5, 0.5, 1))]
    corners = [np.array([[0.0, 0, 0], [10, 0, 0], [0, 10, 0]]), np.array([[0.0, 0, 0], [-10, 0, 0], [0, -10, 0]])]
    mesh = TriMesh(np.vstack(corners), np.array([[0, 1, 2], [3, 4, 5]]))
    pieces = (MergedPiece((0,), 0, (0, 1, 2)), MergedPiece((1,), 1, (0 if together else 3, 4, 5)))
    cut = tips_cut(plates, corners, pieces, mesh, [(), ()], 0.2, [nothing(), nothing()])
    assert [plate.volume - one.volume < lost + 1e-9 for plate, one in zip(plates, cut, strict=True)] == [True, True]
    assert cut[0].gap(cut[1], 1.0) == pytest.approx(0.6 if together else 0.0, abs=1e-6)


WEDGE = np.array([[0.0, 0, 0], [20, -8, 0], [20, 8, 0]])
SHEET = np.array([[0.0, 0, 0], [-10, 5, 0], [-10, -5, 0]])


def thick(corners: np.ndarray, up: np.ndarray, low: float, high: float) -> Solid:
    return Solid.hull(np.vstack([corners + low * up, corners + high * up]))


def parted(room: Solid) -> tuple[Solid, Solid, Solid]:
    """A thick wedge, and that and a thin sheet cut where its tip and the sheet meet, far above the middle."""
    up = np.array([0.0, 0.0, 1.0])
    wedge, sheet = thick(WEDGE, up, -3, 3), thick(SHEET + np.array([1.0, 0, 0]), up, 1, 1.5)
    mesh = TriMesh(np.vstack([WEDGE, SHEET[1:]]), np.array([[0, 1, 2], [0, 3, 4]]))
    pieces = (MergedPiece((0,), 0, (0, 1, 2)), MergedPiece((1,), 1, (0, 3, 4)))
    cut = tips_cut([wedge, sheet], [WEDGE, SHEET], pieces, mesh, [(), ()], 0.2, [room, nothing()])
    return wedge, cut[0], cut[1]


def test_nothing_thin_is_left_of_a_tip_that_meets_another_in_part_of_its_height() -> None:
    """The tip goes from top to bottom."""
    _, wedge, sheet = parted(nothing())
    assert wedge.gap(sheet, 1.0) == pytest.approx(0.6)
    assert thinnest_wall_mm(wedge.mesh()) == pytest.approx(6.0)


def test_pockets_keep_their_room_where_the_other_piece_can_give_way() -> None:
    room = Solid.box((0.6, -1, -3), (5, 1, 3))
    wedge, plain, _ = parted(nothing())
    _, cut, sheet = parted(room)
    assert (wedge & room).volume - (plain & room).volume > 1e-3
    assert (wedge & room).volume == pytest.approx((cut & room).volume)
    assert cut.gap(sheet, 1.0) == pytest.approx(0.6)


def test_what_is_cut_of_a_shape_is_cut_of_its_mirror_image_too() -> None:
    """Of a kite whose mirror plane is none of its frame's planes."""
    turn = np.linalg.qr(np.array([[1.0, 2, 3], [0, 1, 4], [5, 6, 0]]))[0]
    kite = np.array([[-10.0, 0, 0], [0, -6, 0], [14, 0, 0], [0, 6, 0]]) @ turn.T
    wedge = np.array([[0.0, -6, 0], [-3, -16, 0], [3, -16, 0]]) @ turn.T
    plate = thick(kite, turn[:, 2], -2, 2)
    block = thick(wedge + 0.5 * turn[:, 1], turn[:, 2], -2, 2)
    mesh = TriMesh(np.vstack([kite, wedge[1:]]), np.array([[0, 1, 2], [0, 2, 3], [1, 4, 5]]))
    pieces = (MergedPiece((0, 1), 0, (0, 1, 2, 3)), MergedPiece((2,), 1, (1, 4, 5)))
    mirror = [(0, 3, 2, 1), ()]
    cut = tips_cut([plate, block], [kite, wedge], pieces, mesh, mirror, 0.2, [nothing(), nothing()])[0]
    flip = np.eye(4)
    flip[:3, :3] -= 2 * np.outer(turn[:, 1], turn[:, 1])
    assert plate.volume - cut.volume > 1e-3
    assert (cut - cut.moved(flip)).volume == pytest.approx(0.0, abs=1e-6)
