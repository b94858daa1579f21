"""Fit: whether pockets and walls find room in every piece, and the smallest size at which they do."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from drkid.class_triangle import inward_normals
from drkid.errors import FitError
from drkid.kit import Dimensions
from drkid.mesh import Floats
from drkid.parts.prismoid import Prismoid, side_insets

SCALE_TOLERANCE = 1e-5  # relative: the size is rounded up to whole mm afterwards
SCALE_STEP = 1.5
MOST_STEPS = 60
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

    Exact: pockets are convex polygons at every height, and the distances between them and to the bevels change
    linearly between the pockets' roof and the inner face.
    """
    low, high = prismoid.heights_mm
    least = max(dimensions.min_wall_mm, dimensions.thickness_mm / 2)
    for name, height in (("inner", low), ("outer", high)):
        yield Margin(f"inscribed radius of the {name} face", least, inradius(triangle, prismoid.outline(height)))
    if dimensions.connector == "none":
        return
    wall = dimensions.min_wall_mm
    insets = prismoid.insets(triangle)
    slope = (insets[0] - insets[1]) / dimensions.thickness_mm
    for height in (low, dimensions.pocket_height_mm / 2):
        outline = prismoid.outline(height)
        pockets = pocket_outlines(triangle, outline, dimensions)
        between = min(convex_distance(pockets[i], pockets[i - 1]) for i in range(3))
        yield Margin("wall between two pockets", wall, between)
        across = _bevel_distance(pockets, outline)
        yield Margin("wall between pocket and bevel", wall, _nearest(across, slope, height - low, high - height))


def inradius(triangle: Floats, outline: Floats) -> float:
    """Radius of the circle inscribed in an outline (3, 2); negative where the insets have crossed one another."""
    along = np.roll(outline, -1, axis=0) - outline
    whole = np.einsum("ij,ij->i", along, np.roll(triangle, -1, axis=0) - triangle)
    area = abs(along[0, 0] * along[1, 1] - along[0, 1] * along[1, 0]) / 2
    return float(np.sign(whole.min()) * 2 * area / np.linalg.norm(along, axis=1).sum())


def pocket_outlines(triangle: Floats, outline: Floats, dimensions: Dimensions) -> Floats:
    """(3, 4, 2): the rectangle of each side's pocket in a section of the piece, from the bevel to its floor."""
    inward, following = inward_normals(triangle), np.roll(triangle, -1, axis=0)
    along = np.stack([inward[:, 1], -inward[:, 0]], axis=1)
    half, floor = dimensions.pocket_width_mm / 2, dimensions.pocket_depth_mm
    mouth = np.minimum(side_insets(triangle, outline), floor)
    x = np.array([-half, half, half, -half])[None, :]
    y = np.stack([mouth, mouth, np.full(3, floor), np.full(3, floor)], axis=1)
    middle = (triangle + following) / 2
    return middle[:, None] + x[..., None] * along[:, None] + y[..., None] * inward[:, None]


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
    along = np.roll(b, -1, axis=0) - b
    offset = a[:, None] - b[None]
    share = np.clip(np.einsum("psk,sk->ps", offset, along) / np.einsum("sk,sk->s", along, along), 0, 1)
    return float(np.linalg.norm(offset - share[..., None] * along, axis=-1).min())


def smallest_scale(slack_mm: Callable[[float], float], guess: float) -> float:
    """The smallest scale at which `slack_mm` is not negative, by bisection.

    Raises:
        FitError: it is negative at every scale that was tried.
    """
    high = guess
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
    while high - low > SCALE_TOLERANCE * high:
        middle = (low + high) / 2
        low, high = (low, middle) if slack_mm(middle) >= 0 else (middle, high)
    return high
