"""The printed parts of a kit folder as a structure: what the proofs of an assembly look at, from its files alone."""

from pathlib import Path

import numpy as np
import trimesh

from drkid.assembly.closure import Play
from drkid.assembly.piece_graph import piece_graph
from drkid.assembly.structure import Shape, Structure
from drkid.export import KitDocument
from drkid.mesh import Floats, TriMesh
from drkid.solid import Solid
from drkid.spec import KitSpec


def structure_of(folder: Path, assembled: TriMesh, kit: KitDocument) -> Structure:
    """Parts, places, joints and clearances of a kit that has been read, M_f being `assembled`.

    Raises:
        ValueError: a file is no solid, a piece names a part or vertices that there are not, or a joint is not between
            two sides.
    """
    parts = {part.file: part for one in kit.classes for part in one.parts}
    names = list(parts)
    graph = piece_graph([piece.corners for piece in kit.pieces], [_along(joint.edge) for joint in kit.joints])
    if any(piece.part not in parts or len(piece.corners) != len(parts[piece.part].corners) for piece in kit.pieces):
        message = "a piece names a part that there is not, or has not its corners"
        raise ValueError(message)
    if max(max(piece.corners) for piece in kit.pieces) >= len(assembled.vertices):
        message = "a piece names a vertex that there is not"
        raise ValueError(message)
    connectors = list(dict.fromkeys(file for joint in kit.joints for file in joint.connector))
    return Structure(
        graph=graph,
        shapes=[
            Shape(
                np.array(part.corners),
                np.array([side.connector_frame for side in part.sides]).reshape(-1, 4, 4),
                _solid(folder / name),
            )
            for name, part in parts.items()
        ],
        parts=[names.index(piece.part) for piece in kit.pieces],
        faces=[piece.first_face for piece in kit.pieces],
        placements=np.array([piece.transform for piece in kit.pieces]).reshape(-1, 4, 4),
        targets=[assembled.vertices[list(piece.corners)] for piece in kit.pieces],
        bend_radians=np.radians([180 - joint.dihedral_degrees for joint in kit.joints]),
        connector=kit.spec["connector"],
        connectors=[_solid(folder / name) for name in connectors],
        play=_play(kit),
    )


def _along(edge: tuple[int, int]) -> tuple[int, int]:
    return min(edge), max(edge)


def _play(kit: KitDocument) -> Play:
    clearance, rod = float(kit.spec["clearance_mm"]), float(kit.spec["rod_clearance_mm"])
    turning = kit.spec["connector"] in {"hinge", "snap"}
    process = {name: kit.spec.get(name) for name in ("process", "process_values")}
    return Play(2 * clearance, 2 * rod if turning else 0.0, KitSpec.parse(process).preset.accuracy_mm)


def _solid(path: Path) -> Solid:
    mesh = trimesh.load_mesh(path, process=False)
    corners, index = np.unique(_triangles(mesh).reshape(-1, 3), axis=0, return_inverse=True)
    try:
        return Solid.of(TriMesh(corners, index.reshape(-1, 3)))
    except ValueError as error:
        message = f"{path.name}: {error}"
        raise ValueError(message) from error


def _triangles(mesh: trimesh.Trimesh) -> Floats:
    return np.asarray(mesh.triangles, np.float64)
