"""Simulated annealing of edge labels and edge flips in the quadratic model (Kirkpatrick et al. 1983).

Misfits are not rounded away one by one but cancel at a distance: error diffusion. A move changes one label, swaps two
in a face, changes two or three around an edge, or flips an edge together with up to two labels beside it; where no
label can change alone it exchanges labels along an alternating cycle. Only moves that leave every touched face in the
allowed multisets are priced.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from drkid.congruence.alternating_cycle import LONGEST_CYCLE, cycle_share, propose_cycle
from drkid.congruence.quadratic_model import (
    Connectivity,
    FlipPrice,
    Move,
    QuadraticModel,
    compliance,
    price_of_flip,
    price_of_labels,
    stretch,
    take_flip,
    take_label,
)
from drkid.mesh import Bools, Floats, Ints

LEAST_VALENCE, MOST_VALENCE = 4, 8
SHORTEST, LONGEST = 0.55, 1.75  # of a flipped edge, in shortest and longest lengths of the palette
LEAST_COSINE = 0.5  # between the normals across a flipped edge: 60°
LEAST_AREA = 0.25  # twice the area of a new face, in squares of the shortest length
SINGLE, SWAP = 0.45, 0.80  # cumulative shares of the relabelling moves; the rest changes two or three around an edge
END = 1e-3  # last temperature, of the first


class Schedule(NamedTuple):
    """How to anneal: the first temperature, steps, share of flips; `active` edges (n,), and is an edge `free` (E,)?

    `cycles` is the share of alternating cycles among the relabelling moves, at least what the palette needs.
    """

    temperature: float
    steps: int
    flips: float
    active: Ints
    free: Bools
    cycles: float = 0.0


@njit(cache=True, inline="always")
def _draw(rng: np.random.Generator, count: int) -> int:
    """A whole number in [0, count)."""
    return int(rng.random() * count)


@njit(cache=True, inline="always")
def side_of(net: Connectivity, face: int, edge: int) -> int:
    """Which side of a face an edge is."""
    for i in range(3):
        if net.face_edges[face, i] == edge:
            return i
    return -1


@njit(cache=True, inline="always")
def face_is_allowed(net: Connectivity, labels: Ints, allowed: Bools, face: int) -> bool:
    """Are the labels of a face one of the multisets?"""
    a, b, c = net.face_edges[face]
    return bool(allowed[labels[a], labels[b], labels[c]])


@njit(cache=True, inline="always")
def _other(rng: np.random.Generator, label: int, count: int) -> int:
    """A label different from the given one."""
    drawn = _draw(rng, count - 1)
    return drawn if drawn < label else drawn + 1


@njit(cache=True, inline="always")
def _propose_swap(net: Connectivity, labels: Ints, rng: np.random.Generator, schedule: Schedule, move: Move) -> int:
    face = net.edge_faces[schedule.active[_draw(rng, len(schedule.active))], _draw(rng, 2)]
    i = _draw(rng, 3)
    a, b = net.face_edges[face, i], net.face_edges[face, (i + 1) % 3]
    if labels[a] == labels[b]:
        return 0
    move.edge[0], move.edge[1] = a, b
    move.label[0], move.label[1] = labels[b], labels[a]
    return 2


@njit(cache=True, inline="always")
def _propose_around(
    net: Connectivity, labels: Ints, rng: np.random.Generator, schedule: Schedule, move: Move, lengths: Floats
) -> int:
    """Two or three of the five edges of two neighbouring faces."""
    centre = schedule.active[_draw(rng, len(schedule.active))]
    wanted, count = 2 + _draw(rng, 2), 0
    while count < wanted:
        edge = net.face_edges[net.edge_faces[centre, _draw(rng, 2)], _draw(rng, 3)]
        fresh = True
        for i in range(count):
            fresh = fresh and move.edge[i] != edge
        if fresh:
            move.edge[count], move.label[count] = edge, _other(rng, int(labels[edge]), len(lengths))
            count += 1
    return count


@njit(cache=True, inline="always")
def _propose(
    net: Connectivity, labels: Ints, rng: np.random.Generator, schedule: Schedule, move: Move, lengths: Floats
) -> int:
    """Fill `move` with a relabelling; how many edges it changes, 0 for none."""
    if schedule.cycles > 0 and rng.random() < schedule.cycles:
        return propose_cycle(net, labels, rng, schedule.active, schedule.free, move)
    kind = rng.random()
    if kind < SINGLE:
        edge = schedule.active[_draw(rng, len(schedule.active))]
        move.edge[0], move.label[0] = edge, _other(rng, int(labels[edge]), len(lengths))
        count = 1
    elif kind < SWAP:
        count = _propose_swap(net, labels, rng, schedule, move)
    else:
        count = _propose_around(net, labels, rng, schedule, move, lengths)
    for i in range(count):
        if not schedule.free[move.edge[i]]:
            return 0
    return count


@njit(cache=True, inline="always")
def _exchange(labels: Ints, move: Move, count: int) -> None:
    """Put the move's labels in and take the old ones out; called again it takes the move back."""
    for i in range(count):
        labels[move.edge[i]], move.label[i] = move.label[i], labels[move.edge[i]]


