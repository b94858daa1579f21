"""The quadratic rigidity model written out densely, to check the quick one against; and small meshes to try it on."""

from dataclasses import dataclass

import numpy as np
import trimesh

from drkid.congruence.quadratic_model import Move, QuadraticModel
from drkid.congruence.target import smoothness
from drkid.mesh import Floats, Ints, TriMesh


def pebble(seed: int = 0, roughness: float = 0.03, subdivisions: int = 1) -> TriMesh:
    """A generic closed mesh of 80 faces (or 4 times as many), genus 0, mean edge 1, valences 5 and 6."""
    sphere = trimesh.creation.icosphere(subdivisions=subdivisions)
    rng = np.random.default_rng(seed)
    stretch = 1 + roughness * rng.normal(size=(len(sphere.vertices), 1))
    mesh = TriMesh(sphere.vertices * stretch * [1.3, 1.0, 0.9], sphere.faces)
    return mesh.scaled(1 / mesh.mean_edge)


def small_ring() -> TriMesh:
    """A torus of 192 faces, mean edge 1, every valence 6."""
    torus = trimesh.creation.torus(2.0, 1.0, major_sections=12, minor_sections=8)
    mesh = TriMesh(torus.vertices, torus.faces)
    return mesh.scaled(1 / mesh.mean_edge)


def rows(position: Floats, edges: Ints) -> tuple[Floats, Floats]:
    """Rigidity matrix (E, 3V) and lengths (E,), edge by edge."""
    matrix, length = np.zeros((len(edges), position.size)), np.zeros(len(edges))
    for row, (a, b) in enumerate(edges):
        along = position[b] - position[a]
        length[row] = np.sqrt(along @ along)
        matrix[row, 3 * b : 3 * b + 3] = along / length[row]
        matrix[row, 3 * a : 3 * a + 3] = -along / length[row]
    return matrix, length


@dataclass(frozen=True)
class DenseProblem:
    """|J y − b|² + w² (o + N y)ᵀ K (o + N y) + μ² |y|² at fixed positions, for any edges and wanted lengths."""

    position: Floats
    offset: Floats
    across: Floats  # N, (V, 3V)
    stiffness: Floats
    weight: float
    damping: float

    def energy(self, edges: Ints, wanted: Floats, y: Floats) -> float:
        jacobian, length = rows(self.position, edges)
        misfit = jacobian @ y - (wanted - length)
        offset = self.offset + self.across @ y
        shape = self.weight**2 * offset @ self.stiffness @ offset
        return float(misfit @ misfit + shape + self.damping**2 * y @ y)

    def hessian(self, edges: Ints) -> Floats:
        jacobian, _ = rows(self.position, edges)
        shape = self.weight**2 * self.across.T @ self.stiffness @ self.across
        return jacobian.T @ jacobian + shape + self.damping**2 * np.eye(self.position.size)

    def minimiser(self, edges: Ints, wanted: Floats) -> Floats:
        jacobian, length = rows(self.position, edges)
        pull = jacobian.T @ (wanted - length) - self.weight**2 * self.across.T @ self.stiffness @ self.offset
        return np.linalg.solve(self.hessian(edges), pull)

    def minimum(self, edges: Ints, wanted: Floats) -> float:
        return self.energy(edges, wanted, self.minimiser(edges, wanted))

    def model(self, edges: Ints, wanted: Floats) -> QuadraticModel:
        """The quick model, made from scratch."""
        jacobian, length = rows(self.position, edges)
        inverse = np.linalg.inv(self.hessian(edges))
        shift = self.minimiser(edges, wanted)
        along = self.position[edges[:, 1]] - self.position[edges[:, 0]]
        return QuadraticModel(
            inverse,
            jacobian @ inverse @ jacobian.T,
            shift,
            wanted - length - jacobian @ shift,
            along / length[:, None],
            length,
            self.position.copy(),
        )


def dense_problem(mesh: TriMesh, seed: int = 0, weight: float = 0.4, damping: float = 0.05) -> DenseProblem:
    """A problem at a mesh with random offsets along its own normals."""
    count = len(mesh.vertices)
    across = np.zeros((count, count, 3))
    across[np.arange(count), np.arange(count)] = mesh.vertex_normals
    offset = 0.1 * np.random.default_rng(seed).normal(size=count)
    return DenseProblem(mesh.vertices.copy(), offset, across.reshape(count, -1), smoothness(mesh, 1.0), weight, damping)


def room(model: QuadraticModel) -> Move:
    """An empty proposal for the model."""
    edges, coordinates = len(model.length), len(model.shift)
    return Move(
        np.empty(8, np.int64),
        np.empty(8, np.int64),
        np.empty(2, np.int64),
        np.empty(3),
        np.empty(edges),
        np.empty(coordinates),
    )


def assert_models_agree(model: QuadraticModel, fresh: QuadraticModel, tolerance: float = 1e-9) -> None:
    """Every array of the two models is the same, of its own largest entry."""
    for name, kept, made in zip(QuadraticModel._fields, model, fresh, strict=True):
        np.testing.assert_allclose(kept, made, atol=tolerance * np.abs(made).max(), rtol=0, err_msg=name)
