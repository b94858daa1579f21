"""The rigidity matrix of a mesh's edges, and what its singular values say.

A closed mesh of genus 0 has E = 3V − 6 edges, as many as its vertices have freedoms up to rigid motion, and is
generically rigid (Cauchy; Gluck 1975): prescribing every edge length is then a square system, which Newton's method
solves near a mesh whose lengths are close already.
"""

import numpy as np

from drkid.mesh import Floats, Ints, read_only


def edge_vectors(vertices: Floats, edges: Ints) -> tuple[Floats, Floats]:
    """(E, 3) unit vectors from each edge's first to its second vertex, and the lengths (E,).

    Raises:
        numpy.linalg.LinAlgError: an edge has no length, and so no direction.
    """
    along = vertices[edges[:, 1]] - vertices[edges[:, 0]]
    length = np.linalg.norm(along, axis=1)
    if not (length > 0).all():
        message = "an edge has no length: the ends coincide or are not finite"
        raise np.linalg.LinAlgError(message)
    return along / length[:, None], length


def rigidity_matrix(vertices: Floats, edges: Ints) -> Floats:
    """J (E, 3V): derivative of the edge lengths (E,) by the coordinates, vertex by vertex, x y z.

    The row of edge (i, j) has −d at vertex i and d at vertex j, d being the unit vector from i to j.
    """
    direction, _ = edge_vectors(vertices, edges)
    matrix = np.zeros((len(edges), len(vertices), 3))
    row = np.arange(len(edges))
    matrix[row, edges[:, 0]] = -direction
    matrix[row, edges[:, 1]] = direction
    return matrix.reshape(len(edges), -1)


def infinitesimal_motions(vertices: Floats, edges: Ints, tolerance: float = 1e-9) -> int:
    """Number of independent motions that stretch no edge, the six rigid ones not counted."""
    values = np.linalg.svd(rigidity_matrix(vertices, edges), compute_uv=False)
    rank = int((values > tolerance * values[0]).sum())
    return 3 * len(vertices) - 6 - rank


def self_stresses(vertices: Floats, edges: Ints, tolerance: float = 1e-9) -> Floats:
    """(n, E): an orthonormal basis of the self-stresses, the edge tensions that balance at every vertex."""
    left, values, _ = np.linalg.svd(rigidity_matrix(vertices, edges))
    rank = int((values > tolerance * values[0]).sum())
    return read_only(np.ascontiguousarray(left[:, rank:].T))
