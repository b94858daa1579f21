"""Curved piece: a curved outer face over the flat inner face, the bevels and the pockets of a flat piece.

The hinge axes stay on the chords, the sides of the class triangle: the boundary curve leaves them by its sagitta, and
two pieces still turn about one straight line. Above the flat piece's outer face its bevels are carried on in planes
through the chords: what keeps flat pieces apart at every bend, the swing with it, keeps curved ones apart too. The
outer face lies half the thickness over the patch, and all of a kit's by one lift more, where a patch dips so far under
its triangle that a pocket would lose its roof. A curved piece therefore finds room where the flat one does; where its
outer face does not, its patch is flattened.
"""

import numpy as np
from scipy.spatial import ConvexHull

from drkid.class_triangle import following, inward_normals, symmetries
from drkid.curved_patch import CurvedPatch, barycentric_grid, gradients
from drkid.kit import Dimensions
from drkid.mesh import Floats, Ints, TriMesh
from drkid.parts.fit import Margin, inradius
from drkid.parts.pocket import depth_mm, flare_mm, side_frames
from drkid.parts.prismoid import FROM_AXIS, Prismoid
from drkid.solid import Solid

FOOTPRINT_POINTS = 9  # in either direction, at which heights over a pocket are taken
LEAST_PLATE_WALLS = 2.0  # thickness of a piece where its patch dips most, in minimum walls
SKIRT_MM = 1.0  # beyond what stands out of the triangle; the bevels cut it away
UPRIGHT = 1e-6  # of a unit normal: facets that lean by less are the two faces
SAME_PLANE = 1e-7
STEEPEST_COSINE = 0.5  # the outer face of patches that lean more lies no higher over them than at 60°
SAME_MM = 1e-6  # between a patch and its mirror image: far below what any process can print
SHARES = np.linspace(1, 0, 21)  # of a patch's height, tried from all of it to none


def needed_lift_mm(triangle: Floats, patch: CurvedPatch, dimensions: Dimensions) -> float:
    """How much higher than half the thickness over the patch the outer face must lie.

    Every pocket then keeps its roof, and the piece is a plate `LEAST_PLATE_WALLS` thick at least.
    """
    d, half = dimensions, dimensions.thickness_mm / 2
    inside = patch.points(barycentric_grid(3).points)[:, 2]
    lacking = [LEAST_PLATE_WALLS * d.min_wall_mm - d.thickness_mm - float(inside.min())]
    if d.connector != "none":
        over = patch.points(_barycentric(triangle, _footprints(triangle, d)))[:, 2]
        lacking.append(d.pocket_height_mm / 2 + d.min_wall_mm - half - float(over.min()))
    return max(0.0, *lacking)


def _footprints(triangle: Floats, d: Dimensions) -> Floats:
    """(n, 2): places over the pockets' roofs and the walls around them."""
    roof = d.pocket_height_mm / 2
    half = d.pocket_width_mm / 2 + flare_mm(d, roof) + d.min_wall_mm
    x, y = np.meshgrid(
        np.linspace(-half, half, FOOTPRINT_POINTS),
        np.linspace(0.0, depth_mm(d, roof) + d.min_wall_mm, FOOTPRINT_POINTS),
    )
    local = np.stack([x, y, np.zeros_like(x), np.ones_like(x)], axis=-1)
    frames = side_frames(triangle, d.key_bend_degrees / 2)
    return np.einsum("sij,yxj->syxi", frames, local)[..., :2].reshape(-1, 2)


def is_own_mirror_image(lengths: Floats, patch: CurvedPatch) -> bool:
    """Whether a reflection of the triangle of side `lengths` (3,), in mm, carries the patch onto itself."""
    at = barycentric_grid(2).points
    points, image = patch.points(at), np.empty_like(at)
    for permutation, matrix in symmetries(lengths):
        image[:, list(permutation)] = at
        apart = patch.points(image) - np.column_stack([points[:, :2] @ matrix.T, points[:, 2]])
        if np.linalg.det(matrix) < 0 and np.abs(apart).max() < SAME_MM:
            return True
    return False


def outer_margin(triangle: Floats, prismoid: Prismoid, patch: CurvedPatch, lift_mm: float, wall_mm: float) -> Margin:
    """What the bevels leave of the outer face where its sides stand highest."""
    sides = np.concatenate([barycentric_grid(3).points[side] for side in barycentric_grid(3).sides])
    highest = prismoid.thickness_mm / 2 + lift_mm + max(float(patch.points(sides)[:, 2].max()), 0.0)
    outline = prismoid.outline(highest)
    if prismoid.is_ridged:
        low = FROM_AXIS * prismoid.thickness_mm / 2
        outline = triangle + (prismoid.outline(low) - triangle) * highest / low
    return Margin("inscribed radius of the curved face", wall_mm, inradius(triangle, outline))