@njit(cache=True, inline="always")
def _is_allowed(net: Connectivity, labels: Ints, allowed: Bools, move: Move, count: int, skip: int, skip2: int) -> bool:
    """Do all faces at the move's edges have allowed labels, two faces left out?"""
    for i in range(count):
        for side in range(2):
            face = net.edge_faces[move.edge[i], side]
            if face not in (skip, skip2) and not face_is_allowed(net, labels, allowed, face):
                return False
    return True


@njit(cache=True, inline="always")
def _accepts(rng: np.random.Generator, price: float, temperature: float) -> bool:
    return price <= 0 or rng.random() < np.exp(-price / temperature)


@njit(cache=True, _nrt=False)
def _take_labels(
    net: Connectivity, model: QuadraticModel, labels: Ints, lengths: Floats, move: Move, count: int
) -> None:
    for i in range(count):
        e = move.edge[i]
        take_label(model, net.edges, e, float(lengths[move.label[i]] - lengths[labels[e]]))
        labels[e] = move.label[i]


@njit(cache=True, inline="always")
def _relabel(
    net: Connectivity,
    model: QuadraticModel,
    labels: Ints,
    lengths: Floats,
    allowed: Bools,
    rng: np.random.Generator,
    schedule: Schedule,
    move: Move,
    temperature: float,
) -> float:
    """One relabelling step; the change of the energy, 0 where it was not taken."""
    count = _propose(net, labels, rng, schedule, move, lengths)
    if count == 0:
        return 0.0
    _exchange(labels, move, count)
    fine = _is_allowed(net, labels, allowed, move, count, -1, -1)
    _exchange(labels, move, count)
    if not fine:
        return 0.0
    price = price_of_labels(model, lengths, labels, move.edge, move.label, count)
    if not _accepts(rng, price, temperature):
        return 0.0
    _take_labels(net, model, labels, lengths, move, count)
    return price


# ---- flips

QUAD = ((1, 2), (2, 0), (0, 3), (3, 1))  # the sides of the quadrilateral a b c d: bc, ca, ad, db


@njit(cache=True, inline="always")
def quad_of(
    net: Connectivity, edge: int
) -> tuple[tuple[int, int, int, int], tuple[int, int], tuple[int, int, int, int]]:
    """Corners a, b (ends of the edge), c, d (opposite), its faces, and its sides bc, ca, ad, db.

    The first face is (a, b, c), the second (b, a, d).
    """
    f, g = net.edge_faces[edge]
    i, j = side_of(net, f, edge), side_of(net, g, edge)
    a, b, c = net.faces[f, i], net.faces[f, (i + 1) % 3], net.faces[f, (i + 2) % 3]
    d = net.faces[g, (j + 2) % 3]
    bc, ca = net.face_edges[f, (i + 1) % 3], net.face_edges[f, (i + 2) % 3]
    ad, db = net.face_edges[g, (j + 1) % 3], net.face_edges[g, (j + 2) % 3]
    return (a, b, c, d), (f, g), (bc, ca, ad, db)


