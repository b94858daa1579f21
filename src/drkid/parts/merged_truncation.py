"""Tips of merged pieces cut off where pieces that share a vertex reach into one another.

Bevels keep neighbours apart at their joints; around a sharp or saddle-shaped vertex the tips of pieces that are no
neighbours may still meet. Both are cut by parallel planes on either side of the middle of what they share.
"""

from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from drkid.kit import MergedPiece
from drkid.mesh import Floats, TriMesh
from drkid.rigid_fit import rigid_fit
from drkid.solid import Solid

APART_CLEARANCES = 3.0  # between two tips that met: most can then swing
ROUNDS = 4  # a cut for one pair of members is made on all of a shape, which seldom needs another
NOTHING_MM3 = 1e-9
MOST_OF_PIECE = 0.02  # of a piece's volume: what more is shared is no tip, and left to the figures of the assembly
ALONG_FACE = 0.7  # cosine of the angle between the normals of a face and of a plane that runs along it
SAME_PLANE = 6  # decimals to which unit normals of one plane agree
AROUND_MM = 1.0  # beyond what is shared: how far a cut reaches that would take more than a tip


@dataclass(frozen=True, eq=False)
class _Tipped:
    """A placed piece whose tip meets another, and where its part's `room` lies that is to stay."""

    solid: Solid
    room: Solid
    motion: Floats

    def behind(self, shared: Solid, normal: Floats, level: float) -> tuple[Solid, bool]:
        """What takes away what a plane has behind it of the piece, and whether that is a tip and goes whole.

        More than a tip stays, but for what is near.
        """
        behind = self.solid.beyond(-normal, -level)
        tip = Solid.union([part for part in behind.components() if not (part & shared).is_empty])
        whole = tip.volume < MOST_OF_PIECE * self.solid.volume
        bounds = tip.bounds if whole and not tip.is_empty else shared.bounds
        return Solid.box(*(bounds + np.array([[-AROUND_MM], [AROUND_MM]]))).beyond(-normal, -level), whole

    def lost(self, cut: Solid) -> tuple[float, float]:
        """How much a cut takes of the room, in mm³, and which share of the piece."""
        gone = self.solid & cut
        of_room = (gone & self.room.moved(self.motion)).volume
        return (of_room if of_room > NOTHING_MM3 else 0.0), gone.volume / self.solid.volume


def tips_cut(
    solids: list[Solid],
    corners: list[Floats],
    pieces: tuple[MergedPiece, ...],
    mesh_mm: TriMesh,
    mirror: list[tuple[int, ...]],
    clearance_mm: float,
    room: list[Solid],
) -> list[Solid]:
    """The shapes' solids without the tips that meet others.

    A tip goes whole, so that nothing thin is left of it beside the cut.

    Args:
        solids: of the shapes, in their part frames.
        corners: (n, 3) of each.
        pieces: which shape lies where.
        mesh_mm: M_f.
        mirror: the corners' mirror images in a shape that is its own mirror image, and stays so; nothing of others.
        clearance_mm: of which two tips are drawn apart by `APART_CLEARANCES`.
        room: what cuts should leave of each: pockets and the walls around them.
    """
    half_mm = APART_CLEARANCES * clearance_mm / 2
    motions = [rigid_fit(corners[p.class_index], mesh_mm.vertices[list(p.vertices)]) for p in pieces]
    back = [np.asarray(np.linalg.inv(motion), np.float64) for motion in motions]
    pairs = _near(pieces)
    solids = list(solids)
    for _ in range(ROUNDS):
        cuts = defaultdict[int, list[Solid]](list)
        for a, b in pairs:
            own, other = pieces[a].class_index, pieces[b].class_index
            first, second = solids[own].moved(motions[a]), solids[other].moved(motions[b])
            pair = _Tipped(first, room[own], motions[a]), _Tipped(second, room[other], motions[b])
            for shared in (first & second).components():
                if not NOTHING_MM3 < shared.volume < MOST_OF_PIECE * min(first.volume, second.volume):
                    continue
                middle = shared.bounds.mean(axis=0)
                near = [_nearest(pieces[k], mesh_mm, middle) for k in (a, b)]
                one, two = _least(pair, shared, _ways(mesh_mm, near, shared), half_mm)
                cuts[own].append(one.moved(back[a]))
                cuts[other].append(two.moved(back[b]))
        if not cuts:
            break
        for own, cutters in cuts.items():
            mirrored = [c.moved(reflection(corners[own], mirror[own])) for c in cutters if mirror[own]]
            solids[own] = solids[own].minus_all([*cutters, *mirrored])
    return solids


