"""Structure: placed parts and their joints, whether they come from a kit that is being made or from a kit's files."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from drkid.assembly.closure import Joining, Play, joined
from drkid.assembly.hinge_framework import HingeFramework, hinge_framework
from drkid.assembly.insertion import Insertion, Placed, last_piece
from drkid.assembly.order import border_lengths, breadth_first, order, stretches
from drkid.assembly.overlap import Bodies, Placements, overlapping
from drkid.assembly.piece_graph import PieceGraph
from drkid.assembly.swing import sectors, swing
from drkid.kit import Building, ConnectorKind, Overlapping, Swing
from drkid.mesh import Floats
from drkid.solid import Solid

TOUCHING_DEGREES = 0.5  # less than the swing that bevels leave room for: there they touch
TIP = 0.1  # of a side at either end, where a merged piece's swing is not told by sectors
SAME_BEND = 1e-6  # radians: bends that differ by less are equal, so that rounding does not choose


@dataclass(frozen=True, eq=False)
class Shape:
    """A printed part: its corners (n, 3), connector frames (n, 4, 4) and solid, in its part frame."""

    corners: Floats
    side_frames: Floats
    solid: Solid

    def beside(self, side: int) -> Solid:
        """What of the part lies beside a side: all of a triangle, less of a piece that is merged.

        Its other triangles may lie across the axis beyond the side's ends: `overlapping` looks at those.
        """
        if len(self.corners) == 3:
            return self.solid
        a, b = self.corners[[side, (side + 1) % len(self.corners)]]
        ends, along = np.array([[1 - TIP, TIP], [TIP, 1 - TIP]]) @ np.stack([a, b]), b - a
        return self.solid.beyond(along, float(along @ ends[0])).beyond(-along, -float(along @ ends[1]))


@dataclass(frozen=True, eq=False)
class Structure:
    """Everything that the proofs of an assembly look at; lengths in mm.

    Piece p is made from `shapes[parts[p]]`, lies at `placements[p]` and belongs with its corners at `targets[p]`;
    `faces[p]` is a face of M_f that it covers. `bend_radians` (J,) are the joints' angles, positive where convex.
    `connectors` are the hinge's halves, the first and the last for either side of a joint, or the one key, or none.
    """

    graph: PieceGraph
    shapes: Sequence[Shape]
    parts: Sequence[int]
    faces: Sequence[int]
    placements: Floats
    targets: Sequence[Floats]
    bend_radians: Floats
    connector: ConnectorKind
    connectors: Sequence[Solid]
    play: Play

    @cached_property
    def framework(self) -> HingeFramework:
        """What the hinges alone say."""
        corners = [self.shapes[part].corners for part in self.parts]
        frames = [self.shapes[part].side_frames for part in self.parts]
        return hinge_framework(self.graph, corners, frames, self.bend_radians)

    @cached_property
    def joint_lengths(self) -> Floats:
        """(J,): length of each joint on M_f."""
        both = zip(self.graph.pieces[:, 0].tolist(), self.graph.sides[:, 0].tolist(), strict=True)
        ends = np.array([[self.targets[p][i], self.targets[p][(i + 1) % len(self.targets[p])]] for p, i in both])
        return np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)

    @cached_property
    def lean_radians(self) -> float:
        """How far the connectors' frames lean inwards from their pieces: a key's do, by half of its bend.

        At a joint that bends by δ they are 180° − δ − 2·lean apart; told by the flatter half of the joints.
        """
        if self.connector != "box":
            return 0.0
        inwards = (self.placements[self.graph.pieces] @ self.framework.frames)[..., :3, 1]
        apart = np.arccos(np.clip(np.einsum("jk,jk->j", inwards[:, 0], inwards[:, 1]), -1, 1))
        flat = np.argsort(np.abs(self.bend_radians))[: (len(apart) + 1) // 2]
        return float(np.median((np.pi - self.bend_radians - apart)[flat])) / 2

    def joining(self) -> Joining:
        """The virtual assembly."""
        first = np.cumsum([0, *(len(shape.corners) for shape in self.shapes)])
        moulds = first[np.asarray(self.parts)[self.graph.pieces]] + self.graph.sides
        corners = tuple(self.shapes[part].corners for part in self.parts)
        return joined(self.framework, corners, tuple(self.targets), np.asarray(self.faces), moulds, self.play)

    def swinging(self, wanted_degrees: float) -> Swing:
        """How far the hinges turn, or would, where a key holds them."""
        upright = np.eye(4)
        cosine, sine = np.cos(self.lean_radians), np.sin(self.lean_radians)
        upright[1:3, 1:3] = [[cosine, -sine], [sine, cosine]]
        reach = [
            np.array(
                [
                    sectors(shape.beside(side).mesh().vertices, frame @ upright)
                    for side, frame in enumerate(shape.side_frames)
                ]
            )
            for shape in self.shapes
        ]
        return swing(self.framework, self.parts, self.graph.sides, reach, wanted_degrees)[0]

    def overlapping(self, swing_degrees: float) -> Overlapping:
        """Which pieces reach into one another, at their places and within a little less than the swing."""
        return overlapping(
            Bodies([shape.solid for shape in self.shapes]),
            Placements(self.parts, self.faces, self.placements),
            self.framework,
            self.graph,
            max(swing_degrees - TOUCHING_DEGREES, 0.0),
        )

    def by_convexity(self) -> tuple[int, ...]:
        """The pieces, that one first whose least convex joint is the most convex: neighbours do not lean over it."""
        least = np.full(len(self.parts), np.inf)
        for side in (0, 1):
            np.minimum.at(least, self.graph.pieces[:, side], self.bend_radians)
        return tuple(np.argsort(-np.round(least / SAME_BEND), kind="stable").tolist())

    def insertion(self, thickness_mm: float, candidates: Sequence[int]) -> Insertion:
        """The first of the candidates that goes in last, or else the one that is hindered least."""
        bodies = [self.shapes[p].solid.moved(m) for p, m in zip(self.parts, self.placements, strict=True)]
        return last_piece(Placed(bodies, self._halves(), self.placements, thickness_mm), candidates)

    def order(self, last: int) -> tuple[int, ...]:
        """An order to build in, `last` at the end."""
        return order(self.graph, self.joint_lengths, last)

    def building(self, pieces: Sequence[int], last: Insertion) -> Building:
        """What an order is like."""
        borders = border_lengths(self.graph, self.joint_lengths, pieces)
        plain = border_lengths(self.graph, self.joint_lengths, breadth_first(self.graph, pieces[0]))
        touched = stretches(self.graph, pieces)
        sides = [len(self.graph.outlines[p]) for p in pieces]
        return Building(
            border_mean_mm=float(borders.mean()),
            border_max_mm=float(borders.max()),
            breadth_first_mean_mm=float(plain.mean()),
            enclosed=sum(n == k for (n, _), k in zip(touched[:-1], sides[:-1], strict=True)),
            bridges=sum(parts > 1 for _, parts in touched),
            last_goes_in=last.goes_in,
            last_overlap_percent=last.overlap_percent,
            last_candidates=last.candidates,
        )

    def _halves(self) -> list[list[Solid]]:
        """For each piece the connectors that stand when it comes last: its neighbours', both halves of each hinge."""
        found: list[list[Solid]] = [[] for _ in self.parts]
        if not self.connectors:
            return found
        frames = self.placements[self.graph.pieces] @ self.framework.frames
        for pair, both in zip(self.graph.pieces.tolist(), frames, strict=True):
            solids = [self.connectors[-side].moved(both[side]) for side in (0, 1)]
            for side in (0, 1):
                found[pair[side]] += solids if self.connector == "hinge" else [solids[1 - side]]
        return found
