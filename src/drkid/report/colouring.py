"""What the pieces are coloured by: their class, or a figure of each on one ramp."""

from typing import Literal

import numpy as np

from drkid.export.colour import class_colour
from drkid.mesh import Floats
from drkid.report.scene import Scene

Colouring = Literal["class", "error", "dihedral", "distance"]

# Viridis (van der Walt and Smith 2015) at nine even steps: told apart by colour-blind eyes, brighter with the value.
RAMP = ("#440154", "#472D7B", "#3B528B", "#2C728E", "#21918C", "#28AE80", "#5EC962", "#ADDC30", "#FDE725")
UNITS = {"error": "% of the mean edge", "dihedral": "degrees", "distance": "% of the diagonal"}


def channels(code: str) -> Floats:
    """The three channels of #RRGGBB, in [0, 1]."""
    return np.array([int(code[i : i + 2], 16) for i in (1, 3, 5)]) / 255


def piece_values(scene: Scene, by: Colouring) -> Floats | None:
    """(P,): the figure that pieces are coloured by; None for classes."""
    if by == "error":
        return scene.error_percent
    if by == "dihedral":
        return scene.bend_degrees
    return scene.distance_percent if by == "distance" else None


def piece_colours(scene: Scene, by: Colouring) -> Floats:
    """(P, 3): the colour of each piece, in [0, 1]; the ramp runs from 0 to the largest figure."""
    values = piece_values(scene, by)
    if values is None:
        return np.array([channels(class_colour(int(index))) for index in scene.piece_class])
    return ramp(values / max(float(values.max()), 1e-300))


def ramp(shares: Floats) -> Floats:
    """(n, 3): colours for values in [0, 1]."""
    stops, at = np.array([channels(code) for code in RAMP]), np.linspace(0, 1, len(RAMP))
    return np.stack([np.interp(shares, at, stops[:, channel]) for channel in range(3)], axis=1)
