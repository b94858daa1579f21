"""Splitting pinched vertices."""

import numpy as np
import trimesh

from drkid.mesh import TriMesh
from drkid.surface.pinched_vertex import split_pinched


def tetrahedron(shift=(0.0, 0.0, 0.0)) -> TriMesh:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]]) + shift
    return TriMesh(vertices, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]))


def joined(one: TriMesh, two: TriMesh, shared: int) -> TriMesh:
    """Both meshes with `two`'s vertex 0 made one with `one`'s vertex `shared`."""
    faces = np.where(two.faces == 0, shared, two.faces + len(one.vertices))
    return TriMesh(np.concatenate([one.vertices, two.vertices]), np.concatenate([one.faces, faces]))


def test_two_tetrahedra_that_touch_in_a_vertex_come_apart():
    pinched = joined(tetrahedron(), tetrahedron((1, 0, 0)), 1)
    assert pinched.pinched_vertices == 1
    split = split_pinched(pinched)
    assert split.is_closed_manifold
    assert split.component_count == 2
    np.testing.assert_array_equal(split.corners, pinched.corners)


def test_a_surface_pinched_to_itself_keeps_its_shape():
    sphere = trimesh.creation.icosphere(subdivisions=1)
    far = int(np.asarray(sphere.vertices)[:, 2].argmax()), int(np.asarray(sphere.vertices)[:, 2].argmin())
    faces = np.where(np.asarray(sphere.faces) == far[1], far[0], np.asarray(sphere.faces))
    pinched = TriMesh(np.asarray(sphere.vertices), faces)
    split = split_pinched(pinched)
    assert (pinched.pinched_vertices, split.pinched_vertices) == (1, 0)
    assert split.genus == 0
    np.testing.assert_array_equal(split.corners, pinched.corners)


def test_a_manifold_is_left_as_it_is():
    mesh = tetrahedron()
    assert split_pinched(mesh) is mesh


def test_faces_that_disagree_on_direction_still_hang_together():
    mesh = joined(tetrahedron(), tetrahedron((1, 0, 0)), 1)
    faces = np.array(mesh.faces)
    faces[::3] = faces[::3, ::-1]
    assert len(split_pinched(TriMesh(mesh.vertices, faces)).vertices) == 8
