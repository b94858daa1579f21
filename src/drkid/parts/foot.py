"""Foot: a small flat cut off the rim of a bent piece, on which it prints without supports.

A piece that bends far lies on no face of its own without another face hanging free. Leaning, on two of its sides or
more, it does: what it then stands on are edges and corners, and a cut makes them a face.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull

from drkid.mesh import Floats, TriMesh, rounded
from drkid.print_orientation import free_width_mm, print_orientation, turned_down
from drkid.solid import Solid

DIRECTIONS = 2000  # tried, 5° apart
DEPTHS = (0.04, 0.08, 0.12, 0.16)  # of the thickness: how much is cut off, the least that serves
LEAST_AREA = 1.0  # of the thickness squared: a smaller foot does not hold on to the bed
IN_PLANE_MM = 1e-6


@dataclass(frozen=True, eq=False)
class Foot:
    """The plane direction·p = level that cuts a foot, the direction (3,) pointing to the bed."""

    direction: Floats
    level: float
    area_mm2: float
    stands: bool


def with_foot(
    piece: Solid,
    kept: Floats,
    thickness_mm: float,
    wall_mm: float,
    longest_bridge_mm: float,
    reflection: Floats | None = None,
) -> tuple[Solid, float]:
    """A piece that prints without supports, and how deep its foot is cut, in mm: 0 where it needs or finds none.

    Of the feet that are cut least, the largest is taken, before others one on which the piece stands by itself.

    Args:
        piece: in its part frame.
        kept: (n, 3) points that stay a wall behind the cut.
        thickness_mm: of the piece: what is cut off is a share of it.
        wall_mm: the thinnest wall.
        longest_bridge_mm: the widest overhang that prints.
        reflection: (4, 4), of a piece that is its own mirror image, and stays so: the foot is then cut on both sides.
    """
    mesh = rounded(piece.mesh())
    if _printed_width_mm(mesh, longest_bridge_mm) <= longest_bridge_mm:
        return piece, 0.0
    least_mm2 = LEAST_AREA * thickness_mm**2
    directions = _broad(mesh, sphere_directions(DIRECTIONS), DEPTHS[-1] * thickness_mm, thickness_mm)
    most_cut = _feet(piece, mesh, directions, DEPTHS[-1] * thickness_mm, least_mm2)
    directions = np.array([f.direction for f in most_cut if _width_mm(mesh, f.direction) <= longest_bridge_mm])
    for depth in (share * thickness_mm for share in DEPTHS):
        for foot in _feet(piece, mesh, directions.reshape(-1, 3), depth, least_mm2):
            if (kept @ foot.direction).max(initial=-np.inf) > foot.level - wall_mm:
                continue
            footed = _cut(piece, foot, reflection)
            if _printed_width_mm(rounded(footed.mesh()), longest_bridge_mm) <= longest_bridge_mm:
                return footed, depth
    return piece, 0.0


def _broad(mesh: TriMesh, directions: Floats, depth_mm: float, breadth_mm: float) -> Floats:
    """Those of the directions (n, 3) in which corners lie within a depth of the farthest, but not beside it."""
    reach = mesh.vertices @ directions.T
    farthest = mesh.vertices[reach.argmax(axis=0)]
    beside = np.linalg.norm(mesh.vertices[:, None] - farthest, axis=2) < breadth_mm
    return directions[((reach > reach.max(axis=0) - depth_mm) & ~beside).any(axis=0)]


def _feet(piece: Solid, mesh: TriMesh, directions: Floats, depth_mm: float, least_mm2: float) -> list[Foot]:
    """The feet of one depth that are large enough: those it stands on by itself first, then the largest."""
    levels = (mesh.vertices @ directions.T).max(axis=0, initial=-np.inf) - depth_mm
    centre = _centre_of_mass(mesh)
    found: list[Foot] = []
    for direction, level in zip(directions, levels.tolist(), strict=True):
        cap = piece.beyond(direction, level).mesh()
        bottom = (np.abs(cap.corners @ direction - level) < IN_PLANE_MM).all(axis=1)
        area = float(cap.areas[bottom].sum())
        if area >= least_mm2:
            turn = turned_down(direction)
            flat = (cap.corners[bottom].reshape(-1, 3) @ turn.T)[:, :2]
            found.append(Foot(direction, level, area, _inside(flat, (turn @ centre)[:2])))
    return sorted(found, key=lambda foot: (not foot.stands, -foot.area_mm2))


def _cut(piece: Solid, foot: Foot, reflection: Floats | None) -> Solid:
    piece = piece.beyond(-foot.direction, -foot.level)
    if reflection is not None:
        direction = reflection[:3, :3] @ foot.direction
        piece = piece.beyond(-direction, -foot.level - float(direction @ reflection[:3, 3]))
    return piece.without_needles()


def _width_mm(mesh: TriMesh, direction: Floats) -> float:
    return free_width_mm(mesh.moved(mesh.vertices @ turned_down(direction).T))


def _printed_width_mm(mesh: TriMesh, longest_bridge_mm: float) -> float:
    turn = print_orientation(mesh, longest_bridge_mm)
    return free_width_mm(mesh.moved(mesh.vertices @ turn.T))


def sphere_directions(count: int) -> Floats:
    """(count, 3): unit vectors spread evenly over the sphere (Fibonacci lattice; Swinbank and Purser 2006)."""
    z = 1 - (2 * np.arange(count) + 1) / count
    angle = np.pi * (1 + np.sqrt(5)) * np.arange(count)
    return np.stack([np.sqrt(1 - z**2) * np.cos(angle), np.sqrt(1 - z**2) * np.sin(angle), z], axis=1)


def _centre_of_mass(mesh: TriMesh) -> Floats:
    """(3,): by the tetrahedra from the origin to every face."""
    six_volumes = np.linalg.det(mesh.corners)
    return six_volumes @ mesh.corners.sum(axis=1) / (4 * six_volumes.sum())


def _inside(points: Floats, point: Floats) -> bool:
    """Whether a point (2,) lies in the convex hull of points (n, 2), which are not all on one line."""
    equations = ConvexHull(points).equations
    return bool((equations[:, :2] @ point + equations[:, 2] <= 0).all())
