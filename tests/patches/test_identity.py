import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from drkid.mesh import TriMesh
from drkid.patches.identity import mirror_corners, relabellings, residuals, shapes, symmetrised
from drkid.patches.outline import outlined


def fan(count: int, seed: int, closed: bool = True) -> TriMesh:
    """Triangles round a point, each rim point at its own height and distance."""
    rng = np.random.default_rng(seed)
    angle = np.arange(count + (not closed)) * 2 * np.pi / (count if closed else 6)
    radius = rng.uniform(0.9, 1.2, len(angle))
    rim = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), rng.uniform(-0.3, 0.3, len(angle))])
    following = (np.arange(count) + 1) % len(angle)
    faces = np.column_stack([np.full(count, len(angle)), np.arange(count), following])
    return TriMesh(np.vstack([rim, [0, 0, 0.4]]), faces)


def both(one: TriMesh, other: TriMesh):
    """The residual of two whole meshes as pieces of one, which lie side by side in it."""
    count = len(one.vertices)
    mesh = TriMesh(np.vstack([one.vertices, other.vertices]), np.vstack([one.faces, other.faces + count]))
    pieces = [
        outlined(mesh, tuple(range(len(one.faces)))),
        outlined(mesh, tuple(range(len(one.faces), len(mesh.faces)))),
    ]
    return residuals(mesh, pieces)


@settings(max_examples=25)
@given(st.integers(5, 7), st.integers(0, 10_000), st.integers(0, 6))
def test_relabelling_and_rigid_motion_change_nothing(count, seed, by) -> None:
    one, rng = fan(count, seed), np.random.default_rng(seed)
    turn = Rotation.random(rng=rng).as_matrix()
    order = [*np.roll(np.arange(count), by % count), count]
    other = TriMesh((one.vertices @ turn.T + rng.normal(size=3))[order], np.argsort(order)[one.faces])
    residual, _ = both(one, other)
    assert residual.max() < 1e-9


@settings(max_examples=25)
@given(st.integers(0, 10_000))
def test_mirror_images_are_told_apart(seed) -> None:
    one = fan(6, seed)
    image = TriMesh(one.vertices * [-1, 1, 1], one.faces[:, ::-1])
    assert both(one, image)[0][0, 1] > 1e-3


@settings(max_examples=25)
@given(st.integers(0, 10_000), st.integers(0, 10_000))
def test_the_residual_is_symmetric(seed, other) -> None:
    residual, _ = both(fan(5, seed), fan(5, other))
    assert residual[0, 1] == pytest.approx(residual[1, 0], rel=1e-6, abs=1e-12)
    assert (residual[0, 1] < 1e-9) == (seed == other)


def test_pieces_of_other_triangles_are_never_alike() -> None:
    assert np.isinf(both(fan(5, 0), fan(6, 0))[0][0, 1])
    assert np.isinf(both(fan(3, 0, closed=False), fan(5, 0))[0][0, 1])


def test_a_part_of_a_star_can_be_laid_in_one_way_and_a_star_in_all() -> None:
    part, star = (outlined(m, tuple(range(len(m.faces)))) for m in (fan(3, 1, closed=False), fan(5, 1)))
    assert relabellings(part, part) == [0]
    assert relabellings(star, star) == [0, 1, 2, 3, 4]


def test_a_regular_star_is_its_own_mirror_image_and_a_crooked_one_is_not() -> None:
    angle = np.arange(5) * 2 * np.pi / 5
    rim = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(5)])
    faces = np.column_stack([np.full(5, 5), np.arange(5), (np.arange(5) + 1) % 5])
    regular = TriMesh(np.vstack([rim, [0, 0, 0.4]]), faces)
    for mesh, found in ((regular, True), (fan(5, 2), False)):
        piece = outlined(mesh, (0, 1, 2, 3, 4))
        assert bool(mirror_corners(piece.points(mesh), piece, 1e-6)) == found


def test_what_is_nearly_its_own_mirror_image_is_made_so() -> None:
    mesh = fan(5, 2)
    piece = outlined(mesh, (0, 1, 2, 3, 4))
    image = (0, 4, 3, 2, 1)
    even = symmetrised(piece.points(mesh), image)
    assert mirror_corners(even, piece, 1e-9) == image


def test_shapes_stand_within_the_tolerance() -> None:
    at = np.array([0.0, 0.9, 1.8, 5.0])
    apart = np.abs(at[:, None] - at[None])
    stands = shapes(apart, 1.0)
    assert len(np.unique(stands)) == 2
    assert (apart[np.arange(4), stands] <= 1.0).all()


@pytest.mark.parametrize("tolerance", [0.0, -1.0])
def test_a_piece_always_stands_for_itself(tolerance) -> None:
    assert shapes(np.full((3, 3), 0.5), tolerance).tolist() == [0, 1, 2]


def test_a_piece_fits_itself_exactly() -> None:
    mesh = fan(6, 1)
    least, turn = both(mesh, mesh)
    assert np.diagonal(least).tolist() == [0.0, 0.0]
    assert np.diagonal(turn).tolist() == [0, 0]
