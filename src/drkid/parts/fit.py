"""Fit: whether pockets and walls find room in every piece, and the smallest size at which they do."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np

from drkid.class_triangle import following, inward_normals
from drkid.errors import FitError
from drkid.kit import Dimensions
from drkid.mesh import Floats
from drkid.parts.detent import groove
from drkid.parts.pocket import deepest_height_mm, depth_mm, flare_mm
from drkid.parts.prismoid import Prismoid, cut_corners, side_insets

SCALE_TOLERANCE = 1e-5  # relative: the size is rounded up to whole mm afterwards
SCALE_STEP = 1.5
CUT_HALVINGS = 12
MOST_STEPS = 60
LEAST_MM = 1e-3  # a pocket that a bevel cuts off altogether counts as one so deep; so does a groove
FITS_MM = -1e-6  # slack that still counts as fitting: a size that was computed fits again when it is given


@dataclass(frozen=True)
class Margin:
    """A length of a piece in mm, and what is needed of it; negative where there is not that much."""

    what: str
    needed_mm: float
    available_mm: float

    @property
    def slack_mm(self) -> float:
        """How much more there is than needed."""
        return self.available_mm - self.needed_mm


def margins(triangle: Floats, prismoid: Prismoid, dimensions: Dimensions) -> Iterator[Margin]:
    """Every length of a piece that must not fall short: triangle (3, 2), the piece around it, its pockets.

    Exact, but for grooves, around which a convex outline is drawn: pockets are convex polygons at every height, and
    the distances between them and to the bevels change linearly between the inner face, the bevels' ridge and the
    pockets' roof.
    """
    low, high = prismoid.heights_mm
    least = max(dimensions.min_wall_mm, dimensions.thickness_mm / 2)
    for name, height in (("inner", low), ("outer", high)):
        yield Margin(f"inscribed radius of the {name} face", least, inradius(triangle, prismoid.outline(height)))
    if dimensions.connector == "none":
        return
    wall = dimensions.min_wall_mm
    if prismoid.cuts is not None:
        yield Margin("wall between pocket and cut corner", wall, _behind_cuts(triangle, prismoid, dimensions))
    bevels = list(prismoid.bevels(triangle))
    levels = prismoid.levels_mm[prismoid.levels_mm < dimensions.pocket_height_mm / 2].tolist()
    for height in sorted({*levels, *_telling_heights(dimensions, low)}):
        outline = prismoid.outline(height)
        pockets = pocket_outlines(triangle, outline, dimensions, height)
        between = min(convex_distance(pockets[i], pockets[i - 1]) for i in range(3))
        yield Margin("wall between two pockets", wall, between)
        across = _bevel_distance(pockets, outline)
        for bottom, top, slope in bevels:
            if bottom <= height <= top:
                distance = _nearest(across, slope, height - bottom, top - height)
                yield Margin("wall between pocket and bevel", wall, distance)


def _telling_heights(dimensions: Dimensions, low: float) -> tuple[float, ...]:
    """Between which pockets and bevels change linearly: inner face, foot of the grooves on either side, roof's ends."""
    ridge = groove(dimensions)
    grooved = () if ridge is None else (ridge.z - ridge.half_base, ridge.z + ridge.half_base)
    return (low, *grooved, deepest_height_mm(dimensions), dimensions.pocket_height_mm / 2)


def corner_room_mm(triangle: Floats, prismoid: Prismoid, dimensions: Dimensions, face: int, corner: int) -> float:
    """How far behind a corner of the inner (0) or the outer face (1) a cut may lie.

    It leaves a wall in front of the pockets, and half of the face's inscribed circle.
    """
    low, high = 0.0, max(inradius(triangle, prismoid.faces[face]) / 2, 0.0)
    if dimensions.connector == "none":
        return high
    for _ in range(CUT_HALVINGS):
        cuts = np.zeros((2, 3))
        cuts[face, corner] = middle = (low + high) / 2
        wall = _behind_cuts(triangle, prismoid.truncated(cuts), dimensions)
        low, high = (middle, high) if wall >= dimensions.min_wall_mm else (low, middle)
    return low


def _behind_cuts(triangle: Floats, prismoid: Prismoid, dimensions: Dimensions) -> float:
    """Least distance from the pockets to the planes in which corners are cut, on whose side of mid-height they lie."""
    cuts, middle, nearest = prismoid.cuts, prismoid.outline(0.0), np.inf
    if cuts is None:
        return nearest
    for face, (outline, end) in enumerate(zip(prismoid.faces, prismoid.heights_mm, strict=True)):
        roof = min(dimensions.pocket_height_mm / 2, end) if face else 0.0
        heights = sorted({0.0, roof} if face else {0.0, *(z for z in _telling_heights(dimensions, end) if z < 0)})
        for corner in np.flatnonzero(cuts[face]).tolist():
            a, b = cut_corners(outline, cuts[face])[corner]
            normal = np.cross([*(b - a), 0.0], [*(middle[corner] - a), -end])
            normal *= (np.sign(normal[:2] @ (outline.mean(axis=0) - a))) / np.linalg.norm(normal)
            for height in heights:
                points = pocket_outlines(triangle, prismoid.outline(height), dimensions, height).reshape(-1, 2)
                distance = (points - a) @ normal[:2] + (height - end) * normal[2]
                nearest = min(nearest, float(distance.min()))
    return nearest


def inradius(triangle: Floats, outline: Floats) -> float:
    """Radius of the circle inscribed in an outline (3, 2); negative where the insets have crossed one another."""
    along = following(outline) - outline
    whole = np.einsum("ij,ij->i", along, following(triangle) - triangle)
    area = abs(along[0, 0] * along[1, 1] - along[0, 1] * along[1, 0]) / 2
    return float(np.sign(whole.min()) * 2 * area / np.linalg.norm(along, axis=1).sum())


