"""Scene: a kit as its documents see it, from a `Kit` or a kit folder; what is drawn and told of each piece."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from drkid.export import KitDocument
from drkid.export.kit_document import kit_document, part_name
from drkid.export.layout import ASSEMBLED, SURFACE
from drkid.export.read_back import read_document, read_mesh
from drkid.kit import Kit
from drkid.measure import distance_to_surface, sample
from drkid.mesh import Floats, Ints, TriMesh, read_only

SAMPLES_A_PIECE = 64  # points at which a piece's distance to M_i is taken
SAMPLING_SEED = 7


@dataclass(frozen=True, eq=False)
class Scene:
    """The document of a kit, the mesh of each part file, M_i and M_f; all in mm.

    Pieces are numbered from 0 in the order of `document.pieces`; a class and a step have the numbers of the document.
    """

    document: KitDocument
    parts: dict[str, TriMesh]
    surface: TriMesh
    assembled: TriMesh

    @cached_property
    def transforms(self) -> Floats:
        """(P, 4, 4): from part to world."""
        return read_only(np.array([piece.transform for piece in self.document.pieces]).reshape(-1, 4, 4))

    @cached_property
    def piece_class(self) -> Ints:
        """(P,): number of each piece's class."""
        number = {one.id: i for i, one in enumerate(self.document.classes)}
        return read_only(np.array([number[piece.class_] for piece in self.document.pieces], np.int64))

    @cached_property
    def face_piece(self) -> dict[int, int]:
        """The piece that a face of M_f belongs to."""
        return {face: i for i, piece in enumerate(self.document.pieces) for face in piece.covered}

    @cached_property
    def piece_step(self) -> Ints:
        """(P,): the step at which each piece is put in, from 1."""
        out = np.zeros(len(self.document.pieces), np.int64)
        for step in self.document.assembly:
            out[self.face_piece[step.face]] = step.step
        return read_only(out)

    @cached_property
    def joint_pieces(self) -> Ints:
        """(J, 2): the two pieces of each joint."""
        pairs = [[self.face_piece[face] for face in joint.faces] for joint in self.document.joints]
        return read_only(np.array(pairs, np.int64).reshape(-1, 2))

    @cached_property
    def error_percent(self) -> Floats:
        """(P,): distance of each piece's ascending edge lengths to its class's, in percent of the mean edge."""
        wanted = [self.document.classes[i].edge_lengths for i in self.piece_class]
        found = [_sides(self.assembled.vertices[list(piece.corners)]) for piece in self.document.pieces]
        errors = [np.linalg.norm(np.sort(a) - b) for a, b in zip(found, wanted, strict=True)]
        return read_only(100 / self.document.metrics.mean_edge * np.array(errors, np.float64))

    @cached_property
    def bend_degrees(self) -> Floats:
        """(P,): the largest |180° − inner angle| of each piece's joints."""
        out = np.zeros(len(self.document.pieces))
        bends = np.abs([180 - joint.dihedral_degrees for joint in self.document.joints])
        for column in (0, 1):
            np.maximum.at(out, self.joint_pieces[:, column], bends)
        return read_only(out)

    @cached_property
    def distance_percent(self) -> Floats:
        """(P,): mean distance of each piece's middle surface to M_i, in percent of the diagonal of M_i's box."""
        rng, count = np.random.default_rng(SAMPLING_SEED), len(self.document.pieces)
        points = np.concatenate([sample(self._middle(i), SAMPLES_A_PIECE, rng) for i in range(count)])
        found = distance_to_surface(self.surface, points).reshape(count, -1).mean(axis=1)
        return read_only(100 / self.surface.diagonal * found)

    def _middle(self, piece: int) -> TriMesh:
        corners = list(self.document.pieces[piece].corners)
        fan = [[0, i, i + 1] for i in range(1, len(corners) - 1)]
        return TriMesh(self.assembled.vertices[corners], np.array(fan))

    @cached_property
    def middle(self) -> Floats:
        """(3,): the middle of the assembled shell's vertices, from which pieces move outwards."""
        return read_only(self.assembled.vertices.mean(axis=0))

    def placed(self, piece: int, explode: float = 0.0) -> TriMesh:
        """A piece's mesh at its place, moved away from the middle by `explode` of its distance."""
        mesh, matrix = self.parts[self.document.pieces[piece].part], self.transforms[piece]
        away = explode * (matrix[:3, 3] - self.middle)
        return mesh.moved(mesh.vertices @ matrix[:3, :3].T + matrix[:3, 3] + away)


def scene_of(kit: Kit) -> Scene:
    """The scene of a kit that is not written yet."""
    parts = {part_name(part): part.solid.mesh() for part in kit.part_set.parts}
    return Scene(kit_document(kit), parts, kit.surface, kit.decomposition.mesh)


def scene_at(folder: Path) -> Scene:
    """The scene of a kit folder.

    Raises:
        KitFolderError: the folder is no kit, or one of its files is missing or cannot be read.
    """
    document = read_document(folder)
    files = sorted({piece.part for piece in document.pieces})
    parts = {file: _mesh(folder / file) for file in files}
    return Scene(document, parts, _mesh(folder / SURFACE), _mesh(folder / ASSEMBLED))


def _mesh(path: Path) -> TriMesh:
    loaded = read_mesh(path)
    mesh = TriMesh(np.asarray(loaded.vertices, np.float64), np.asarray(loaded.faces, np.int64))
    if path.suffix != ".stl":
        return mesh
    vertices, index = np.unique(mesh.vertices, axis=0, return_inverse=True)  # STL has no shared vertices
    return TriMesh(vertices, index.ravel()[mesh.faces])


def _sides(corners: Floats) -> Floats:
    return np.asarray(np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1), np.float64)
