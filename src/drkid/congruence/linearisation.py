"""The merit of a framework, |len(x) − L[labels]|² + w² oᵀ K o, with its gradient and Gauss–Newton Hessian.

Compiled and without the interpreter's lock, so that searches in threads run side by side.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from drkid.congruence.target import Surface, signed_offsets
from drkid.mesh import Floats, Ints


class Springs(NamedTuple):
    """What the merit is made of: `edges` (E, 2), `labels` (E,), K (V, V), the target and its weight.

    `basis` (p, q) is the derivative of the palette's lengths by each of their free unknowns.
    """

    edges: Ints
    labels: Ints
    stiffness: Floats
    surface: Surface
    weight: float
    basis: Floats


class Trial(NamedTuple):
    """The merit at vertices (V, 3) and lengths (q,), with residuals (E,), signed offsets (V,) and normals (V, 3)."""

    merit: float
    vertices: Floats
    lengths: Floats
    residual: Floats
    offset: Floats
    normals: Floats


class Slope(NamedTuple):
    """Half the merit's gradient (3V,), its Gauss–Newton Hessian (3V, 3V), and the edges' unit vectors (E, 3)."""

    gradient: Floats
    hessian: Floats
    direction: Floats


@njit(cache=True, _nrt=False)
def _fill_directions(vertices: Floats, edges: Ints, direction: Floats) -> bool:
    """Unit vectors of the edges; False where one has no length."""
    fine = True
    for e in range(len(edges)):
        square = 0.0
        for r in range(3):
            direction[e, r] = vertices[edges[e, 1], r] - vertices[edges[e, 0], r]
            square += direction[e, r] ** 2
        fine = fine and square > 0
        for r in range(3):
            direction[e, r] /= max(np.sqrt(square), 1e-300)
    return fine


@njit(cache=True, nogil=True)
def directions(vertices: Floats, edges: Ints) -> Floats:
    """(E, 3): unit vectors of the edges.

    Raises:
        numpy.linalg.LinAlgError: an edge has no length.
    """
    direction = np.empty((len(edges), 3))
    if not _fill_directions(vertices, edges, direction):
        raise np.linalg.LinAlgError("an edge has no length: the ends coincide or are not finite")
    return direction


@njit(cache=True, _nrt=False)
def add_transposed(direction: Floats, edges: Ints, force: Floats, factor: float, out: Floats) -> None:
    """Add factor · Jᵀ `force` (E,) to `out` (3V,)."""
    for e in range(len(edges)):
        for r in range(3):
            pull = factor * force[e] * direction[e, r]
            out[3 * edges[e, 1] + r] += pull
            out[3 * edges[e, 0] + r] -= pull


@njit(cache=True, _nrt=False)
def _add_length_hessian(direction: Floats, edges: Ints, out: Floats) -> None:
    """Add JᵀJ to `out` (3V, 3V)."""
    for e in range(len(edges)):
        i, j = 3 * edges[e, 0], 3 * edges[e, 1]
        for r in range(3):
            for s in range(3):
                product = direction[e, r] * direction[e, s]
                out[i + r, i + s] += product
                out[j + r, j + s] += product
                out[i + r, j + s] -= product
                out[j + r, i + s] -= product


@njit(cache=True, _nrt=False)
def _add_offset_hessian(normals: Floats, stiffness: Floats, factor: float, out: Floats) -> None:
    """Add factor · NᵀKN to `out` (3V, 3V); K is sparse."""
    for i in range(len(normals)):
        for j in range(len(normals)):
            if stiffness[i, j] != 0.0:
                scaled = factor * stiffness[i, j]
                for r in range(3):
                    for s in range(3):
                        out[3 * i + r, 3 * j + s] += scaled * normals[i, r] * normals[j, s]


@njit(cache=True, nogil=True)
def tried_at(vertices: Floats, lengths: Floats, springs: Springs, slots: Ints) -> Trial:
    """The merit at vertices (V, 3) and lengths (q,); `slots` (V,) as in `signed_offsets`."""
    edges, residual = springs.edges, np.empty(len(springs.edges))
    total = 0.0
    for e in range(len(edges)):
        square = 0.0
        for r in range(3):
            square += (vertices[edges[e, 1], r] - vertices[edges[e, 0], r]) ** 2
        residual[e] = np.sqrt(square) - lengths[springs.labels[e]]
        total += residual[e] ** 2
    offset, normals = signed_offsets(springs.surface, vertices, slots)
    total += springs.weight**2 * np.dot(offset, np.dot(springs.stiffness, offset))
    return Trial(total, vertices, lengths, residual, offset, normals)


@njit(cache=True, nogil=True)
def slope_at(at: Trial, springs: Springs) -> Slope:
    """Half the gradient and Hessian of the merit by the vertices.

    Raises:
        numpy.linalg.LinAlgError: an edge has no length.
    """
    size, square = 3 * len(at.vertices), springs.weight**2
    direction = directions(at.vertices, springs.edges)
    hessian, gradient = np.zeros((size, size)), np.empty(size)
    _add_length_hessian(direction, springs.edges, hessian)
    _add_offset_hessian(at.normals, springs.stiffness, square, hessian)
    pull = np.dot(springs.stiffness, at.offset)
    for i in range(size):
        gradient[i] = square * pull[i // 3] * at.normals[i // 3, i % 3]
    add_transposed(direction, springs.edges, at.residual, 1.0, gradient)
    return Slope(gradient, hessian, direction)
