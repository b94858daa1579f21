"""Loops that do not part a surface, and the shortest of them."""

from itertools import pairwise

import numpy as np
import pytest
from handled_shapes import MINOR, barred_torus, bored_torus, torus
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from drkid.mesh import TriMesh
from drkid.surface.shortest_loop import shortest_loops


def parts(mesh: TriMesh, loop) -> int:
    """How many pieces of faces there are when the edges of a loop are cut."""
    ends = {frozenset((int(a), int(b))) for a, b in zip(loop, np.roll(loop, -1), strict=True)}
    whole = [i for i, edge in enumerate(mesh.edges) if frozenset(map(int, edge)) not in ends]
    a, b = mesh.edge_faces[whole].T
    graph = coo_array((np.ones(len(a)), (a, b)), shape=(len(mesh.faces), len(mesh.faces)))
    return connected_components(graph, directed=False)[0]


def test_a_sphere_has_none(potato):
    assert list(shortest_loops(potato)) == []


@pytest.mark.parametrize("make", [torus, barred_torus, bored_torus])
def test_loops_are_simple_without_chords_and_do_not_part_the_surface(make):
    mesh = make()
    found = list(shortest_loops(mesh))
    assert len(found) == 1 + 2 * mesh.genus
    joined = {frozenset(map(int, edge)) for edge in mesh.edges}
    for around, loop in found:
        assert len(set(loop.tolist())) == len(loop) >= 3
        pairs = {frozenset((int(v), int(w))) for v in loop for w in loop if v != w} & joined
        assert len(pairs) == len(loop)  # the edges of the loop and no others join its vertices
        places = mesh.vertices[np.append(loop, loop[0])]
        assert around == pytest.approx(sum(float(np.linalg.norm(b - a)) for a, b in pairwise(places)))
        assert parts(mesh, loop) == 1
    lengths = [around for around, _ in found]
    assert lengths[0] <= 1.05 * min(lengths)
    assert lengths[1:] == sorted(lengths[1:])


def test_the_shortest_goes_around_the_tube_of_a_ring(ring):
    around, loop = next(shortest_loops(ring))
    # 12 sides of a regular polygon around the tube of radius 0.8
    assert around == pytest.approx(12 * 2 * 0.8 * np.sin(np.pi / 12), rel=1e-6)
    assert len(loop) == 12


def test_the_thin_bar_comes_before_the_wide_ring():
    around, loop = next(shortest_loops(barred_torus()))
    assert 2 * np.pi * 0.25 * 0.9 < around < 2 * np.pi * 0.25 * 1.3
    assert np.abs(barred_torus().vertices[loop].mean(axis=0)[1:] - (0.4, 0)).max() < 0.1
    around, _ = next(shortest_loops(torus()))
    assert 2 * np.pi * MINOR * 0.95 < around < 2 * np.pi * MINOR * 1.2


@settings(max_examples=5)
@given(st.integers(0, 999), st.floats(1e-3, 1e3))
def test_numbers_of_vertices_and_the_unit_do_not_matter(ring, seed, scale):
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(ring.vertices))
    vertices = np.empty_like(ring.vertices)
    vertices[order] = scale * ring.vertices
    mixed = TriMesh(vertices, order[ring.faces][rng.permutation(len(ring.faces))])
    assert next(shortest_loops(mixed))[0] == pytest.approx(scale * next(shortest_loops(ring))[0], rel=0.05)
