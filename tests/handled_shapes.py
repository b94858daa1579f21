"""Meshes with handles of known places and sizes, by marching cubes on distance fields."""

import numpy as np
from skimage.measure import marching_cubes

from drkid.mesh import Floats, TriMesh

MAJOR, MINOR = 2.0, 0.7


def level_set(field: Floats, low: float, high: float) -> TriMesh:
    """The surface where a field on a cubic grid, positive inside, is zero."""
    vertices, faces, _, _ = marching_cubes(field, 0.0, gradient_direction="ascent")
    mesh = TriMesh(low + vertices * (high - low) / (len(field) - 1), faces.astype(np.int64))
    return mesh if mesh.volume > 0 else mesh.flipped()


def _grid(size: int) -> tuple[Floats, Floats, Floats]:
    x, y, z = np.meshgrid(*[np.linspace(-3.2, 3.2, size)] * 3, indexing="ij")
    return x, y, z


def _torus(x: Floats, y: Floats, z: Floats) -> Floats:
    return MINOR - np.hypot(np.hypot(x, y) - MAJOR, z)


def torus(size: int = 40) -> TriMesh:
    """A wide ring, its tube around at least 2π MINOR."""
    return level_set(_torus(*_grid(size)), -3.2, 3.2)


def barred_torus(radius: float = 0.25, size: int = 40) -> TriMesh:
    """The ring with a thin bar along x across its hole, at y = 0.4: genus 2."""
    x, y, z = _grid(size)
    bar = np.minimum(radius - np.hypot(y - 0.4, z), MAJOR - np.abs(x))
    return level_set(np.logaddexp(20 * _torus(x, y, z), 20 * bar) / 20, -3.2, 3.2)


def bored_torus(radius: float = 0.3, size: int = 48) -> TriMesh:
    """The ring with a thin bore along z through its tube at x = MAJOR: genus 2."""
    x, y, z = _grid(size)
    return level_set(np.minimum(_torus(x, y, z), np.hypot(x - MAJOR, y) - radius), -3.2, 3.2)


def double_torus(size: int = 40) -> TriMesh:
    """Two rings side by side in one, of tubes with radius 0.45 and 0.6: genus 2."""
    x, y, z = _grid(size)
    one = 0.45 - np.hypot(np.hypot(x + 1.35, y) - 1.2, z)
    two = 0.6 - np.hypot(np.hypot(x - 1.2, y) - 1.2, z)
    return level_set(np.logaddexp(20 * one, 20 * two) / 20, -3.2, 3.2)
