"""Build plates as a kit's files have them: how everything on them lies, and how wide it has to bridge."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from drkid.export.layout import PLATES
from drkid.export.read_back import broken_file
from drkid.export.three_mf import read_three_mf
from drkid.mesh import TriMesh
from drkid.print_orientation import widest_bridge_mm

DECIMALS = 6  # of a direction: items that stand alike have it to single precision


@dataclass(frozen=True)
class Lying:
    """A part on its plates: name, number of copies, the widest bridge of any, and how far the lowest is off the bed."""

    name: str
    copies: int
    bridge_mm: float
    above_bed_mm: float


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
        for one in objects:
            placed = [one.mesh.moved(one.mesh.vertices @ m[:3, :3].T + m[:3, 3]) for m in one.transforms]
            ways = {tuple(np.round(m[2, :3], DECIMALS)): mesh for m, mesh in zip(one.transforms, placed, strict=True)}
            bridge = max((widest_bridge_mm(mesh) for mesh in ways.values()), default=0.0)
            found.append(Lying(one.name, len(placed), bridge, max(map(_above_bed_mm, placed), default=0.0)))
    return tuple(found)


def _above_bed_mm(mesh: TriMesh) -> float:
    return abs(float(mesh.vertices[:, 2].min()))
