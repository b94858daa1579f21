"""Piece graph: which side of which piece lies along which side of another."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from drkid.mesh import Ints, read_only


@dataclass(frozen=True, eq=False)
class PieceGraph:
    """Pieces of any number of sides and the joints between them; two pieces may share several.

    `outlines[p]` are the vertices around piece p, counter-clockwise from outside; its side i runs from the i-th to the
    next. Joint j lies between side `sides[j, s]` of piece `pieces[j, s]` for s = 0 and 1; both arrays are (J, 2).
    """

    outlines: tuple[tuple[int, ...], ...]
    pieces: Ints
    sides: Ints

    @cached_property
    def neighbours(self) -> tuple[tuple[int, ...], ...]:
        """The piece beyond each side of each piece; −1 where there is none."""
        found = [[-1] * len(outline) for outline in self.outlines]
        for (a, b), (i, k) in zip(self.pieces.tolist(), self.sides.tolist(), strict=True):
            found[a][i], found[b][k] = b, a
        return tuple(map(tuple, found))

    @cached_property
    def around(self) -> dict[int, tuple[int, ...]]:
        """The pieces at each vertex."""
        found: dict[int, list[int]] = {}
        for piece, outline in enumerate(self.outlines):
            for vertex in outline:
                found.setdefault(vertex, []).append(piece)
        return {vertex: tuple(pieces) for vertex, pieces in found.items()}

    def touching(self, piece: int, side: int) -> set[int]:
        """The pieces that share an end of a piece's side with it, and no side."""
        outline = self.outlines[piece]
        ends = (outline[side], outline[(side + 1) % len(outline)])
        return {other for end in ends for other in self.around[end]} - {piece, *self.neighbours[piece]}


def piece_graph(outlines: Iterable[Sequence[int]], edges: Iterable[Sequence[int]]) -> PieceGraph:
    """The graph of pieces with these outlines, one joint for each edge, in the order of `edges`.

    The first piece of a joint is the one that runs along the edge as it is given.

    Raises:
        ValueError: an edge is not a side of two pieces, once in either direction.
    """
    found = tuple(tuple(int(v) for v in outline) for outline in outlines)
    owner: dict[tuple[int, int], tuple[int, int]] = {}
    for piece, outline in enumerate(found):
        for side, start in enumerate(outline):
            owner[start, outline[(side + 1) % len(outline)]] = piece, side
    pairs: list[tuple[tuple[int, int], tuple[int, int]]] = []
    for v, w in edges:
        if (v, w) not in owner or (w, v) not in owner:
            message = f"edge {v} {w} is not a side of two pieces"
            raise ValueError(message)
        pairs.append((owner[v, w], owner[w, v]))
    both = np.array(pairs, np.int64).reshape(-1, 2, 2)
    return PieceGraph(found, read_only(both[..., 0].copy()), read_only(both[..., 1].copy()))