def curved_solid(triangle: Floats, patch: CurvedPatch, prismoid: Prismoid, lift_mm: float, levels: int) -> Solid:
    """The piece before its pockets are cut: what is under the outer face, cut by the flat piece's planes."""
    normals, offsets = _side_planes(triangle, prismoid)
    half = prismoid.thickness_mm / 2
    top = half + lift_mm + max(float(patch.points(barycentric_grid(levels).points)[:, 2].max()), 0.0)
    outline = np.concatenate([prismoid.outline(height) for height in (-half, 0.0, half, top)])
    out = max(-float(((outline[:, None] - triangle) * inward_normals(triangle)).sum(axis=2).min()), 0.0)
    solid = Solid.of(block_mesh(triangle, patch, (-half, half + lift_mm), out + SKIRT_MM, levels))
    for normal, offset in zip(normals, offsets, strict=True):
        solid = solid.beyond(-normal, float(offset))
    return solid


def _side_planes(triangle: Floats, prismoid: Prismoid) -> tuple[Floats, Floats]:
    """Outward normals (n, 3) and offsets (n,): the planes normal·p + offset = 0 of all but the two faces.

    With those through the hinge axes, where bevels have ridges: their own planes leave the axes by the ridge, and would
    take ever more of the swing above the outer face.
    """
    equations = np.asarray(ConvexHull(prismoid.points).equations, np.float64)
    equations = equations[np.abs(equations[:, 2]) < 1 - UPRIGHT]
    apart = np.abs(equations[:, None] - equations[None]).max(axis=2) > SAME_PLANE
    first = [i for i in range(len(equations)) if apart[i, :i].all()]
    if not prismoid.is_ridged:
        return equations[first, :3], equations[first, 3]
    along = following(triangle) - triangle
    low = FROM_AXIS * prismoid.thickness_mm / 2
    up = np.column_stack([prismoid.outline(low) - triangle, np.full(3, low)])
    outward = np.cross(np.column_stack([along, np.zeros(3)]), up)
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    offset = -(outward[:, :2] * triangle).sum(axis=1)
    return np.vstack([equations[first, :3], outward]), np.concatenate([equations[first, 3], offset])


def block_mesh(
    triangle: Floats, patch: CurvedPatch, heights_mm: tuple[float, float], skirt_mm: float, levels: int
) -> TriMesh:
    """What lies between z = `heights_mm[0]` and the surface at the other height over the patch.

    The patch goes on over its sides by a skirt, along its tangents, each of whose quadrilaterals has a point in its
    middle: a diagonal would not be its own mirror image. Heights are measured upright and made up for the slope: a
    surface that bends more than its thickness allows does not fold.
    """
    grid, ring = barycentric_grid(levels), _ring(levels)
    inradius_mm = float((inward_normals(triangle)[0] * (_incentre(triangle) - triangle[0])).sum())
    incentre = _barycentric(triangle, _incentre(triangle)[None])
    border = grid.points[ring]
    tangent = np.einsum("ntj,tk->njk", gradients(patch.exponents, border), patch.coefficients)
    skirt = patch.points(border) + np.einsum("nj,njk->nk", skirt_mm / inradius_mm * (border - incentre), tangent)
    points = np.vstack([patch.points(grid.points), skirt])
    rise = np.maximum(patch.normals(np.vstack([grid.points, border]))[:, 2], STEEPEST_COSINE)
    upper = points + np.column_stack([np.zeros((len(points), 2)), heights_mm[1] / rise])
    outside = len(grid.points) + np.arange(len(ring))
    ahead, after, middle = np.roll(ring, -1), np.roll(outside, -1), len(upper) + np.arange(len(ring))
    loop = np.stack([ahead, ring, outside, after])
    upper = np.vstack([upper, upper[loop].mean(axis=0)])
    lower = np.column_stack([upper[:, :2], np.full(len(upper), heights_mm[0])])
    face = np.vstack([
        grid.faces, *(np.stack([a, b, middle], axis=1) for a, b in zip(loop, np.roll(loop, -1, axis=0), strict=True))
    ])  # fmt: skip
    count = len(upper)
    walls = [
        np.stack([outside, after, after + count], axis=1), np.stack([outside, after + count, outside + count], axis=1)
    ]  # fmt: skip
    return TriMesh(np.vstack([lower, upper]), np.vstack([face[:, ::-1], face + count, *walls]))


def _ring(levels: int) -> Ints:
    """Numbers of the grid's points round its border, counter-clockwise."""
    return np.concatenate([side[:-1] for side in barycentric_grid(levels).sides])


def _incentre(triangle: Floats) -> Floats:
    opposite = np.linalg.norm(np.roll(triangle, -1, axis=0) - np.roll(triangle, 1, axis=0), axis=1)
    return opposite @ triangle / opposite.sum()


def _barycentric(triangle: Floats, points: Floats) -> Floats:
    """(n, 3): barycentric coordinates of points (n, 2) of the plane."""
    a, b, c = triangle
    rest = np.linalg.solve(np.stack([b - a, c - a], axis=1), (points - a).T).T
    return np.column_stack([1 - rest.sum(axis=1), rest])
