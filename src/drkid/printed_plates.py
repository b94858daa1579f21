"""Build plates as a kit's files have them: how everything on them lies, and how wide it has to bridge."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from drkid.assembly.overlap import meeting_boxes
from drkid.export.layout import PLATES
from drkid.export.packing import hull_outline
from drkid.export.read_back import broken_file
from drkid.export.three_mf import read_three_mf
from drkid.mesh import Bools, Floats, TriMesh
from drkid.print_orientation import widest_bridge_mm

REACH_MM = 0.01  # what one item may stand into another's outline on a plate: places are written to a thousandth
DECIMALS = 6  # of a direction: items that stand alike have it to single precision


@dataclass(frozen=True)
class Lying:
    """A part on its plates: name, number of copies, the widest bridge of any, how far the lowest is off the bed.

    `crossing` copies reach into another item, seen from above.
    """

    name: str
    copies: int
    bridge_mm: float
    above_bed_mm: float
    crossing: int


def lying(folder: Path) -> tuple[Lying, ...]:
    """Every part on every plate of a kit folder, measured from the 3MF files; none where there are no plates.

    Raises:
        KitFolderError: a plate cannot be read.
    """
    found: list[Lying] = []
    for path in sorted((folder / PLATES).glob("*.3mf")):
        try:
            objects = read_three_mf(path.read_bytes())
        except (OSError, ValueError) as error:
            raise broken_file(path, "a 3MF with meshes and build items", str(error)) from error
        laid = [[one.mesh.moved(one.mesh.vertices @ m[:3, :3].T + m[:3, 3]) for m in one.transforms] for one in objects]
        crossing = _crossing([hull_outline(mesh.vertices[:, :2]) for placed in laid for mesh in placed])
        number = np.repeat(np.arange(len(laid)), [len(placed) for placed in laid])
        for k, (one, placed) in enumerate(zip(objects, laid, strict=True)):
            ways = {tuple(np.round(m[2, :3], DECIMALS)): mesh for m, mesh in zip(one.transforms, placed, strict=True)}
            bridge = max((widest_bridge_mm(mesh) for mesh in ways.values()), default=0.0)
            off = max(map(_above_bed_mm, placed), default=0.0)
            found.append(Lying(one.name, len(placed), bridge, off, int(crossing[number == k].sum())))
    return tuple(found)


def _crossing(outlines: list[Floats]) -> Bools:
    """(n,): whether a convex outline reaches into another (separating axis theorem; Ericson 2005, section 5.2.1)."""
    found = np.zeros(len(outlines), np.bool_)
    boxes = np.array([[x.min(axis=0), x.max(axis=0)] for x in outlines])
    for a, b in meeting_boxes(boxes).tolist():
        if max(_separation_mm(outlines[a], outlines[b]), _separation_mm(outlines[b], outlines[a])) < -REACH_MM:
            found[[a, b]] = True
    return found


def _separation_mm(one: Floats, other: Floats) -> float:
    """How far at most `other` lies beyond a side of `one`, which is counter-clockwise."""
    along = np.roll(one, -1, axis=0) - one
    outward = np.column_stack([along[:, 1], -along[:, 0]])
    length = np.linalg.norm(outward, axis=1)
    outward, from_ = outward[length > 0] / length[length > 0, None], one[length > 0]
    return float(((other @ outward.T).min(axis=0) - (from_ * outward).sum(axis=1)).max())


def _above_bed_mm(mesh: TriMesh) -> float:
    return abs(float(mesh.vertices[:, 2].min()))
