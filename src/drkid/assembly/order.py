"""Order of building: a shell that grows with a short open border and without holes, up to a given last piece.

On a surface without handles every piece but the last can be added along one unbroken stretch of its outline, so that
what stands and what is missing stay one patch each (a shelling; triangulated spheres and discs can be shelled whatever
the beginning: Danaraj and Klee 1978). No piece then has to be squeezed in between neighbours on all sides.
"""

import heapq
from collections import deque
from collections.abc import Callable, Sequence

import numpy as np

from drkid.assembly.piece_graph import PieceGraph
from drkid.kit import Step
from drkid.mesh import Floats

Waiting = Callable[[int, int], float]
"""How long a piece should wait: of the piece, and of its number in the order in which the border met it."""

ROUNDING = 1e-9  # of a mean side: borders that differ by less are equal, so that rounding does not choose


def order(graph: PieceGraph, lengths: Floats, last: int) -> tuple[int, ...]:
    """Every piece once, each after the first beside one that stands, `last` at the end; `lengths` (J,) of the joints.

    Grown from the piece farthest from the last one. Next comes the piece that touches what stands along one stretch,
    lengthens the border least, and has a corner that lacks the fewest other pieces. What is left of the choice is
    made in several ways, and that order is taken whose border is shortest on average.
    """
    first = breadth_first(graph, last)[-1]
    depth = _depths(graph, first)
    ways: tuple[Waiting, ...] = (lambda _, met: met, lambda _, met: -met, lambda piece, _: depth[piece])
    mean = float(lengths.mean())
    found = [_grown(graph, lengths, first, last, way) for way in ways]
    return min(found, key=lambda one: round(float(border_lengths(graph, lengths, one).mean()) / mean / ROUNDING))


def steps(graph: PieceGraph, pieces: Sequence[int], faces: Sequence[int]) -> tuple[Step, ...]:
    """The order of `pieces` as steps: each names a face of its piece, `faces[p]`, and those of the standing ones."""
    rank = {piece: i for i, piece in enumerate(pieces)}
    return tuple(
        Step(faces[p], tuple(sorted({faces[n] for n in graph.neighbours[p] if n >= 0 and rank[n] < i})))
        for i, p in enumerate(pieces)
    )


def breadth_first(graph: PieceGraph, first: int) -> tuple[int, ...]:
    """The pieces as breadth-first search from `first` meets them."""
    return tuple(_depths(graph, first))


def border_lengths(graph: PieceGraph, lengths: Floats, pieces: Sequence[int]) -> Floats:
    """(P,): length of the open border after each step; `lengths` (J,) of the joints."""
    step = np.argsort(np.asarray(pieces))
    pair = np.sort(step[graph.pieces], axis=1)
    change = np.zeros(len(pieces) + 1)
    np.add.at(change, pair[:, 0], lengths)
    np.subtract.at(change, pair[:, 1], lengths)
    return np.cumsum(change)[:-1]


def stretches(graph: PieceGraph, pieces: Sequence[int]) -> list[tuple[int, int]]:
    """For each step: on how many of its sides the piece meets standing ones, and in how many unbroken stretches.

    A corner at which others stand, though neither side beside it does, is a stretch too: the shell closes around a
    hole there.
    """
    standing, corners, found = set[int](), set[int](), list[tuple[int, int]]()
    for piece in pieces:
        found.append(_touch(graph, piece, standing, corners))
        standing.add(piece)
        corners.update(graph.outlines[piece])
    return found


def _touch(graph: PieceGraph, piece: int, standing: set[int] | dict[int, None], corners: set[int]) -> tuple[int, int]:
    sides = [n in standing for n in graph.neighbours[piece]]
    begun = sum(here and not sides[i - 1] for i, here in enumerate(sides))
    lone = sum(vertex in corners and not (sides[i] or sides[i - 1]) for i, vertex in enumerate(graph.outlines[piece]))
    return sum(sides), (1 if all(sides) else begun) + lone


def _depths(graph: PieceGraph, first: int) -> dict[int, int]:
    depth, queue = {first: 0}, deque([first])
    while queue:
        piece = queue.popleft()
        for other in graph.neighbours[piece]:
            if other >= 0 and other not in depth:
                depth[other] = depth[piece] + 1
                queue.append(other)
    return depth


def _grown(graph: PieceGraph, lengths: Floats, first: int, last: int, way: Waiting) -> tuple[int, ...]:
    """Greedy growth by a priority queue; entries that have been overtaken are passed over."""
    around = _pieces_at(graph)
    missing = {vertex: len(pieces) for vertex, pieces in around.items()}
    growth, mean = _side_lengths(graph, lengths), float(lengths.mean())
    standing: dict[int, None] = {}
    corners: set[int] = set()
    met = {first: 0}

    def entry(piece: int) -> tuple[bool, bool, int, int, float, int]:
        _, parts = _touch(graph, piece, standing, corners)
        longer = sum(
            -length if n in standing else length
            for n, length in zip(graph.neighbours[piece], growth[piece], strict=True)
        )
        fewest = min(missing[v] for v in graph.outlines[piece])
        return piece == last, parts > 1, round(2 * longer / mean), fewest, way(piece, met[piece]), piece

    queue = [entry(first)]
    while queue:
        current = heapq.heappop(queue)
        piece = current[-1]
        if piece in standing or current != entry(piece):
            continue
        standing[piece] = None
        corners.update(graph.outlines[piece])
        for vertex in graph.outlines[piece]:
            missing[vertex] -= 1
        for n in graph.neighbours[piece]:
            met.setdefault(n, len(met))
        for n in {n for vertex in graph.outlines[piece] for n in around[vertex]}:
            if n in met and n not in standing:
                heapq.heappush(queue, entry(n))
    return tuple(standing)


def _side_lengths(graph: PieceGraph, lengths: Floats) -> list[list[float]]:
    found = [[0.0] * len(outline) for outline in graph.outlines]
    for pair, sides, length in zip(graph.pieces.tolist(), graph.sides.tolist(), lengths.tolist(), strict=True):
        for piece, side in zip(pair, sides, strict=True):
            found[piece][side] = length
    return found


def _pieces_at(graph: PieceGraph) -> dict[int, list[int]]:
    around: dict[int, list[int]] = {}
    for piece, outline in enumerate(graph.outlines):
        for vertex in outline:
            around.setdefault(vertex, []).append(piece)
    return around
