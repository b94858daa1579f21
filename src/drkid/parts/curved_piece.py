"""Curved piece: a patch with thickness, bevelled by the same planes as a flat one, with housings for its pockets.

The hinge axes stay on the chords, the sides of the class triangle: the boundary curve leaves them by its sagitta, and
two pieces still turn about one straight line. As the planes of the bevels also run through the chords, what keeps flat
pieces apart at every bend keeps curved ones apart too.
"""

from collections.abc import Callable

import numpy as np

from drkid.class_triangle import inward_normals
from drkid.curved_patch import CurvedPatch, barycentric_grid
from drkid.kit import Dimensions
from drkid.mesh import Floats, TriMesh
from drkid.parts.pocket import deepest_height_mm, depth_mm, flare_mm, side_frames
from drkid.parts.prismoid import Prismoid, bevelled
from drkid.solid import Solid

NEWTON_STEPS = 12
STEP_MM = 1e-4  # of the numerical derivatives
LEFT_AROUND_HOUSING_MM = 0.1  # housings end behind the bevels, so that no two faces coincide
FOOTPRINT_POINTS = 9  # in either direction, at which heights over a pocket are taken


def raised(prismoid: Prismoid, triangle: Floats, patch: CurvedPatch) -> Prismoid:
    """The flat piece's bevels made steep enough for skins that rise and dip at its sides.

    A bevel that serves all bends at the lowest and at the highest point of a side serves them at every height
    between. From t/2 to h a joint that cuts away asks for d·h/(t/2), one that adds for no more than d.
    """
    half, insets = prismoid.thickness_mm / 2, prismoid.insets(triangle)
    shares = np.linspace(0, 1, FOOTPRINT_POINTS)
    reach = np.empty((2, 3))
    for side, inward in enumerate(inward_normals(triangle)):
        line = triangle[side] + shares[:, None] * (triangle[(side + 1) % 3] - triangle[side])
        heights = np.stack(
            [patch.points(_barycentric(triangle, line + at * inward))[:, 2] for at in (0.0, *insets[:, side])]
        )
        reach[:, side] = half - min(float(heights.min()), 0.0), half + max(float(heights.max()), 0.0)
    wanted = np.where(insets > 0, insets * reach / half, insets)
    slope = (wanted[1] - wanted[0]) / reach.sum(axis=0)
    middle = wanted[0] + slope * reach[0]
    middle += np.maximum(-middle, 0.0)
    return bevelled(triangle, np.stack([middle - slope * half, middle + slope * half]), prismoid.thickness_mm)


def needed_thickness_mm(triangle: Floats, patch: CurvedPatch, dimensions: Dimensions) -> float:
    """The thickness at which every pocket keeps its roof where the patch dips under its triangle; 0 without pockets."""
    d = dimensions
    if d.connector == "none":
        return 0.0
    wall = d.min_wall_mm
    half = _half_housing_mm(d)
    x = np.linspace(-half, half, FOOTPRINT_POINTS)
    y = np.linspace(0.0, d.pocket_depth_mm + wall, FOOTPRINT_POINTS)
    local = np.stack([*np.meshgrid(x, y), np.zeros((len(y), len(x))), np.ones((len(y), len(x)))], axis=-1)
    points = np.einsum("sij,yxj->syxi", side_frames(triangle, dimensions.key_bend_degrees / 2), local)[..., :2].reshape(
        -1, 2
    )
    lowest = float(patch.points(_barycentric(triangle, points))[:, 2].min())
    return d.pocket_height_mm + 2 * wall - 2 * min(lowest, 0.0)


def curved_solid(
    triangle: Floats, patch: CurvedPatch, prismoid: Prismoid, dimensions: Dimensions, levels: int
) -> Solid:
    """The piece before its pockets are cut: the shell and, inside of it, what is needed around the pockets."""
    shell = Solid.of(shell_mesh(triangle, patch, prismoid, levels))
    if dimensions.connector == "none":
        return shell
    insets = prismoid.insets(triangle) + LEFT_AROUND_HOUSING_MM
    room = bevelled(triangle, insets, dimensions.thickness_mm).solid
    housing = _housing(dimensions)
    for frame in side_frames(triangle, dimensions.key_bend_degrees / 2):
        shell = shell + (housing.moved(frame) & room)
    return shell


