import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from drkid.congruence.pressure_iteration import ENERGY, MAXIMUM, MEAN, iterate, squared_distance_to_triangle
from drkid.congruence.triangle_space import ascending_lengths, clustering_error
from drkid.measure import distance_to_surface
from drkid.mesh import TriMesh

coordinate = st.floats(-3, 3)
point = st.tuples(coordinate, coordinate, coordinate)


def iterate_on(mesh: TriMesh, means, *, limit=10.0, tolerance=0.0, iterations=1, reference=None):
    reference = mesh if reference is None else reference
    nearby = np.tile(np.arange(len(reference.faces)), (len(mesh.vertices), 1))
    return iterate(
        mesh.vertices, mesh.edges, mesh.face_edges, np.asarray(means, float), reference.corners, nearby,
        limit, tolerance, iterations,
    )  # fmt: skip


@given(point)
def test_distance_to_a_triangle_is_that_of_the_nearest_of_many_points_on_it(p):
    triangle = np.array([[0.0, 0, 0], [2, 0.3, 0], [0.4, 1.5, 0.7]])
    u, v = np.meshgrid(np.linspace(0, 1, 121), np.linspace(0, 1, 121))
    inside = u + v <= 1
    points = triangle[0] + u[inside, None] * (triangle[1] - triangle[0]) + v[inside, None] * (triangle[2] - triangle[0])
    found = np.sqrt(squared_distance_to_triangle(np.array(p), triangle))
    brute = np.linalg.norm(points - np.array(p), axis=1).min()
    assert found <= brute + 1e-12
    assert found >= brute - 0.02


def test_one_iteration_is_the_papers_equation(potato):
    """p* is the mean over the edges of the point that half the wanted change of that edge asks for."""
    wanted = 0.35
    last = iterate_on(potato, [[wanted] * 3])[3]
    means = ascending_lengths(potato).mean(axis=0)  # after the clustering step the mean is the class's own
    order = np.argsort(potato.side_lengths, axis=1)
    target = np.zeros(len(potato.edges))
    for f, edges in enumerate(potato.face_edges):
        target[edges[order[f]]] += means / 2
    for v in range(0, len(potato.vertices), 11):
        points = []
        for e, (a, b) in enumerate(potato.edges.tolist()):
            if v in (a, b):
                other = potato.vertices[b if v == a else a]
                away = potato.vertices[v] - other
                length = np.linalg.norm(away)
                points.append(potato.vertices[v] + (target[e] - length) / 2 * away / length)
        assert last[v] == pytest.approx(np.mean(points, axis=0), abs=1e-12)


def test_history_is_the_clustering_error_of_each_iterations_mesh(potato):
    vertices, means, labels, _, history = iterate_on(potato, [[0.2, 0.25, 0.3], [0.3, 0.4, 0.5]], iterations=25)
    assert history.shape == (25, 3)
    best = clustering_error(ascending_lengths(potato.moved(vertices)), labels, means)
    row = history[np.argmin(history[:, MAXIMUM])]
    assert (best.energy, best.maximum, best.mean) == pytest.approx((row[ENERGY], row[MAXIMUM], row[MEAN]))
    assert history[-1, ENERGY] < history[0, ENERGY]


def test_no_vertex_leaves_the_limit(potato):
    limit = 0.05 * potato.mean_edge
    last = iterate_on(potato, [[0.2, 0.25, 0.3]], limit=limit, iterations=300)[3]
    moved = np.linalg.norm(last - potato.vertices, axis=1)
    assert moved.max() > limit  # along the surface they may go
    assert distance_to_surface(potato, last).max() <= limit * (1 + 1e-9)


def test_it_stops_at_the_tolerance(potato):
    history = iterate_on(potato, [[0.2, 0.25, 0.3]], iterations=400)[4]
    tolerance = float(history[40, MAXIMUM])
    stopped = iterate_on(potato, [[0.2, 0.25, 0.3]], tolerance=tolerance, iterations=400)[4]
    assert len(stopped) <= 41
    assert stopped[-1, MAXIMUM] <= tolerance
    assert (stopped[:-1, MAXIMUM] > tolerance).all()


@settings(max_examples=20)
@given(st.floats(0.01, 100), point)
def test_a_rigid_motion_and_a_scale_carry_over(potato, factor, turn):
    """With one class and no limit in the way there are no decisions that rounding could turn."""
    shaken = potato.moved(potato.vertices + 0.02 * np.random.default_rng(0).normal(size=potato.vertices.shape))
    means = np.array([[0.2, 0.25, 0.3]])
    rotation = Rotation.from_rotvec(turn).as_matrix()
    plain = iterate_on(shaken, means, iterations=20)[3]
    moved = shaken.moved(factor * shaken.vertices @ rotation.T + [3, -5, 7])
    carried = iterate_on(moved, factor * means, limit=10 * factor, iterations=20)[3]
    assert np.abs(carried - (factor * plain @ rotation.T + [3, -5, 7])).max() < 1e-9 * max(factor, 1)