def _ways(mesh_mm: TriMesh, faces: list[int], shared: Solid) -> Iterator[Floats]:
    """Unit normals (n, 3) of planes that may part two pieces, the second behind, `faces` being those next to the plane.

    First those half-way between the faces, upright on them or not, and across what the pieces share where it is
    longest, shorter and shortest; then those along what bounds that, the sides of the pieces. None runs along a face,
    and would leave something thin of it.
    """
    middle, mesh = shared.bounds.mean(axis=0), shared.mesh()
    normals = mesh_mm.face_normals[faces]
    first, second = ((way / np.linalg.norm(way)) for way in mesh_mm.middles[faces] - middle)
    away, up = first - second, normals.sum(axis=0)
    upright = away - (away @ up) / (up @ up) * up
    axes = np.linalg.svd(mesh.vertices - mesh.vertices.mean(axis=0), full_matrices=False)[2]
    sides = np.unique(np.round(mesh.face_normals[mesh.areas > 0], SAME_PLANE), axis=0)
    for ways in (np.vstack([upright, away, axes]), sides):
        unit = ways / np.linalg.norm(ways, axis=1, keepdims=True) * np.where(ways @ away > 0, 1, -1)[:, None]
        yield unit[np.abs(unit @ normals.T).max(axis=1) < ALONG_FACE]
    yield upright[None] / np.linalg.norm(upright)


def _least(pair: tuple[_Tipped, _Tipped], shared: Solid, ways: Iterable[Floats], half_mm: float) -> list[Solid]:
    """What to cut off either of two pieces, by planes that leave their pockets a wall and take the least of them.

    Planes lie on either side of the middle, or one piece gives way to the other. Tips that go whole are taken before
    others; later ways are tried where there are none of the former that do.
    """
    middle, best, least = shared.bounds.mean(axis=0), list[Solid](), (np.inf, np.inf, np.inf)
    points = shared.mesh().vertices - middle
    for some in ways:
        for normal in some:
            along = points @ normal
            for level in (0.0, float(along.min()) - half_mm, float(along.max()) + half_mm):
                at = float(middle @ normal) + level
                cuts = [one.behind(shared, k * normal, k * at + half_mm) for k, one in zip((1, -1), pair, strict=True)]
                lost = [one.lost(cut) for one, (cut, _) in zip(pair, cuts, strict=True)]
                cost = (
                    sum(room for room, _ in lost),
                    sum(not whole for _, whole in cuts),
                    max(share for _, share in lost),
                )
                if cost < least:
                    best, least = [cut for cut, _ in cuts], cost
        if least[:2] == (0, 0):
            break
    return best


def reflection(corners: Floats, image: tuple[int, ...]) -> Floats:
    """(4, 4): the improper motion that takes each corner (n, 3) of a shape to its mirror image."""
    flip = np.diag([-1.0, 1.0, 1.0, 1.0])
    return rigid_fit(corners @ flip[:3, :3], corners[list(image)]) @ flip


def _near(pieces: tuple[MergedPiece, ...]) -> list[tuple[int, int]]:
    """Pairs of pieces that have a vertex in common."""
    around = defaultdict[int, list[int]](list)
    for number, piece in enumerate(pieces):
        for vertex in piece.vertices:
            around[vertex].append(number)
    return sorted({pair for own in around.values() for pair in combinations(sorted(set(own)), 2)})


def _nearest(piece: MergedPiece, mesh_mm: TriMesh, point: Floats) -> int:
    """The piece's face whose middle is nearest to a point."""
    distance = np.linalg.norm(mesh_mm.middles[list(piece.faces)] - point, axis=1)
    return piece.faces[int(distance.argmin())]
