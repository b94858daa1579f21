"""Surfaces to remesh: fine, coarse, and thinner than an edge."""

import numpy as np
import pytest
import trimesh

from drkid.mesh import TriMesh
from drkid.remesh.midpoint_subdivision import subdivided


@pytest.fixture(scope="session")
def blob() -> TriMesh:
    """A smooth surface of 5 120 faces, genus 0, without symmetry."""
    sphere = trimesh.creation.icosphere(subdivisions=4)
    x, y, z = np.asarray(sphere.vertices).T
    radius = 1 + 0.2 * np.sin(2 * x + 1) + 0.1 * np.cos(2 * y * z) + 0.1 * x * z
    return TriMesh(np.stack([1.5 * x, y, 0.8 * z], axis=1) * radius[:, None], np.asarray(sphere.faces))


@pytest.fixture(scope="session")
def thin_ring() -> TriMesh:
    """A torus whose tube is thinner than an edge of a coarse mesh."""
    torus = trimesh.creation.torus(2.0, 0.12, major_sections=150, minor_sections=10)
    return TriMesh(np.asarray(torus.vertices), np.asarray(torus.faces))


@pytest.fixture(scope="session")
def cup() -> TriMesh:
    """A blob with a thin handle: genus 1, cells of two sizes needed."""
    angle, around = np.meshgrid(np.arange(96) * 2 * np.pi / 96, np.arange(48) * 2 * np.pi / 48, indexing="ij")
    thick = 0.15 + 0.75 * np.exp(-(((angle - np.pi) / 0.9) ** 2))
    ring = 1.5 + thick * np.cos(around)
    points = np.stack([ring * np.cos(angle), ring * np.sin(angle), thick * np.sin(around)], axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(96), np.arange(48), indexing="ij")

    def at(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return ((a % 96) * 48 + b % 48).ravel()

    faces = [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
    mesh = TriMesh(points, np.concatenate([np.column_stack(f) for f in faces]))
    return mesh if mesh.volume > 0 else mesh.flipped()


@pytest.fixture(scope="session")
def box() -> TriMesh:
    """A plate of 12 faces: coarse, with sharp edges."""
    plate = trimesh.creation.box((3.0, 2.0, 0.7))
    return TriMesh(np.asarray(plate.vertices), np.asarray(plate.faces))


@pytest.fixture(scope="session")
def fine_box(box: TriMesh) -> TriMesh:
    """The same plate with 1 000 vertices or more."""
    return subdivided(box, 1000)