def _housing(dimensions: Dimensions) -> Solid:
    """The walls of a pocket down to where the inner face of a flat piece would be, in connector coordinates."""
    d = dimensions
    half, floor = _half_housing_mm(d), depth_mm(d, deepest_height_mm(d)) + d.min_wall_mm
    return Solid.box((-half, -d.thickness_mm, -d.thickness_mm / 2), (half, floor, d.pocket_height_mm / 2))


def _half_housing_mm(d: Dimensions) -> float:
    """Half the width of a housing: a wall behind the grooves, where the pocket is widest."""
    return d.pocket_width_mm / 2 + flare_mm(d, -d.thickness_mm / 2) + d.detent_mm + d.min_wall_mm


def shell_mesh(triangle: Floats, patch: CurvedPatch, prismoid: Prismoid, levels: int) -> TriMesh:
    """The two skins, each half the thickness along the patch's normal from it, joined by quad strips in the bevels."""
    grid = barycentric_grid(levels)
    planes = _bevel_planes(triangle, prismoid)
    skins = [_skin(triangle, patch, planes, height, levels) for height in prismoid.heights_mm]
    count = len(grid.points)
    faces = [grid.faces[:, ::-1], grid.faces + count]
    for side in grid.sides:
        a, b = side[:-1], side[1:]
        faces += [np.stack([a, b, b + count], axis=1), np.stack([a, b + count, a + count], axis=1)]
    return TriMesh(np.vstack(skins), np.vstack(faces))


def _bevel_planes(triangle: Floats, prismoid: Prismoid) -> tuple[Floats, Floats]:
    """Normals (3, 3) and levels (3,): side i's bevel is where normal·p = level."""
    inward = inward_normals(triangle)
    inner, outer = prismoid.insets(triangle)
    slope = (outer - inner) / prismoid.thickness_mm
    level = np.einsum("sk,sk->s", inward, triangle) + (inner + outer) / 2
    return np.column_stack([inward, -slope]), level


def _skin(triangle: Floats, patch: CurvedPatch, planes: tuple[Floats, Floats], height_mm: float, levels: int) -> Floats:
    """(n, 3): the grid on the surface at a height over the patch, its sides in the planes of the bevels."""
    grid, inward = barycentric_grid(levels), inward_normals(triangle)

    def at(plan: Floats) -> Floats:
        b = _barycentric(triangle, plan)
        return patch.points(b) + height_mm * patch.normals(b)

    def beyond(plan: Floats, side: int) -> Floats:
        return at(plan) @ planes[0][side] - planes[1][side]

    corners = np.stack([_corner(triangle, beyond, i) for i in range(3)])
    plan = grid.points @ corners
    for side in range(3):
        shares = np.linspace(0, 1, 2**levels + 1)
        line = corners[side] + shares[:, None] * (corners[(side + 1) % 3] - corners[side])
        depth = np.zeros(len(shares))
        for _ in range(NEWTON_STEPS):
            value = beyond(line + depth[:, None] * inward[side], side)
            ahead = beyond(line + (depth + STEP_MM)[:, None] * inward[side], side)
            depth -= value * STEP_MM / (ahead - value)
        a, b, c = grid.points[:, side], grid.points[:, (side + 1) % 3], grid.points[:, (side + 2) % 3]
        along = np.divide(b, a + b, out=np.zeros_like(b), where=a + b > 0)
        plan = plan + ((1 - c) * np.interp(along, shares, depth))[:, None] * inward[side]
    return at(plan)


def _corner(triangle: Floats, beyond: Callable[[Floats, int], Floats], corner: int) -> Floats:
    """(2,): where in plan the bevels of the two sides at a corner meet on a skin, by Newton's method."""
    sides = ((corner - 1) % 3, corner)
    plan = triangle[corner][None].copy()
    for _ in range(NEWTON_STEPS):
        steps = plan + STEP_MM * np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
        values = np.stack([beyond(steps, s) for s in sides])
        jacobian = (values[:, 1:] - values[:, :1]) / STEP_MM
        plan = plan - np.linalg.solve(jacobian, values[:, 0])
    return plan[0]


def _barycentric(triangle: Floats, points: Floats) -> Floats:
    """(n, 3): barycentric coordinates of points (n, 2) of the plane."""
    a, b, c = triangle
    rest = np.linalg.solve(np.stack([b - a, c - a], axis=1), (points - a).T).T
    return np.column_stack([1 - rest.sum(axis=1), rest])
