import numpy as np
import pytest
import trimesh

from drkid.mesh import TriMesh
from drkid.patches.distance_geometry import made_congruent, place
from drkid.patches.identity import relabellings
from drkid.patches.matching import paired
from drkid.patches.outline import outlined


def dented_ball(seed: int) -> TriMesh:
    """An icosahedron whose corners are a little off."""
    ball = trimesh.creation.icosahedron()
    rng = np.random.default_rng(seed)
    return TriMesh(np.asarray(ball.vertices) + rng.normal(scale=0.01, size=(12, 3)), np.asarray(ball.faces))


def pairs_of(mesh: TriMesh) -> list:
    """All named alike: the triangles of each are those of the first."""
    pieces = [outlined(mesh, pair) for pair in paired(mesh, 0.01)]
    return [piece.turned(relabellings(pieces[0], piece)[0]) for piece in pieces]


def distances(vertices: np.ndarray, pieces: list) -> np.ndarray:
    corners = np.stack([vertices[list(piece.vertices)] for piece in pieces])
    return np.linalg.norm(corners[:, :, None] - corners[:, None], axis=-1)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_two_pairs_of_a_shape_get_all_distances_in_common_and_little_moves(seed) -> None:
    mesh = dented_ball(seed)
    pieces = pairs_of(mesh)
    shape = np.array([0, 0, *range(1, len(pieces) - 1)])
    before = distances(mesh.vertices, pieces[:2])
    vertices = made_congruent(mesh.vertices, pieces, shape, place(mesh))
    after = distances(vertices, pieces[:2])
    assert np.ptp(before, axis=0).max() > 1e-2
    assert np.ptp(after, axis=0).max() < 1e-3
    assert np.abs(vertices - mesh.vertices).max() < 0.1


def test_pieces_that_are_shapes_of_their_own_stay_where_they_are() -> None:
    mesh = dented_ball(3)
    pieces = pairs_of(mesh)
    vertices = made_congruent(mesh.vertices, pieces, np.arange(len(pieces)), place(mesh))
    assert vertices == pytest.approx(mesh.vertices, abs=1e-12)


def test_moving_along_the_surface_counts_less_than_off_it() -> None:
    ball = trimesh.creation.icosahedron()
    mesh = TriMesh(np.asarray(ball.vertices), np.asarray(ball.faces))
    metric = place(mesh).metric
    outwards = np.einsum("vi,vij,vj->v", mesh.vertices, metric, mesh.vertices)
    along = np.cross(mesh.vertices, np.roll(mesh.vertices, 1, axis=1))
    sideways = np.einsum("vi,vij,vj->v", along, metric, along) / (along**2).sum(axis=1)
    assert (outwards > 40 * sideways).all()
