"""Build plates: every part as often as it is printed, packed on the printer's bed, one colour a plate."""

from dataclasses import dataclass
from itertools import groupby
from math import inf

import numpy as np

from drkid.errors import FitError
from drkid.export.bill_of_materials import Row
from drkid.export.kit_document import bom_rows, printed_meshes
from drkid.export.layout import plate_file
from drkid.export.packing import Place, Shape, Sheet, hull_outline, pack, rotation
from drkid.export.three_mf import PlateObject, three_mf_bytes
from drkid.kit import Kit
from drkid.mesh import Floats, TriMesh
from drkid.print_orientation import print_orientation

MARGIN_MM = 5.0  # kept free along the bed's border: for a brim and the printer's clips
SPACING_MM = 2.0  # between items: so that each is its own island and a hand can take it off
STEP_MM = 0.5  # of the grid of places; distances are kept exactly


@dataclass(frozen=True, eq=False)
class Plate:
    """What is printed in one go; `fill_percent` of the usable bed is covered by the items' hulls."""

    objects: tuple[PlateObject, ...]
    fill_percent: float


def plate_files(kit: Kit) -> dict[str, bytes]:
    """`plates/plate_01.3mf` and so on.

    Raises:
        FitError: as `plates`.
    """
    files = {plate_file(number): plate for number, plate in enumerate(plates(kit), 1)}
    return {file: three_mf_bytes(file, plate.objects) for file, plate in files.items()}


def plates(kit: Kit) -> tuple[Plate, ...]:
    """Count and spares of every part, turned so that it prints without support, colour after colour.

    Each mesh is stored as its file has it: the items' transforms turn and place it.

    Raises:
        FitError: a part is larger than the bed in the way in which it is printed.
    """
    meshes = printed_meshes(kit)
    rows = [row for row in bom_rows(kit, {name: mesh.volume for name, mesh in meshes.items()}) if row.file]
    bed = kit.spec.bed_mm
    sheet = Sheet(bed[0], bed[1], _margin_mm(kit), SPACING_MM)
    longest = kit.spec.preset.longest_bridge_mm or inf
    found: list[Plate] = []
    for _, group in groupby(rows, key=lambda row: row.colour):
        own = list(group)
        turns = [print_orientation(meshes[row.file], longest) for row in own]
        found += _packed(own, [meshes[row.file] for row in own], turns, sheet, bed[2])
    return tuple(found)


def _margin_mm(kit: Kit) -> float:
    """Less on a bed that is hardly larger than a piece."""
    return min(MARGIN_MM, min(kit.spec.bed_mm[:2]) / 20)


def _packed(rows: list[Row], meshes: list[TriMesh], turns: list[Floats], sheet: Sheet, height_mm: float) -> list[Plate]:
    turned = [mesh.vertices @ turn.T for mesh, turn in zip(meshes, turns, strict=True)]
    shapes = [Shape((hull_outline(points[:, :2]),)) for points in turned]
    if any(np.ptp(points[:, 2]) > height_mm for points in turned):
        raise _too_large(rows)
    try:
        places = pack(shapes, [row.count + row.spare for row in rows], sheet, STEP_MM)
    except ValueError as error:
        raise _too_large(rows) from error
    usable = (sheet.width_mm - 2 * sheet.margin_mm) * (sheet.depth_mm - 2 * sheet.margin_mm)
    found: list[Plate] = []
    for number in range(1 + max((place.sheet for place in places), default=-1)):
        objects = [
            PlateObject(
                _shown_name(row), row.colour or "", mesh,
                [_matrix(place, turn, points) for place in places if (place.shape, place.sheet) == (i, number)],
            )
            for i, (row, mesh, turn, points) in enumerate(zip(rows, meshes, turns, turned, strict=True))
        ]  # fmt: skip
        covered = sum(shapes[place.shape].area for place in places if place.sheet == number)
        found.append(Plate(tuple(one for one in objects if one.transforms), 100 * covered / usable))
    return found


def _shown_name(row: Row) -> str:
    """What a slicer lists: the file's stem, so that left and right are told apart."""
    return row.file.rsplit("/", 1)[-1].removesuffix(".stl")


def _matrix(place: Place, turn: Floats, turned: Floats) -> Floats:
    """(4, 4): from the part's own frame to the bed, its lowest point on z = 0."""
    matrix = np.eye(4)
    matrix[:2, :2] = rotation(place.degrees)
    matrix[:3, :3] = matrix[:3, :3] @ turn
    matrix[:3, 3] = place.x, place.y, -turned[:, 2].min()
    return matrix


def _too_large(rows: list[Row]) -> FitError:
    return FitError(
        f"{' or '.join(row.file for row in rows)} is larger than the bed, lying as it prints without support",
        wanted="a bed that it lies on with a margin",
        remedy="a larger bed (--bed, --printer), a smaller print (--size-mm) or more pieces (--faces)",
    )
