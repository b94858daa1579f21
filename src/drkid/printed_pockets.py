"""Pockets as a kit's files have them: whether all sides of all pieces have the same one, and room for a connector."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from math import radians, tan

import numpy as np

from drkid.assembly.structure import Shape
from drkid.mesh import Floats
from drkid.solid import Solid

WALL_SHARE = 1 / 3  # of the least wall: how far around a pocket is looked, which no other pocket and no mark reaches
CUT_OFF = 1e-3  # of a pocket's box: what is left of one by a bevel that counts as none


@dataclass(frozen=True)
class PocketFigures:
    """How alike the pockets are; shares of their volume, each where neither of two sides is cut off by its bevel.

    `volume_share` is the largest difference of two volumes, `shape_share` the largest volume that one has and the other
    has not; `between` are the side farthest off and the one that all are compared with. `clearance_mm` is the least
    distance of a connector, as it lies in its pocket, from its piece. `crowded` pockets have another so near that they
    cannot be told apart, and are not compared.
    """

    pockets: int
    crowded: int
    volume_mm3: float
    volume_share: float
    shape_share: float
    between: tuple[str, str]
    clearance_mm: float


@dataclass(frozen=True)
class PocketRoom:
    """What the pockets of a kit were made from, in mm: clearance, least wall, thickness of the pieces, draft.

    Pieces that are `bent` are plane around a pocket only as far down as a connector reaches.
    """

    clearance_mm: float
    wall_mm: float
    thickness_mm: float
    draft_degrees: float
    bent: bool = False


@dataclass(frozen=True, eq=False)
class _Side:
    """The material around one pocket in connector coordinates, and the same before the pocket was cut."""

    name: str
    material: Solid
    whole: Solid

    @property
    def pocket(self) -> Solid:
        return self.whole - self.material


def pocket_figures(
    shapes: Sequence[Shape], names: Sequence[str], connectors: Sequence[Solid], room: PocketRoom
) -> PocketFigures:
    """Compare the pockets of all sides, measured from the solids, with the one that its bevel leaves most of.

    Each is looked at in its connector's coordinates, in a box around connector and clearance. A piece is convex there
    before its pocket is cut, so the hull of what is left is the piece without it. Bevels cut pockets off differently:
    two are compared where both pieces have material or pocket.

    Raises:
        ValueError: no pocket of the kit stands alone.
    """
    held, box = _boxes(connectors, room)
    sides: list[_Side] = []
    crowded, least = 0, np.inf
    for shape, name in zip(shapes, names, strict=True):
        for number, frame in enumerate(shape.side_frames):
            material = shape.solid.moved(np.linalg.inv(frame)) & box
            least = min(least, *(one.gap(material, room.wall_mm) for one in connectors))
            if _is_crowded(shape.side_frames, number, held, box):
                crowded += 1
            else:
                whole = Solid.hull(material.mesh().vertices)
                sides.append(_Side(f"{name} side {number + 1}", material, whole))
    if not sides:
        message = "every pocket has another within its walls"
        raise ValueError(message)
    volumes = [side.pocket.volume for side in sides]
    model = sides[int(np.argmax(volumes))]
    apart = [_differences(side, model, box.volume) for side in sides]
    return PocketFigures(
        pockets=len(sides) + crowded,
        crowded=crowded,
        volume_mm3=max(volumes),
        volume_share=max(volume for volume, _ in apart),
        shape_share=max(shape for _, shape in apart),
        between=(sides[int(np.argmax([max(found) for found in apart]))].name, model.name),
        clearance_mm=float(least),
    )


def wall_between_pockets_mm(shape: Shape, connectors: Sequence[Solid], room: PocketRoom) -> float:
    """The least wall between the spaces of two connectors of a piece; twice what is wanted where it is more."""
    most, hull = 2 * room.wall_mm, Solid.hull(shape.solid.mesh().vertices)
    held, _ = _boxes(connectors, room)
    spaces = [(hull & held.moved(frame)) - shape.solid for frame in shape.side_frames]
    return min([most, *(one.gap(other, most) for one, other in combinations(spaces, 2))])


def _boxes(connectors: Sequence[Solid], room: PocketRoom) -> tuple[Solid, Solid]:
    """What connectors take up behind the hinge axis with their clearance, and that with draft and part of the wall."""
    high = np.abs([connector.bounds for connector in connectors]).max(axis=(0, 1))
    high = high + np.array([1.0, 2.0, 1.0]) * room.clearance_mm
    flare = 0.0 if room.bent else (high[2] + room.thickness_mm) * tan(radians(room.draft_degrees))
    beyond = high + WALL_SHARE * room.wall_mm + np.array([flare, flare, 0.0])
    foot = -high[2] if room.bent else -2 * room.thickness_mm
    return Solid.box((-high[0], 0.0, -high[2]), high), Solid.box((-beyond[0], 0.0, foot), beyond)


def _is_crowded(frames: Floats, number: int, held: Solid, box: Solid) -> bool:
    """Whether what another side of the piece holds reaches into the box around this one's pocket."""
    own = np.linalg.inv(frames[number])
    others = (held.moved(own @ frame) for other, frame in enumerate(frames) if other != number)
    return any(not (box & other).is_empty for other in others)


def _differences(side: _Side, model: _Side, size_mm3: float) -> tuple[float, float]:
    """By how much the volumes differ, and the shapes; infinite where nothing is left to be compared."""
    both = side.whole & model.whole
    own, other = both - side.material, both - model.material
    if other.volume < CUT_OFF * size_mm3:
        return float("inf"), float("inf")
    # Twice, and the lesser: of bodies whose faces all but coincide the kernel gets single operations wrong.
    shape = min((own - other).volume + (other - own).volume, (own + other).volume - (own & other).volume)
    return abs(own.volume - other.volume) / other.volume, max(shape, 0.0) / other.volume
