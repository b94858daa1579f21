"""Dimensions of pockets and connectors, proposed from the process; what the user gives is kept."""

from dataclasses import dataclass
from math import ceil, radians, tan

from drkid.errors import FitError
from drkid.kit import Dimensions
from drkid.parts.bevel import SHARPEST_JOINT_DEGREES
from drkid.spec import KitSpec

LEAST_GRIP_MM = 3.0  # how deep a hinge half sits in its pocket behind the barrel, at least
KEY_GRIP_HEIGHTS = 2.0  # how deep a box key sits in its pocket, in heights of the key
KEY_WALLS = 2.0  # height of a box key in minimum walls
HOLD_SHARE = 0.25  # of the least grip: what no bevel takes away
PLAIN_WALLS = 2.5  # thickness of a piece without pockets in minimum walls
THICKNESS_STEP_MM = 0.1
ROUNDING = 1e-9


@dataclass(frozen=True)
class _Core:
    """What a connector is around its axis: half its height, and how far it reaches into a piece."""

    half_height_mm: float
    reach_mm: float


def proposed(spec: KitSpec, sharpest_degrees: float) -> Dimensions:
    """All lengths that pieces and connectors share, for joints that bend by `sharpest_degrees` at most.

    Barrel D = D_r + 2c_r + 2w_k; pocket height H = D + 2c, width W = n·l + (n − 1)·g + 2c, depth P = D/2 + 2c + e
    with the grip e = max(D, 3 mm); thickness H + 2m, rounded up to 0.1 mm. A box key has no barrel: its height
    stands for D.

    Raises:
        FitError: a thickness is given that is less than the pocket and its two walls.
    """
    preset = spec.preset
    clearance = _given(spec.clearance_mm, preset.clearance_mm)
    wall = _given(spec.min_wall_mm, preset.min_wall_mm)
    knuckle_wall = _given(spec.knuckle_wall_mm, preset.knuckle_wall_mm)
    rod_clearance = _given(spec.rod_clearance_mm, preset.rod_clearance_mm)
    hinged = spec.connector == "hinge"
    rod = _rod_mm(spec, rod_clearance) if hinged else 0.0
    barrel = rod + 2 * rod_clearance + 2 * knuckle_wall if hinged else 0.0
    core = _core(spec, barrel, wall, knuckle_wall, sharpest_degrees)
    length, gap = preset.knuckle_length_mm, preset.knuckle_gap_mm
    across = spec.knuckles * length + (spec.knuckles - 1) * gap if core else 0.0
    height = 2 * core.half_height_mm + 2 * clearance if core else 0.0
    return Dimensions(
        connector=spec.connector,
        thickness_mm=_thickness_mm(spec, height, wall),
        clearance_mm=clearance,
        rod_clearance_mm=rod_clearance,
        min_wall_mm=wall,
        knuckle_wall_mm=knuckle_wall,
        knuckle_length_mm=length,
        knuckle_gap_mm=gap,
        knuckles=spec.knuckles,
        rod_diameter_mm=rod,
        rod_length_mm=across if hinged else 0.0,
        barrel_diameter_mm=barrel,
        pocket_width_mm=across + 2 * clearance if core else 0.0,
        pocket_depth_mm=core.reach_mm + 2 * clearance if core else 0.0,
        pocket_height_mm=height,
    )


def reach_mm(dimensions: Dimensions) -> float:
    """How far a connector reaches into a piece from the hinge axis; twice the clearance is left behind it."""
    return dimensions.pocket_depth_mm - 2 * dimensions.clearance_mm


def half_width_mm(dimensions: Dimensions) -> float:
    """Half the length of a connector along the edge."""
    return dimensions.pocket_width_mm / 2 - dimensions.clearance_mm


def grip_start_mm(barrel_radius_mm: float, knuckle_gap_mm: float, sharpest_degrees: float) -> float:
    """How far behind the hinge axis a half's full width may begin.

    Clear of the other half's barrel (radius r), and behind the plane between the two halves where they come
    nearest: r·tan(δ/2) at the barrel's height when the joint bends by δ.
    """
    return barrel_radius_mm * max(1.0, _half_tangent(sharpest_degrees)) + knuckle_gap_mm


def deepest_bevel_mm(dimensions: Dimensions) -> float:
    """How far a bevel may cut behind the hinge axis, within `held_height_mm` of it, without freeing the connector.

    Infinite where there is none.
    """
    if dimensions.connector == "none":
        return float("inf")
    return reach_mm(dimensions) - HOLD_SHARE * max(dimensions.barrel_diameter_mm, LEAST_GRIP_MM)


def held_height_mm(dimensions: Dimensions) -> float:
    """How far from the middle plane a piece must hold its connector: half-way through the wall over the pocket."""
    return (dimensions.pocket_height_mm + dimensions.min_wall_mm) / 2


def _half_tangent(sharpest_degrees: float) -> float:
    return tan(radians(min(sharpest_degrees, SHARPEST_JOINT_DEGREES)) / 2)


def _given(value: float | None, proposal: float) -> float:
    return proposal if value is None else value


def _rod_mm(spec: KitSpec, rod_clearance_mm: float) -> float:
    """The given rod, or the thinnest in stock whose bore the process can make."""
    if spec.rod_diameter_mm is not None:
        return spec.rod_diameter_mm
    rods, hole = spec.preset.rods_mm, spec.preset.min_hole_mm
    return next((rod for rod in rods if rod + 2 * rod_clearance_mm >= hole - ROUNDING), rods[-1])


def _core(
    spec: KitSpec, barrel_mm: float, wall_mm: float, knuckle_wall_mm: float, sharpest_degrees: float
) -> _Core | None:
    if spec.connector == "none":
        return None
    if spec.connector == "box":
        height = KEY_WALLS * wall_mm
        return _Core(height / 2, max(KEY_GRIP_HEIGHTS * height, LEAST_GRIP_MM))
    radius = barrel_mm / 2
    sharp = grip_start_mm(radius, spec.preset.knuckle_gap_mm, sharpest_degrees) + knuckle_wall_mm
    clearance = _given(spec.clearance_mm, spec.preset.clearance_mm)
    height = radius + clearance + wall_mm / 2  # held_height_mm, and below deepest_bevel_mm from the other side
    held = clearance / 2 + height * _half_tangent(sharpest_degrees) + HOLD_SHARE * max(barrel_mm, LEAST_GRIP_MM)
    return _Core(radius, max(radius + max(barrel_mm, LEAST_GRIP_MM), sharp, held))


def _thickness_mm(spec: KitSpec, pocket_height_mm: float, wall_mm: float) -> float:
    needed = pocket_height_mm + 2 * wall_mm if pocket_height_mm else PLAIN_WALLS * wall_mm
    if spec.thickness_mm is None:
        return round(ceil(needed / THICKNESS_STEP_MM - ROUNDING) * THICKNESS_STEP_MM, 6)
    if pocket_height_mm and spec.thickness_mm < needed - ROUNDING:
        raise FitError(
            f"the pieces are too thin for the {spec.connector}: its pocket is {pocket_height_mm:.2f} mm high "
            f"and needs {wall_mm:g} mm of wall on either side",
            wanted=f"thickness_mm of {needed:.2f} at least",
            found=f"{spec.thickness_mm:g}",
            remedy="thicker pieces, a thinner rod (--rod-diameter-mm), or --connector none",
        )
    return spec.thickness_mm