@njit(cache=True, _nrt=False)
def flip(net: Connectivity, edge: int) -> None:
    """Turn an edge in the quadrilateral of its faces: they become (a, d, c) and (d, b, c)."""
    (a, b, c, d), (f, g), (bc, ca, ad, db) = quad_of(net, edge)
    net.faces[f, 0], net.faces[f, 1], net.faces[f, 2] = a, d, c
    net.face_edges[f, 0], net.face_edges[f, 1], net.face_edges[f, 2] = ad, edge, ca
    net.faces[g, 0], net.faces[g, 1], net.faces[g, 2] = d, b, c
    net.face_edges[g, 0], net.face_edges[g, 1], net.face_edges[g, 2] = db, bc, edge
    for side, before, after in ((bc, f, g), (ad, g, f)):
        if net.edge_faces[side, 0] == before:
            net.edge_faces[side, 0] = after
        else:
            net.edge_faces[side, 1] = after
    net.edges[edge, 0], net.edges[edge, 1] = c, d
    net.joined[a, b] = net.joined[b, a] = False
    net.joined[c, d] = net.joined[d, c] = True
    net.valence[a] -= 1
    net.valence[b] -= 1
    net.valence[c] += 1
    net.valence[d] += 1


@njit(cache=True, inline="always")
def _cross(p: Floats, a: int, b: int, c: int) -> tuple[float, float, float]:
    ux, uy, uz = p[b, 0] - p[a, 0], p[b, 1] - p[a, 1], p[b, 2] - p[a, 2]
    vx, vy, vz = p[c, 0] - p[a, 0], p[c, 1] - p[a, 1], p[c, 2] - p[a, 2]
    return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


@njit(cache=True, _nrt=False)
def flip_is_sound(net: Connectivity, position: Floats, lengths: Floats, corners: tuple[int, int, int, int]) -> bool:
    """Topology and shape allow the flip: valences, no doubled edge, length, angle across it, areas."""
    a, b, c, d = corners
    if min(net.valence[a], net.valence[b]) <= LEAST_VALENCE or max(net.valence[c], net.valence[d]) >= MOST_VALENCE:
        return False
    if net.joined[c, d]:
        return False
    squared = 0.0
    for r in range(3):
        squared += (position[d, r] - position[c, r]) ** 2
    if not (SHORTEST * lengths[0]) ** 2 < squared < (LONGEST * lengths[-1]) ** 2:
        return False
    x, y, z = _cross(position, a, d, c)
    u, v, w = _cross(position, d, b, c)
    one, two = np.sqrt(x * x + y * y + z * z), np.sqrt(u * u + v * v + w * w)
    return min(one, two) > LEAST_AREA * lengths[0] ** 2 and x * u + y * v + z * w > LEAST_COSINE * one * two


@njit(cache=True, inline="always")
def _propose_beside(
    labels: Ints, rng: np.random.Generator, sides: tuple[int, int, int, int], move: Move, lengths: Floats
) -> int:
    """Up to two sides of the quadrilateral to relabel with the flip."""
    drawn = rng.random()
    count = 0 if drawn < 0.5 or len(lengths) == 1 else 1 if drawn < 0.8 else 2
    first = _draw(rng, 4)
    second = (first + (1 + _draw(rng, 3))) % 4
    for i in range(count):
        edge = sides[first] if i == 0 else sides[second]
        move.edge[i], move.label[i] = edge, _other(rng, int(labels[edge]), len(lengths))
    return count


@njit(cache=True, _nrt=False)
def _lay(position: Floats, corners: tuple[int, int, int, int], move: Move) -> float:
    """Ends and unit vector of the edge c d into `move`; its length."""
    squared = 0.0
    for r in range(3):
        move.direction[r] = position[corners[3], r] - position[corners[2], r]
        squared += move.direction[r] ** 2
    length = np.sqrt(squared)
    for r in range(3):
        move.direction[r] /= length
    move.ends[0], move.ends[1] = corners[2], corners[3]
    return length


@njit(cache=True, _nrt=False)
def _price_with_labels(
    net: Connectivity,
    model: QuadraticModel,
    labels: Ints,
    lengths: Floats,
    move: Move,
    count: int,
    edge: int,
    length: float,
    label: int,
) -> FlipPrice:
    """Price of the labels beside, then of the flip under them."""
    price = price_of_labels(model, lengths, labels, move.edge, move.label, count)
    old = model.residual[edge]
    new = lengths[label] - length - stretch(model.shift, move.ends, move.direction)
    for i in range(count):
        e = move.edge[i]
        step = lengths[move.label[i]] - lengths[labels[e]]
        old -= step * model.coupling[edge, e]
        new -= step * compliance(model.inverse, move.ends, move.direction, net.edges[e], model.direction[e])
    across = compliance(model.inverse, move.ends, move.direction, net.edges[edge], model.direction[edge])
    own = compliance(model.inverse, move.ends, move.direction, move.ends, move.direction)
    found = price_of_flip(1.0 - model.coupling[edge, edge], across, own, old, new)
    return FlipPrice(price + found.price, found.release, found.load)


