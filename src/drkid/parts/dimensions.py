"""Dimensions of pockets and connectors, proposed from the process; what the user gives is kept."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import ceil, cos, radians, tan

from drkid.errors import FitError
from drkid.kit import Dimensions
from drkid.parts.bevel import SHARPEST_JOINT_DEGREES
from drkid.spec import KitSpec

LEAST_GRIP_MM = 3.0  # how deep a hinge half sits in its pocket behind the barrel, at least
KEY_GRIP_HEIGHTS = 2.0  # how deep a box key sits in its pocket, in heights of the key
KEY_WALLS = 2.0  # height of a box key in minimum walls
SHARPEST_KEY_DEGREES = 90.0  # pockets lean by half of this at most: a key that leans more leaves its piece at once
HOLD_SHARE = 0.25  # of the least grip: what no bevel takes away
PLAIN_WALLS = 2.5  # thickness of a piece without pockets in minimum walls
THICKNESS_STEP_MM = 0.1
ROUNDING = 1e-9


KNUCKLES = (2, 4, 6, 8)  # what is proposed, the narrowest first
PIN_WALLS = 2.0  # diameter of a snap's pin in minimum walls
SNAP_PLACES = 2  # a clip and a pin


@dataclass(frozen=True)
class _Core:
    """What a connector is around its axis: barrel, how far it reaches into a piece, and its length along the edge."""

    barrel_mm: float
    reach_mm: float
    across_mm: float
    grip_start_mm: float = 0.0
    rod_mm: float = 0.0
    pin_mm: float = 0.0
    knuckles: int = 0


@dataclass(frozen=True)
class _Given:
    """Lengths in mm that the user or the process sets."""

    clearance: float
    rod_clearance: float
    wall: float
    knuckle_wall: float


def proposals(spec: KitSpec, sharpest_degrees: float) -> tuple[Dimensions, ...]:
    """All lengths that pieces and connectors share, for joints that bend by `sharpest_degrees` at most.

    One proposal for every rod in stock whose bore the process can make and every even number of knuckles, the thinnest
    and narrowest first; only those of the user where they are given. Barrel D = D_r + 2c_r + 2w_k; pocket height
    H = D + 2c, width W = n·l + (n − 1)·g + 2c, depth P = D/2 + 2c + e with the grip e = max(D, 3 mm); thickness
    H + 2m, rounded up to 0.1 mm. A box key has no barrel: its height stands for D. The barrel of a snap surrounds its
    pin.

    Raises:
        FitError: a thickness is given that is less than the pocket and its two walls.
    """
    preset = spec.preset
    given = _Given(
        _given(spec.clearance_mm, preset.clearance_mm),
        _given(spec.rod_clearance_mm, preset.rod_clearance_mm),
        _given(spec.min_wall_mm, preset.min_wall_mm),
        _given(spec.knuckle_wall_mm, preset.knuckle_wall_mm),
    )
    found: list[Dimensions] = []
    problem: FitError | None = None
    for core in _cores(spec, given, sharpest_degrees):
        try:
            found.append(_dimensions(spec, given, core, sharpest_degrees))
        except FitError as error:  # a thicker rod than the given thickness holds; a thinner one may do
            problem = problem or error
    if problem is not None and not found:
        raise problem
    return tuple(found)


def proposed(spec: KitSpec, sharpest_degrees: float) -> Dimensions:
    """The first of `proposals`: the thinnest and narrowest connector.

    Raises:
        FitError: a thickness is given that is less than the pocket and its two walls.
    """
    return proposals(spec, sharpest_degrees)[0]


def _dimensions(spec: KitSpec, given: _Given, core: _Core | None, sharpest_degrees: float) -> Dimensions:
    preset, c = spec.preset, given.clearance
    sprung = spec.connector in {"hinge", "snap"} and spec.retention == "detent" and preset.detent_mm > c
    height = core.barrel_mm + 2 * c if core else 0.0
    key_bend = min(sharpest_degrees, SHARPEST_KEY_DEGREES) if spec.connector == "box" else 0.0
    return Dimensions(
        connector=spec.connector,
        thickness_mm=_thickness_mm(spec, height / cos(radians(key_bend / 2)), given.wall),
        clearance_mm=c,
        rod_clearance_mm=given.rod_clearance,
        min_wall_mm=given.wall,
        knuckle_wall_mm=given.knuckle_wall,
        knuckle_length_mm=preset.knuckle_length_mm,
        knuckle_gap_mm=preset.knuckle_gap_mm,
        knuckles=core.knuckles if core else 0,
        rod_diameter_mm=core.rod_mm if core else 0.0,
        rod_length_mm=core.across_mm if core and core.rod_mm else 0.0,
        barrel_diameter_mm=core.barrel_mm if core and core.grip_start_mm else 0.0,
        pocket_width_mm=core.across_mm + 2 * c if core else 0.0,
        pocket_depth_mm=core.reach_mm + 2 * c if core else 0.0,
        pocket_height_mm=height,
        grip_start_mm=core.grip_start_mm if core else 0.0,
        detent_mm=preset.detent_mm if sprung else 0.0,
        draft_degrees=preset.draft_degrees,
        pin_diameter_mm=core.pin_mm if core else 0.0,
        key_bend_degrees=key_bend,
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


def _rods_mm(spec: KitSpec, rod_clearance_mm: float) -> tuple[float, ...]:
    """The given rod, or those in stock whose bore the process can make, ascending."""
    if spec.rod_diameter_mm is not None:
        return (spec.rod_diameter_mm,)
    rods, hole = sorted(spec.preset.rods_mm), spec.preset.min_hole_mm
    return tuple(rod for rod in rods if rod + 2 * rod_clearance_mm >= hole - ROUNDING) or (rods[-1],)


def _cores(spec: KitSpec, given: _Given, sharpest_degrees: float) -> Iterator[_Core | None]:
    preset = spec.preset
    length, gap = preset.knuckle_length_mm, preset.knuckle_gap_mm
    if spec.connector == "none":
        yield None
    elif spec.connector == "box":
        height = KEY_WALLS * given.wall
        yield _Core(height, max(KEY_GRIP_HEIGHTS * height, LEAST_GRIP_MM), 2 * length + gap)
    elif spec.connector == "snap":
        wall = max(given.wall, given.knuckle_wall)
        pin = PIN_WALLS * given.wall
        across = SNAP_PLACES * (2 * wall + 2 * gap + length) + gap
        barrel = pin + 2 * given.rod_clearance + 2 * wall
        yield _Core(barrel, *_grip(barrel, wall, across, gap, given, sharpest_degrees), pin_mm=pin)
    else:
        for rod in _rods_mm(spec, given.rod_clearance):
            barrel = rod + 2 * given.rod_clearance + 2 * given.knuckle_wall
            for n in KNUCKLES if spec.knuckles is None else (spec.knuckles,):
                across = n * length + (n - 1) * gap
                grip = _grip(barrel, given.knuckle_wall, across, gap, given, sharpest_degrees)
                yield _Core(barrel, *grip, rod_mm=rod, knuckles=n)


def _grip(
    barrel_mm: float, wall_mm: float, across_mm: float, gap_mm: float, given: _Given, sharpest_degrees: float
) -> tuple[float, float, float]:
    """Reach, length along the edge and start of the full width of a half around a barrel."""
    start = grip_start_mm(barrel_mm / 2, gap_mm, sharpest_degrees)
    least = max(barrel_mm, LEAST_GRIP_MM)
    height = barrel_mm / 2 + given.clearance + given.wall / 2  # held_height_mm, and below deepest_bevel_mm of the other
    held = given.clearance / 2 + height * _half_tangent(sharpest_degrees) + HOLD_SHARE * least
    return max(barrel_mm / 2 + least, start + wall_mm, held), across_mm, start


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
