"""The merit of a framework and its slope in plain NumPy, to check the compiled evaluation against."""

from dataclasses import dataclass

import igl
import numpy as np

from drkid.congruence.framework import Framework
from drkid.congruence.rigidity import rigidity_matrix
from drkid.congruence.target import Target
from drkid.mesh import Floats


@dataclass(frozen=True, eq=False)
class PlainLinearisation:
    """The merit, half its gradient (3V,) and Gauss–Newton Hessian (3V, 3V), offsets (V,) and N (V, 3V)."""

    merit: float
    gradient: Floats
    hessian: Floats
    offset: Floats
    across: Floats


def plain_offsets(target: Target, points: Floats) -> tuple[Floats, Floats]:
    """Signed offsets (n,) and normals (n, 3): closest points from igl, weights after Ericson (2005, 3.4)."""
    squared, face, closest = igl.point_mesh_squared_distance(points, target.mesh.vertices, target.mesh.faces)
    corners = target.mesh.faces[face]
    a, b, c = np.moveaxis(target.mesh.vertices[corners], 1, 0)
    u, v, w = b - a, c - a, closest - a
    uu, uv, vv, wu, wv = (np.einsum("ij,ij->i", p, q) for p, q in ((u, u), (u, v), (v, v), (w, u), (w, v)))
    second, third = np.stack([vv * wu - uv * wv, uu * wv - uv * wu]) / (uu * vv - uv * uv)
    weights = np.stack([1 - second - third, second, third], axis=1)
    normals = np.einsum("ij,ijk->ik", weights, target.surface.normals[corners])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return np.copysign(np.sqrt(squared), np.einsum("ij,ij->i", points - closest, normals)), normals


def plain_merit(frame: Framework, offset: Floats, weight: float) -> float:
    """|len(x) − L[labels]|² + w² oᵀ K o."""
    return float(frame.residual @ frame.residual + weight**2 * offset @ frame.stiffness @ offset)


def across(normals: Floats) -> Floats:
    """N (V, 3V)."""
    matrix = np.zeros((len(normals), len(normals), 3))
    matrix[np.arange(len(normals)), np.arange(len(normals))] = normals
    return matrix.reshape(len(normals), -1)


def plain_linearised(frame: Framework, target: Target, weight: float) -> PlainLinearisation:
    """Everything at once, by dense products."""
    jacobian = rigidity_matrix(frame.mesh.vertices, frame.mesh.edges)
    offset, normals = plain_offsets(target, frame.mesh.vertices)
    along = across(normals)
    pull = weight**2 * along.T @ frame.stiffness
    return PlainLinearisation(
        plain_merit(frame, offset, weight),
        jacobian.T @ frame.residual + pull @ offset,
        jacobian.T @ jacobian + pull @ along,
        offset,
        along,
    )
