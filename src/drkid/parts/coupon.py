"""Fit coupon: one small print that tells which clearance a printer needs."""

from dataclasses import replace
from math import radians, tan

import numpy as np

from drkid.kit import Connector, Dimensions
from drkid.mesh import Floats
from drkid.parts.hinge import hinge_half
from drkid.parts.key import box_key
from drkid.parts.pocket import pocket
from drkid.parts.seven_segment import FIGURE_MM, figures, width_mm
from drkid.parts.snap import snap_half
from drkid.solid import Solid
from drkid.spec import KitSpec

TRIED = 5  # clearances, the chosen one in the middle
STEP_SHARE = 0.25  # of the chosen clearance, from one to the next
LEAST_STEP_MM = 0.02
SWING_DEGREES = 30.0  # that two half-pieces can be swung when they are joined
SIDE_GAP_MM = 0.2  # from the hinge axis to the half-piece's side
APART_MM = 4.0  # between bodies on the bed
TICK_PITCH_MM = 2.0  # in tick widths
DOWN = np.diag([1.0, -1.0, -1.0, 1.0])  # outer face on the bed: pockets and figures look up
HALF_TURN = np.diag([-1.0, -1.0, 1.0, 1.0])
AXIS_UP = np.array([[0, 0, -1, 0], [0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1]], np.float64)  # solid knuckle on the bed


def tried_mm(chosen_mm: float) -> tuple[float, ...]:
    """Clearances in whole hundredths of a mm, ascending; the chosen one in the middle, or higher up where it is 0."""
    step = max(LEAST_STEP_MM, round(STEP_SHARE * chosen_mm, 2))
    first = max(0.0, round(chosen_mm, 2) - TRIED // 2 * step)
    return tuple(round(first + k * step, 2) for k in range(TRIED))


def with_clearance(dimensions: Dimensions, clearance_mm: float) -> Dimensions:
    """The same connector in a pocket with another gap around it."""
    more = 2 * (clearance_mm - dimensions.clearance_mm)
    return replace(
        dimensions,
        clearance_mm=clearance_mm,
        pocket_width_mm=dimensions.pocket_width_mm + more,
        pocket_depth_mm=dimensions.pocket_depth_mm + more,
        pocket_height_mm=dimensions.pocket_height_mm + more,
    )


def coupon(dimensions: Dimensions, spec: KitSpec) -> Solid | None:
    """Two half-pieces with five pockets each and connectors to try in them, as they lie on the bed; None without any.

    The figures beside a pocket are its clearance in hundredths of a mm. Hinge halves come in pairs whose bores have
    five rod clearances, so many ticks on the back as the number of the clearance, the tightest first.
    """
    if dimensions.connector == "none":
        return None
    bar = _half_piece(dimensions, spec)
    size = np.ptp(bar.bounds, axis=0)
    body = bar.moved(_shifted(-bar.bounds[0]))
    other = bar.moved(HALF_TURN)
    body += other.moved(_shifted(np.array([0, size[1] + APART_MM, 0]) - other.bounds[0]))
    across, depth = 0.0, 2 * (size[1] + APART_MM)
    for part in _connectors(dimensions, spec):
        extent = np.ptp(part.bounds, axis=0)
        if across + extent[0] > size[0]:
            across, depth = 0.0, depth + extent[1] + APART_MM
        body += part.moved(_shifted(np.array([across, depth, 0]) - part.bounds[0]))
        across += extent[0] + APART_MM
    return body


def _half_piece(dimensions: Dimensions, spec: KitSpec) -> Solid:
    """A bar as thick as a piece, its side bevelled either way, with a pocket for each clearance."""
    pockets = [with_clearance(dimensions, value) for value in tried_mm(dimensions.clearance_mm)]
    wall, half = 2 * dimensions.min_wall_mm, dimensions.thickness_mm / 2
    words = [f"{round(100 * d.clearance_mm):02d}" for d in pockets]
    pitch = max(*(d.pocket_width_mm for d in pockets), *(width_mm(word) for word in words)) + wall
    deep = pockets[-1].pocket_depth_mm + FIGURE_MM[1] + 1.5 * wall
    slant = SIDE_GAP_MM + half * tan(radians(SWING_DEGREES / 2))
    profile = [(SIDE_GAP_MM, 0.0), (slant, half), (slant, -half), (deep, half), (deep, -half)]
    middle = [(k - (TRIED - 1) / 2) * pitch for k in range(TRIED)]
    bar = Solid.prism_along_x(profile, -TRIED * pitch / 2, TRIED * pitch / 2)
    bar = bar.minus_all([pocket(d).moved(_shifted((x, 0, 0))) for d, x in zip(pockets, middle, strict=True)])
    stroke, depth = spec.preset.engrave_width_mm, _mark_depth_mm(spec)
    marks = [
        mark.moved(_shifted((x, -deep + wall / 2, half)))
        for word, x in zip(words, middle, strict=True)
        for mark in figures(word, stroke, depth)
    ]
    return bar.moved(DOWN).minus_all(marks)


def _connectors(dimensions: Dimensions, spec: KitSpec) -> list[Solid]:
    """Two halves for each rod clearance, their bores upright, or the key."""
    if dimensions.connector == "box":
        return [box_key(dimensions).solid]
    values = tried_mm(dimensions.rod_clearance_mm)
    half = snap_half if dimensions.connector == "snap" else hinge_half
    halves = [half(replace(dimensions, rod_clearance_mm=value)) for value in values]
    ticked = [_ticked(half, number, spec).moved(AXIS_UP) for number, half in enumerate(halves, 1)]
    return [half for half in ticked for _ in range(2)]


def _ticked(half: Connector, number: int, spec: KitSpec) -> Solid:
    """Ticks across the back, from its solid end on."""
    low, high = half.solid.bounds
    stroke, depth = spec.preset.engrave_width_mm, _mark_depth_mm(spec)
    pitch = min(TICK_PITCH_MM * stroke, (high[0] - low[0]) / (TRIED + 0.5))
    width = min(stroke, 0.6 * pitch)
    starts = low[0] + (np.arange(number) + 0.75) * pitch - width / 2
    return half.solid.minus_all(
        [Solid.box((x, high[1] - depth, low[2] - 1), (x + width, high[1] + 1, high[2] + 1)) for x in starts]
    )


def _mark_depth_mm(spec: KitSpec) -> float:
    """A coupon tells its fits by its marks, also where pieces have none."""
    return spec.mark_depth_mm or spec.preset.mark_depth_mm


def _shifted(by: tuple[float, float, float] | Floats) -> Floats:
    matrix = np.eye(4)
    matrix[:3, 3] = by
    return matrix
