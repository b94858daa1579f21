"""Alternating cycles of the dual graph: two labels exchanged around a cycle leave every face its multiset.

The moves of an annealing whose palette lets no label change alone. A walk crosses from face to face through edges whose
labels alternate, p q p q; where it meets itself after an even number of edges it closes a cycle, and what led there is
dropped. With one class of triangles these are the alternating cycles between two perfect matchings (Lovász and Plummer
1986, chapter 1); with more labels they are Kempe chains.
"""

import numpy as np
from numba import njit

from drkid.congruence.quadratic_model import Connectivity, Move
from drkid.mesh import Bools, Ints

LONGEST_CYCLE = 24


@njit(cache=True, inline="always")
def propose_cycle(
    net: Connectivity, labels: Ints, rng: np.random.Generator, active: Ints, free: Bools, move: Move
) -> int:
    """Fill `move` with an alternating cycle of free edges, no longer than it has room; its length, 0 for none."""
    edge = active[int(rng.random() * len(active))]
    face, wanted = net.edge_faces[edge, int(rng.random() * 2)], -1
    for count in range(len(move.edge)):
        move.edge[count], move.label[count] = edge, face  # on the way `label` holds the faces that the walk left
        face = net.edge_faces[edge, 0] + net.edge_faces[edge, 1] - face
        for first in range(count + 1):
            if move.label[first] == face:
                return _closed(labels, move, first, count + 1 - first)
        following = _onward(net, labels, rng, free, face, edge, wanted)
        if following < 0:
            return 0
        wanted, edge = labels[edge], following
    return 0


@njit(cache=True, inline="always")
def _onward(
    net: Connectivity, labels: Ints, rng: np.random.Generator, free: Bools, face: int, edge: int, wanted: int
) -> int:
    """A free edge through which to leave the face entered by `edge`, of the wanted label or (−1) any other; or −1."""
    turn = int(rng.random() * 3)
    for i in range(3):
        other = net.face_edges[face, (turn + i) % 3]
        fits = labels[other] == wanted if wanted >= 0 else labels[other] != labels[edge]
        if other != edge and free[other] and fits:
            return other
    return -1


@njit(cache=True, inline="always")
def _closed(labels: Ints, move: Move, first: int, count: int) -> int:
    """Drop what leads to the cycle and exchange its labels; 0 where they do not alternate all the way around."""
    if count % 2:
        return 0
    for i in range(count):
        move.edge[i] = move.edge[first + i]
    for i in range(count):
        move.label[i] = labels[move.edge[(i + 1) % count]]
    return count


def cycle_share(allowed: Bools) -> float:
    """Share of the relabelling moves that cycles are to have, given which labels (q, q, q) a face may have.

    All of them with one class, where nothing else is ever allowed; half where no label can change alone; else none.
    """
    if (allowed.sum(axis=2) > 1).any():
        return 0.0
    classes = sum(bool(allowed[a, b, c]) for a, b, c in zip(*np.nonzero(allowed), strict=True) if a <= b <= c)
    return 1.0 if classes == 1 else 0.5
