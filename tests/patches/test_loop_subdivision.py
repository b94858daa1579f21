from itertools import pairwise

import numpy as np
import pytest
import trimesh

from drkid.curved_patch import barycentric_grid
from drkid.mesh import Floats, TriMesh
from drkid.patches.loop_subdivision import loop_patches, subdivided


def limit_points(mesh: TriMesh) -> Floats:
    """(V, 3): where endless subdivision takes each vertex: (3v + 8β Σ neighbours)/(3 + 8nβ)."""
    n = np.maximum(mesh.valence, 1)
    beta = (5 / 8 - (3 / 8 + np.cos(2 * np.pi / n) / 4) ** 2) / n
    ring = np.zeros_like(mesh.vertices)
    a, b = mesh.edges.T
    np.add.at(ring, a, mesh.vertices[b])
    np.add.at(ring, b, mesh.vertices[a])
    weight = (8 * beta)[:, None]
    return (3 * mesh.vertices + weight * ring) / (3 + n[:, None] * weight)


def test_agrees_with_another_implementation(potato) -> None:
    vertices, faces = trimesh.remesh.subdivide_loop(potato.vertices, potato.faces, 1)
    ours = subdivided(potato)
    theirs = TriMesh(vertices, faces)
    assert len(ours.faces) == len(theirs.faces) == 4 * len(potato.faces)
    assert np.sort(ours.vertices, axis=0) == pytest.approx(np.sort(theirs.vertices, axis=0))
    assert ours.is_closed_manifold
    assert ours.volume == pytest.approx(theirs.volume)


def test_vertices_go_to_their_limit_and_the_limit_stays(potato) -> None:
    limit = limit_points(potato)
    mesh, distance = potato, [np.abs(potato.vertices - limit).max()]
    for _ in range(3):
        mesh = subdivided(mesh)
        distance.append(np.abs(mesh.vertices[: len(limit)] - limit).max())
        assert limit_points(mesh)[: len(limit)] == pytest.approx(limit)
    assert all(b < 0.5 * a for a, b in pairwise(distance))


def test_a_plane_stays_a_plane_inside() -> None:
    sphere = trimesh.creation.box((2, 2, 2)).subdivide().subdivide().subdivide()
    sphere.merge_vertices()
    mesh = TriMesh(np.asarray(sphere.vertices), np.asarray(sphere.faces))
    smooth = subdivided(mesh)
    inside = (np.abs(mesh.vertices[:, :2]) < 0.6).all(axis=1) & (mesh.vertices[:, 2] > 0.99)
    assert inside.any()
    assert smooth.vertices[: len(mesh.vertices)][inside] == pytest.approx(mesh.vertices[inside])


def test_a_sphere_stays_round() -> None:
    sphere = trimesh.creation.icosphere(subdivisions=2)
    patches = loop_patches(TriMesh(np.asarray(sphere.vertices), np.asarray(sphere.faces)), 2)
    radius = np.linalg.norm(patches, axis=2)
    assert radius.std() < 0.002 * radius.mean()


@pytest.mark.parametrize("levels", [1, 3])
def test_neighbouring_patches_share_their_boundary(potato, levels) -> None:
    patches, grid = loop_patches(potato, levels), barycentric_grid(levels)
    for edge, (one, other) in list(zip(potato.edges, potato.edge_faces, strict=True))[::17]:
        i = potato.faces[one].tolist().index(edge[0])
        j = potato.faces[other].tolist().index(edge[1])
        assert (patches[one, grid.sides[i]] == patches[other, grid.sides[j]][::-1]).all()


def test_patches_lie_over_their_faces(potato) -> None:
    grid = barycentric_grid(2)
    flat = np.einsum("nk,fkc->fnc", grid.points, potato.corners)
    apart = np.linalg.norm(loop_patches(potato, 2) - flat, axis=2)
    assert apart.max() < 0.35 * potato.mean_edge
