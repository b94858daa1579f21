import numpy as np
import pytest

from drkid.mesh import Floats, rounded
from drkid.parts.foot import sphere_directions, with_foot
from drkid.print_orientation import free_width_mm, print_orientation
from drkid.solid import Solid

THICKNESS_MM, WALL_MM, LONGEST_MM = 6.0, 1.2, 10.0
NOTHING = np.zeros((0, 3))


SLOPE = np.tan(np.radians(38.0))


def hexagon(radius: float, z: float) -> Floats:
    """(6, 3): its corner on the y axis a little farther out: its own image across x = 0, and no other."""
    angle = np.pi / 2 + np.arange(6) * np.pi / 3
    rim = radius * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    rim[0] *= 1.1
    return rim + np.array([0.0, 0.0, z])


def dome() -> Solid:
    """A shell of six triangles that slope by some 38°, its sides upright to them.

    Lying on a triangle or on a side, it has others that hang free.
    """
    outer = Solid.hull(np.vstack([hexagon(45.0, 0.0), [[0.0, 0.0, 45 * SLOPE]]]))
    inner = Solid.hull(np.vstack([hexagon(35.0, 0.0), [[0.0, 0.0, 35 * SLOPE]]]))
    sides = Solid.hull(np.vstack([hexagon(32.0, 0.0), hexagon(32.0 + 60 * SLOPE, 60.0)]))
    return (outer - inner) & sides


def printed_width_mm(solid: Solid) -> float:
    mesh = rounded(solid.mesh())
    turn: Floats = print_orientation(mesh, LONGEST_MM)
    return free_width_mm(mesh.moved(mesh.vertices @ turn.T))


def test_a_dome_gets_a_foot_to_print_on() -> None:
    shell = dome()
    assert printed_width_mm(shell) > 2 * LONGEST_MM
    footed, depth = with_foot(shell, NOTHING, THICKNESS_MM, WALL_MM, LONGEST_MM)
    assert printed_width_mm(footed) <= LONGEST_MM
    assert 0 < depth <= 0.16 * THICKNESS_MM
    assert 0 < (shell - footed).volume < 0.01 * shell.volume
    assert (footed - shell).volume == pytest.approx(0.0, abs=1e-6)


def test_a_piece_that_is_its_own_mirror_image_stays_so() -> None:
    shell = dome()
    footed, depth = with_foot(shell, NOTHING, THICKNESS_MM, WALL_MM, LONGEST_MM, np.diag([-1.0, 1.0, 1.0, 1.0]))
    assert depth > 0
    assert (footed - footed.mirrored()).volume == pytest.approx(0.0, abs=1e-3)
    assert printed_width_mm(footed) <= LONGEST_MM


def test_the_cut_leaves_a_wall_before_what_is_kept() -> None:
    shell = dome()
    free, _ = with_foot(shell, NOTHING, THICKNESS_MM, WALL_MM, LONGEST_MM)
    cut = (shell - free).mesh().vertices.mean(axis=0)  # amid what that foot took away
    kept, depth = with_foot(shell, cut[None], THICKNESS_MM, WALL_MM, LONGEST_MM)
    assert depth > 0
    assert np.linalg.norm((shell - kept).mesh().vertices - cut, axis=1).min() >= WALL_MM - 1e-6


def test_what_prints_as_it_is_stays_as_it_is() -> None:
    slab = Solid.box([0, 0, 0], [30, 30, 6])
    footed, depth = with_foot(slab, NOTHING, THICKNESS_MM, WALL_MM, LONGEST_MM)
    assert footed is slab
    assert depth == 0


def test_what_no_foot_helps_stays_as_it_is() -> None:
    """A closed room: its ceiling hangs whichever way it lies, but for ways in which none is wider than its bridge."""
    room = Solid.box([-20, -20, -20], [20, 20, 20]) - Solid.box([-16, -16, -16], [16, 16, 16])
    footed, depth = with_foot(room, NOTHING, THICKNESS_MM, WALL_MM, 0.0)
    assert footed is room
    assert depth == 0


def test_directions_are_unit_vectors_all_around() -> None:
    directions = sphere_directions(500)
    assert np.linalg.norm(directions, axis=1) == pytest.approx(np.ones(500))
    assert np.abs(directions.mean(axis=0)).max() < 0.01
    cosine = directions @ directions.T - 2 * np.eye(500)
    assert np.degrees(np.arccos(cosine.max(axis=1))).max() < 12
