import numpy as np
import pytest

from drkid.remesh.half_edge import are_joined, face_normal, half_edges, mesh_of, shape, valence_of


def test_arrays_agree_with_the_mesh(ring):
    edges = half_edges(ring)
    other_end = edges.origin[edges.twin]
    assert np.array_equal(np.column_stack([edges.origin, other_end]), ring.half_edges)
    assert [valence_of(edges.twin, h) for h in edges.start] == ring.valence.tolist()
    assert all(are_joined(*edges, a, b) for a, b in ring.edges[:50])
    joined = {tuple(e) for e in ring.edges.tolist()}
    assert sum(are_joined(*edges, 0, v) for v in range(1, len(ring.vertices))) == ring.valence[0]
    assert (0, len(ring.vertices) // 2) not in joined
    assert not are_joined(*edges, 0, len(ring.vertices) // 2)
    assert np.allclose(face_normal(edges.origin, ring.vertices, 7), ring.face_normals[2])
    assert np.array_equal(mesh_of(edges, ring.vertices).faces, ring.faces)


def test_the_shape_of_a_triangle_lies_between_a_line_and_the_equilateral():
    points = np.array([[0, 0, 0], [1, 0, 0], [0.5, np.sqrt(3) / 2, 0], [2, 0, 0]], float)
    assert shape(points, 0, 1, 2) == pytest.approx(1)
    assert shape(points, 0, 1, 3) == 0
    assert 0 < shape(points, 0, 2, 3) < 1
