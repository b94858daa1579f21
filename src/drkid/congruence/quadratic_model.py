"""The quadratic rigidity model: what a change of labels or an edge flip would cost, without solving again.

Around a mesh x the best small move y for given labels minimises

    |J y − b|² + w² (o + N y)ᵀ K (o + N y) + μ² |y|²,   b = L[labels] − lengths,

with the rigidity matrix J, the offsets o from the target along its normals N, and K = I + β² ΛᵀΛ. Its Hessian
H = JᵀJ + w² NᵀKN + μ² I is inverted once and kept dense. With the residual g = b − J y at the minimiser y:

* changing the wanted lengths by D changes the minimum by 2 Σ D_i g_i + Σ D_i D_j (δ_ij − J_i H⁻¹ J_jᵀ);
* taking row k out of J changes it by −g_k² / (1 − J_k H⁻¹ J_kᵀ), and putting another in by the like of it.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from drkid.congruence.framework import Framework
from drkid.congruence.levenberg_marquardt import springs_of
from drkid.congruence.linearisation import Springs, slope_at, tried_at
from drkid.congruence.target import Target
from drkid.mesh import Bools, Floats, Ints, TriMesh


class Connectivity(NamedTuple):
    """A closed mesh in arrays that kernels change.

    `faces` and `face_edges` (F, 3): side i of a face runs from its corner i to the next; `edges`, `edge_faces` (E, 2);
    `valence` (V,); `joined` (V, V).
    """

    faces: Ints
    face_edges: Ints
    edges: Ints
    edge_faces: Ints
    valence: Ints
    joined: Bools


class QuadraticModel(NamedTuple):
    """What pricing needs, all changed in place as moves are taken.

    `inverse` H⁻¹ (3V, 3V); `coupling` J H⁻¹ Jᵀ (E, E); `shift` the minimiser y (3V,); `residual` g (E,); of each edge
    its unit vector `direction` (E, 3) and `length` (E,) at the positions (V, 3) where the model was made.
    """

    inverse: Floats
    coupling: Floats
    shift: Floats
    residual: Floats
    direction: Floats
    length: Floats
    position: Floats


def connectivity(mesh: TriMesh) -> Connectivity:
    """Writable connectivity of a closed mesh."""
    joined = np.zeros((len(mesh.vertices),) * 2, np.bool_)
    joined[mesh.edges[:, 0], mesh.edges[:, 1]] = joined[mesh.edges[:, 1], mesh.edges[:, 0]] = True
    return Connectivity(
        mesh.faces.copy(),
        mesh.face_edges.copy(),
        mesh.edges.copy(),
        mesh.edge_faces.copy(),
        mesh.valence.copy(),
        joined,
    )


@njit(cache=True, _nrt=False)
def _fill_coupling(inverse: Floats, edges: Ints, direction: Floats, half: Floats, out: Floats) -> None:
    """J H⁻¹ Jᵀ into `out` (E, E), by way of `half`, J H⁻¹ (E, 3V)."""
    for e in range(len(edges)):
        for r in range(3):
            head, tail = inverse[3 * edges[e, 1] + r], inverse[3 * edges[e, 0] + r]
            for i in range(len(inverse)):
                half[e, i] += direction[e, r] * (head[i] - tail[i])
        for f in range(e + 1):
            total = 0.0
            for r in range(3):
                total += direction[f, r] * (half[e, 3 * edges[f, 1] + r] - half[e, 3 * edges[f, 0] + r])
            out[e, f] = out[f, e] = total


@njit(cache=True, nogil=True)
def _inverse_and_coupling(
    vertices: Floats, lengths: Floats, springs: Springs, damping: float
) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """H⁻¹ (3V, 3V), J H⁻¹ Jᵀ (E, E), the minimiser y (3V,), −J y (E,) and the edges' unit vectors; `damping` is μ².

    Raises:
        numpy.linalg.LinAlgError: an edge has no length, or H is singular.
    """
    edges, slots = springs.edges, np.zeros(len(vertices), np.int64)
    slope = slope_at(tried_at(vertices, lengths, springs, slots), springs)
    for i in range(len(slope.gradient)):
        slope.hessian[i, i] += damping
    inverse = np.linalg.inv(slope.hessian)
    inverse = (inverse + inverse.T) / 2
    half, coupling = np.zeros((len(edges), len(inverse))), np.empty((len(edges), len(edges)))
    _fill_coupling(inverse, edges, slope.direction, half, coupling)
    shift = -np.dot(inverse, slope.gradient)
    return inverse, coupling, shift, np.dot(half, slope.gradient), slope.direction


def quadratic_model(frame: Framework, target: Target, weight: float, damping: float) -> QuadraticModel:
    """The model at a framework, with the weight w of the shape and the damping μ.

    Raises:
        numpy.linalg.LinAlgError: an edge has no length, or the model is singular.
    """
    vertices = np.array(frame.mesh.vertices)
    springs = springs_of(frame, target, weight, "none")
    inverse, coupling, shift, stretched, direction = _inverse_and_coupling(
        vertices, frame.lengths.copy(), springs, damping**2
    )
    residual = stretched - frame.residual
    return QuadraticModel(inverse, coupling, shift, residual, direction, frame.mesh.edge_lengths.copy(), vertices)


@njit(cache=True, inline="always")
def compliance(inverse: Floats, a: Ints, da: Floats, b: Ints, db: Floats) -> float:
    """J_a H⁻¹ J_bᵀ of two edges, given their ends (pairs) and unit vectors."""
    i, j, k, m = 3 * a[0], 3 * a[1], 3 * b[0], 3 * b[1]
    total = 0.0
    for r in range(3):
        for s in range(3):
            total += (
                da[r]
                * db[s]
                * (inverse[i + r, k + s] - inverse[i + r, m + s] - inverse[j + r, k + s] + inverse[j + r, m + s])
            )
    return total


@njit(cache=True, _nrt=False)
def push(inverse: Floats, shift: Floats, ends: Ints, direction: Floats, force: float) -> None:
    """Add H⁻¹ J_eᵀ `force` to `shift`: the answer of the whole mesh to a change of one wanted length."""
    for r in range(3):
        head, tail = inverse[3 * ends[1] + r], inverse[3 * ends[0] + r]
        factor = force * direction[r]
        for i in range(len(shift)):
            shift[i] += factor * (head[i] - tail[i])


@njit(cache=True, inline="always")
def stretch(shift: Floats, ends: Ints, direction: Floats) -> float:
    """J_e y: the first-order change of an edge's length."""
    total = 0.0
    for r in range(3):
        total += direction[r] * (shift[3 * ends[1] + r] - shift[3 * ends[0] + r])
    return total


