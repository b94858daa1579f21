import numpy as np
import pytest

from drkid.curved_patch import barycentric_grid, fitted, gradients, monomials
from drkid.mesh import TriMesh

RNG = np.random.default_rng(3)
CORNERS = np.array([[0.0, 0, 0], [4, 0, 0], [1, 3, 0]])


@pytest.mark.parametrize("levels", [1, 2, 3, 4])
def test_grid_covers_the_triangle_once_and_its_sides_run_round(levels) -> None:
    grid = barycentric_grid(levels)
    mesh = TriMesh(grid.points @ CORNERS, grid.faces)
    assert len(grid.faces) == 4**levels
    assert mesh.areas == pytest.approx(np.full(4**levels, 6 / 4**levels))
    assert (mesh.face_normals[:, 2] > 0.999).all()
    for i, side in enumerate(grid.sides):
        ends = grid.points[side[[0, -1]]]
        assert ends.argmax(axis=1).tolist() == [i, (i + 1) % 3]
        assert (grid.points[side, (i + 2) % 3] == 0).all()
    assert grid.points[grid.faces[grid.central]].mean(axis=0) == pytest.approx(np.full(3, 1 / 3))


def test_gradients_are_those_of_the_terms() -> None:
    exponents = RNG.integers(0, 4, (9, 3))
    at = RNG.uniform(0.1, 0.9, (5, 3))
    for j in range(3):
        step = np.eye(3)[j] * 1e-6
        numeric = (monomials(exponents, at + step) - monomials(exponents, at - step)) / 2e-6
        assert gradients(exponents, at)[..., j] == pytest.approx(numeric, abs=1e-6)


def test_fitted_patch_goes_through_the_corners_and_reproduces_a_polynomial() -> None:
    grid = barycentric_grid(3)
    plan = grid.points @ CORNERS
    surface = plan + np.outer(0.3 * plan[:, 0] ** 2 - 0.2 * plan[:, 0] * plan[:, 1], [0, 0, 1])
    patch = fitted(grid.points, surface, 4)
    assert patch.points(np.eye(3)) == pytest.approx(surface[[grid.points[:, i].argmax() for i in range(3)]])
    assert patch.points(grid.points) == pytest.approx(surface, abs=1e-9)
    slope = np.column_stack([-(0.6 * plan[:, 0] - 0.2 * plan[:, 1]), 0.2 * plan[:, 0], np.ones(len(plan))])
    assert patch.normals(grid.points) == pytest.approx(slope / np.linalg.norm(slope, axis=1, keepdims=True), abs=1e-7)