def pocket_outlines(triangle: Floats, outline: Floats, dimensions: Dimensions, height_mm: float) -> Floats:
    """(3, n, 2): each side's pocket in a section of the piece, from the bevel to its floor.

    A rectangle, or, where grooves are, the convex hexagon around pocket and grooves.
    """
    inward, ends_at = inward_normals(triangle), following(triangle)
    along = np.stack([inward[:, 1], -inward[:, 0]], axis=1)
    half, floor = dimensions.pocket_width_mm / 2 + flare_mm(dimensions, height_mm), depth_mm(dimensions, height_mm)
    mouth = np.minimum(side_insets(triangle, outline), floor - LEAST_MM)
    ends = np.full(3, floor)
    ridge = groove(dimensions)
    if ridge is None or abs(height_mm - ridge.z) > ridge.half_base + LEAST_MM:
        x, y = np.array([-half, half, half, -half]), np.stack([mouth, mouth, ends, ends], axis=1)
    else:
        wide = max(half, dimensions.pocket_width_mm / 2 + ridge.height)
        end = min(ridge.end, floor - LEAST_MM)
        near, far = np.minimum(mouth, end - LEAST_MM), np.full(3, end)
        x, y = np.array([-wide, wide, wide, half, -half, -wide]), np.stack([near, near, far, ends, ends, far], axis=1)
    middle = (triangle + ends_at) / 2
    return middle[:, None] + x[None, :, None] * along[:, None] + y[..., None] * inward[:, None]


def _bevel_distance(pockets: Floats, outline: Floats) -> Floats:
    """(3, 3, 4): from each bevel, by side, to every pocket's corners within one section; infinite for its own."""
    offset = pockets[None] - outline[:, None, None]
    distance = np.einsum("spck,sk->spc", offset, inward_normals(outline))
    return np.where(np.eye(3, dtype=np.bool_)[:, :, None], np.inf, distance)


def _nearest(across: Floats, slope: Floats, below_mm: float, above_mm: float) -> float:
    """Least distance in space from upright edges, `across` (3, …) from bevels in their section, to those bevels.

    `slope` (3,) is how much farther a bevel is for every mm of height; it ends `below_mm` under the section and
    `above_mm` over it, so that the foot of the perpendicular may lie beyond its end.
    """
    h, s = across.min(axis=(1, 2)), slope
    rise = np.clip(-s * h / (1 + s * s), -below_mm, above_mm)
    distance = np.hypot(h + s * rise, rise)
    return float(np.where(h > 0, distance, h / np.sqrt(1 + s * s)).min())


def convex_distance(a: Floats, b: Floats) -> float:
    """Distance between two convex polygons (n, 2); where they meet, minus how deep they are in one another.

    Separating axes for polygons that meet (Gottschalk 1996), corners against sides for those that do not.
    """
    separation = max(_separation(a, b), _separation(b, a))
    return separation if separation <= 0 else min(_corner_distance(a, b), _corner_distance(b, a))


def _separation(a: Floats, b: Floats) -> float:
    """Largest distance of `b` from a side of the counter-clockwise `a`, to its outside."""
    outward = -inward_normals(a)
    return float(np.einsum("sck,sk->sc", b[None] - a[:, None], outward).min(axis=1).max())


def _corner_distance(a: Floats, b: Floats) -> float:
    along = following(b) - b
    offset = a[:, None] - b[None]
    share = np.clip(np.einsum("psk,sk->ps", offset, along) / np.einsum("sk,sk->s", along, along), 0, 1)
    return float(np.linalg.norm(offset - share[..., None] * along, axis=-1).min())


def smallest_scale(slack_mm: Callable[[float], float], guess: float) -> float:
    """The smallest scale at which `slack_mm` is not negative, within `SCALE_TOLERANCE`.

    Raises:
        FitError: it is negative at every scale that was tried.
    """
    slack_mm, high = cache(slack_mm), guess
    for _ in range(MOST_STEPS):
        if slack_mm(high) >= 0:
            break
        high *= SCALE_STEP
    else:
        raise FitError(
            "pockets and walls find no room in the pieces at any size",
            wanted="a piece whose sides leave room for a connector behind their bevels",
            found=f"{-slack_mm(high):.2f} mm too little even at {high:g} mm a unit",
            remedy="thinner pieces (--thickness-mm), a smaller --swing-degrees, or --connector none",
        )
    low = high / SCALE_STEP
    while slack_mm(low) >= 0 and low > guess * SCALE_TOLERANCE:
        low, high = low / SCALE_STEP, low
    return _root(slack_mm, low, high)


def _root(slack_mm: Callable[[float], float], low: float, high: float) -> float:
    """Where the slack turns positive between two scales, from above, within the tolerance.

    By false position in the manner of Illinois: the end that stays counts half, so that both come together; slack is
    nearly linear, which takes a third of a bisection's steps.
    """
    at_low, at_high, last = slack_mm(low), slack_mm(high), 0
    while high - low > SCALE_TOLERANCE * high and at_low < 0:
        edge = 0.4 * SCALE_TOLERANCE * high
        crossing = high - at_high / (at_high - at_low) * (high - low)
        middle = min(max(crossing, low + edge), high - edge)
        value = slack_mm(middle)
        if value >= 0:
            at_low, high, at_high, last = at_low / (2 if last > 0 else 1), middle, value, 1
        else:
            at_high, low, at_low, last = at_high / (2 if last < 0 else 1), middle, value, -1
    return high