@njit(cache=True, _nrt=False)
def _labels_fit(
    net: Connectivity,
    labels: Ints,
    allowed: Bools,
    move: Move,
    count: int,
    faces: tuple[int, int],
    sides: tuple[int, int, int, int],
    label: int,
) -> bool:
    """Are the two new faces and all faces beside them allowed?"""
    bc, ca, ad, db = sides
    _exchange(labels, move, count)
    fine = allowed[labels[ad], label, labels[ca]] and allowed[labels[db], labels[bc], label]
    fine = fine and _is_allowed(net, labels, allowed, move, count, faces[0], faces[1])
    _exchange(labels, move, count)
    return fine


@njit(cache=True, inline="always")
def _all_free(free: Bools, edge: int, sides: tuple[int, int, int, int]) -> bool:
    fine = free[edge]
    for side in sides:
        fine = fine and free[side]
    return fine


@njit(cache=True, inline="always")
def _try_flip(
    net: Connectivity,
    model: QuadraticModel,
    labels: Ints,
    lengths: Floats,
    allowed: Bools,
    rng: np.random.Generator,
    schedule: Schedule,
    move: Move,
    temperature: float,
) -> float:
    """One flip step; the change of the energy, 0 where it was not taken."""
    edge = schedule.active[_draw(rng, len(schedule.active))]
    corners, faces, sides = quad_of(net, edge)
    if not _all_free(schedule.free, edge, sides) or not flip_is_sound(net, model.position, lengths, corners):
        return 0.0
    label = _draw(rng, len(lengths))
    count = _propose_beside(labels, rng, sides, move, lengths)
    if not _labels_fit(net, labels, allowed, move, count, faces, sides, label):
        return 0.0
    length = _lay(model.position, corners, move)
    found = _price_with_labels(net, model, labels, lengths, move, count, edge, length, label)
    if not _accepts(rng, found.price, temperature):
        return 0.0
    _take_labels(net, model, labels, lengths, move, count)
    take_flip(model, net.edges, edge, length, found, move)
    flip(net, edge)
    labels[edge] = label
    return found.price


@njit(cache=True, nogil=True, _nrt=False)
def _anneal(
    net: Connectivity,
    model: QuadraticModel,
    labels: Ints,
    lengths: Floats,
    allowed: Bools,
    rng: np.random.Generator,
    schedule: Schedule,
    move: Move,
) -> tuple[float, int]:
    total, taken, temperature = 0.0, 0, schedule.temperature
    cooling = END ** (1.0 / schedule.steps)
    for _ in range(schedule.steps):
        if rng.random() < schedule.flips:
            change = _try_flip(net, model, labels, lengths, allowed, rng, schedule, move, temperature)
        else:
            change = _relabel(net, model, labels, lengths, allowed, rng, schedule, move, temperature)
        if change != 0.0:
            total += change
            taken += 1
        temperature *= cooling
    return total, taken


def anneal(
    net: Connectivity,
    model: QuadraticModel,
    labels: Ints,
    lengths: Floats,
    allowed: Bools,
    rng: np.random.Generator,
    schedule: Schedule,
) -> tuple[float, int]:
    """Anneal in place.

    Args:
        net: connectivity, which flips change.
        model: the quadratic model, kept up to date.
        labels: (E,) labels, changed.
        lengths: (q,) the palette.
        allowed: (q, q, q) which labels a face may have.
        rng: every random choice comes from it.
        schedule: temperatures, steps, and which edges may change.

    Returns:
        The change of the model's energy, and how many moves were taken.
    """
    move = Move(
        np.empty(LONGEST_CYCLE, np.int64),
        np.empty(LONGEST_CYCLE, np.int64),
        np.empty(2, np.int64),
        np.empty(3),
        np.empty(len(model.length)),
        np.empty(len(model.shift)),
    )
    schedule = schedule._replace(cycles=max(schedule.cycles, cycle_share(allowed)))
    # Without reference counting (no array is made inside) the loop runs six times faster: its helpers take tuples of
    # arrays, and counting each of them at every access costs more than the work.
    return _anneal(net, model, labels, lengths, allowed, rng, schedule, move)
