"""Hinge framework: rigid pieces, each pair of joined sides sharing one axis."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drkid.assembly.piece_graph import PieceGraph
from drkid.mesh import Floats, Ints, read_only


@dataclass(frozen=True, eq=False)
class HingeFramework:
    """What the hinges say about where pieces lie, and nothing else.

    Joint j joins pieces `pieces[j]` (J, 2). `frames` (J, 2, 4, 4) take connector to part coordinates on either side,
    `half_lengths` (J, 2) are half the lengths of the two sides, `bend_radians` (J,) is the angle between the pieces'
    normals, positive where convex.
    """

    count: int
    pieces: Ints
    frames: Floats
    half_lengths: Floats
    bend_radians: Floats

    @property
    def ends(self) -> Floats:
        """(J, 2, 2, 3): for either side of each joint both ends of its axis, which are to coincide, in its part frame.

        The axis is as long as its own side. The connector's x axis runs along its own piece's outline, so that the two
        pieces see it the other way round.
        """
        along = self.half_lengths[..., None] * self.frames[..., :3, 0]
        signed = np.stack([along[:, 0], -along[:, 1]], axis=1)
        middle = self.frames[..., :3, 3]
        return read_only(np.stack([middle - signed, middle + signed], axis=2))

    def gaps(self, placements: Floats) -> Floats:
        """(J, 2, 3): the first piece's end of the axis less the second's, at both ends, for placements (P, 4, 4)."""
        placed = placements[self.pieces]
        ends = np.einsum("jsab,jseb->jsea", placed[..., :3, :3], self.ends) + placed[:, :, None, :3, 3]
        return ends[:, 0] - ends[:, 1]


def hinge_framework(
    graph: PieceGraph,
    corners: Sequence[Floats],
    side_frames: Sequence[Floats],
    bend_radians: Floats,
) -> HingeFramework:
    """The framework of a graph whose piece p has `corners[p]` (n, 3) and `side_frames[p]` (n, 4, 4) in its frame."""
    joints = list(zip(graph.pieces.tolist(), graph.sides.tolist(), strict=True))
    frames = np.array([[side_frames[p][i] for p, i in zip(*joint, strict=True)] for joint in joints])
    lengths = [np.linalg.norm(np.roll(c, -1, axis=0) - c, axis=1) for c in corners]
    sides = np.array([[lengths[p][i] for p, i in zip(*joint, strict=True)] for joint in joints])
    return HingeFramework(
        len(graph.outlines),
        graph.pieces,
        read_only(frames.reshape(-1, 2, 4, 4)),
        read_only(sides / 2),
        read_only(np.asarray(bend_radians, np.float64)),
    )