@njit(cache=True, inline="always")
def price_of_labels(
    model: QuadraticModel, lengths: Floats, labels: Ints, changed: Ints, new: Ints, count: int
) -> float:
    """Change of the minimum if `count` edges in `changed` get the labels `new` in place of `labels` (E,)."""
    total = 0.0
    for p in range(count):
        e = changed[p]
        step = lengths[new[p]] - lengths[labels[e]]
        total += step * (2 * model.residual[e] + step)
        for q in range(count):
            f = changed[q]
            total -= step * (lengths[new[q]] - lengths[labels[f]]) * model.coupling[e, f]
    return float(total)


@njit(cache=True, _nrt=False)
def take_label(model: QuadraticModel, edges: Ints, e: int, step: float) -> None:
    """Let the wanted length of edge e grow by `step`."""
    row = model.coupling[e]
    for f in range(len(row)):
        model.residual[f] -= step * row[f]
    model.residual[e] += step
    push(model.inverse, model.shift, edges[e], model.direction[e], step)


class Move(NamedTuple):
    """Room for a proposal: edges to relabel and their new labels (8,), and the flipped edge's ends and unit vector.

    `pull` (E,) and `sag` (3V,) are room for what taking a flip works out.
    """

    edge: Ints
    label: Ints
    ends: Ints
    direction: Floats
    pull: Floats
    sag: Floats


class FlipPrice(NamedTuple):
    """Change of the minimum, and the forces that carry the minimiser: out of the old row, into the new one."""

    price: float
    release: float
    load: float


@njit(cache=True, inline="always")
def price_of_flip(softness: float, across: float, own: float, old_residual: float, new_residual: float) -> FlipPrice:
    """Take a row out of J and put another in.

    `softness` is 1 − J_k H⁻¹ J_kᵀ of the old row k, `own` J_m H⁻¹ J_mᵀ of the new row m, `across` J_m H⁻¹ J_kᵀ, and
    the residuals are theirs at the present minimiser.
    """
    if softness < 1e-9:  # without this edge the model would be singular
        return FlipPrice(np.inf, 0.0, 0.0)
    misfit = new_residual + across * old_residual / softness
    price = misfit * misfit / (1.0 + own + across * across / softness) - old_residual * old_residual / softness
    return FlipPrice(price, -old_residual / softness, misfit)


@njit(cache=True, _nrt=False)
def _add_outer(matrix: Floats, column: Floats, factor: float) -> None:
    """Add factor · column columnᵀ."""
    for i in range(len(column)):
        scaled = factor * column[i]
        row = matrix[i]
        for j in range(len(column)):
            row[j] += scaled * column[j]


@njit(cache=True, inline="always")
def _clear(values: Floats) -> None:
    for i in range(len(values)):
        values[i] = 0.0


@njit(cache=True, _nrt=False)
def _add_row(model: QuadraticModel, pull: Floats, sag: Floats, factor: float, force: float) -> None:
    """The rank-one change of H⁻¹ and J H⁻¹ Jᵀ, and the minimiser's answer to `force`."""
    _add_outer(model.inverse, sag, factor)
    _add_outer(model.coupling, pull, factor)
    for i in range(len(sag)):
        model.shift[i] += force * sag[i]
    for e in range(len(pull)):
        model.residual[e] -= force * pull[e]


@njit(cache=True, _nrt=False)
def take_flip(model: QuadraticModel, edges: Ints, k: int, length: float, found: FlipPrice, move: Move) -> None:
    """Take row k out and put in that of the edge in `move`; `found` is the flip's price (Sherman and Morrison 1950)."""
    pull, sag = move.pull, move.sag
    for e in range(len(pull)):
        pull[e] = model.coupling[k, e]
    _clear(sag)
    push(model.inverse, sag, edges[k], model.direction[k], 1.0)
    _add_row(model, pull, sag, 1.0 / (1.0 - pull[k]), found.release)
    _clear(sag)
    push(model.inverse, sag, move.ends, move.direction, 1.0)
    share = 1.0 / (1.0 + stretch(sag, move.ends, move.direction))
    for e in range(len(pull)):
        pull[e] = stretch(sag, edges[e], model.direction[e])
    _add_row(model, pull, sag, -share, share * found.load)
    for e in range(len(pull)):
        model.coupling[k, e] = model.coupling[e, k] = share * pull[e]
    model.coupling[k, k] = 1.0 - share
    model.residual[k] = share * found.load
    model.length[k] = length
    for r in range(3):
        model.direction[k, r] = move.direction[r]
