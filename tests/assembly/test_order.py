import numpy as np
import pytest
import trimesh
from exact_shapes import geodesic, icosahedron, potato, sixths, tetrahedron
from hypothesis import given
from hypothesis import strategies as st

from drkid.assembly.order import steps
from drkid.kit import Step
from drkid.measure import bend_radians
from drkid.mesh import TriMesh


def torus() -> TriMesh:
    solid = trimesh.creation.torus(2.0, 0.7, 12, 8)
    return TriMesh(solid.vertices, solid.faces)


def ordered(mesh: TriMesh) -> tuple[Step, ...]:
    return steps(mesh, bend_radians(mesh))


def borders(mesh: TriMesh, order: list[int]) -> list[int]:
    """Number of open edges after each step."""
    step = np.argsort(order)
    pairs = np.sort(step[mesh.edge_faces], axis=1)
    return [int(((pairs[:, 0] <= i) & (pairs[:, 1] > i)).sum()) for i in range(len(order))]


@pytest.mark.parametrize("mesh", [tetrahedron(), icosahedron(), sixths(), potato(), torus(), geodesic(2)])
def test_every_face_comes_once_beside_one_that_stands(mesh) -> None:
    found = ordered(mesh)
    assert sorted(s.face for s in found) == list(range(len(mesh.faces)))
    neighbours = {frozenset(pair) for pair in mesh.edge_faces.tolist()}
    done: list[int] = []
    for step in found:
        assert set(step.joins) == {f for f in done if frozenset((f, step.face)) in neighbours}
        assert bool(step.joins) == bool(done)
        done.append(step.face)
    assert len(found[-1].joins) == 3


@given(st.integers(0, 100))
def test_the_last_face_is_the_most_convex(seed) -> None:
    mesh = potato(seed, 0.05)
    least = bend_radians(mesh)[mesh.face_edges].min(axis=1)
    assert least[ordered(mesh)[-1].face] == pytest.approx(least.max())


def test_the_border_stays_short() -> None:
    mesh = geodesic(2)
    found = borders(mesh, [s.face for s in ordered(mesh)])
    at_random = []
    rng, neighbours = np.random.default_rng(0), mesh.edge_faces
    order = [0]
    while len(order) < len(mesh.faces):
        beside = np.isin(neighbours, order)
        front = np.flatnonzero(beside[:, 0] != beside[:, 1])
        edge = rng.choice(front)
        order.append(int(neighbours[edge][~beside[edge]][0]))
    at_random = borders(mesh, order)
    equator = 2 * np.pi / mesh.mean_edge
    assert max(found) < 1.7 * equator
    assert max(found) < 0.8 * max(at_random)


def test_order_does_not_hang_on_rounding() -> None:
    mesh = icosahedron()
    noisy = mesh.moved(mesh.vertices * (1 + 1e-13 * np.arange(12))[:, None])
    assert ordered(noisy) == ordered(mesh)
