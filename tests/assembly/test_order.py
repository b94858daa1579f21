import numpy as np
import pytest
import trimesh
from exact_shapes import geodesic, icosahedron, potato, sixths, tetrahedron
from hinged import graph_of
from hypothesis import given, settings
from hypothesis import strategies as st

from drkid.assembly.order import border_lengths, breadth_first, order, steps, stretches
from drkid.assembly.piece_graph import PieceGraph, piece_graph
from drkid.mesh import TriMesh


def torus() -> TriMesh:
    solid = trimesh.creation.torus(2.0, 0.7, 12, 8)
    return TriMesh(solid.vertices, solid.faces)


def pairs_of_faces(mesh: TriMesh) -> PieceGraph:
    """Four-sided pieces: the two halves of each quad of a torus, merged."""
    first, second = mesh.faces[::2].tolist(), mesh.faces[1::2].tolist()
    outlines = []
    for a, b in zip(first, second, strict=True):
        apex = next(v for v in b if v not in a)
        i = next(i for i in range(3) if {a[i], a[(i + 1) % 3]} <= set(b))
        outlines.append([a[i], apex, a[(i + 1) % 3], a[(i + 2) % 3]])
    sides = {tuple(sorted((o[i], o[(i + 1) % 4]))) for o in outlines for i in range(4)}
    return piece_graph(outlines, sorted(sides))


SPHERES = [tetrahedron(), icosahedron(), sixths(), potato(), geodesic(2)]
GRAPHS = [*map(graph_of, SPHERES), graph_of(torus()), pairs_of_faces(torus())]


def even(graph: PieceGraph) -> np.ndarray:
    return np.ones(len(graph.pieces))


@pytest.mark.parametrize("graph", GRAPHS)
@pytest.mark.parametrize("last", [0, 3])
def test_every_piece_comes_once_beside_one_that_stands_and_the_last_at_the_end(graph, last) -> None:
    found = order(graph, even(graph), last)
    assert sorted(found) == list(range(len(graph.outlines)))
    assert found[-1] == last
    done: set[int] = set()
    for step in steps(graph, found, range(100, 100 + len(found))):
        piece = step.face - 100
        assert set(step.joins) == {100 + n for n in graph.neighbours[piece] if n in done}
        assert bool(step.joins) == bool(done)
        done.add(piece)


@pytest.mark.parametrize("mesh", SPHERES)
@pytest.mark.parametrize("last", range(4))
def test_no_piece_of_a_sphere_but_the_last_is_enclosed_and_no_hole_is_closed_in(mesh, last) -> None:
    graph = graph_of(mesh)
    touched = stretches(graph, order(graph, even(graph), last))
    assert touched[0] == (0, 0)
    assert touched[-1] == (3, 1)
    assert all(0 < sides < 3 and parts == 1 for sides, parts in touched[1:-1])


def test_a_handle_has_to_be_bridged() -> None:
    graph = graph_of(torus())
    assert sum(parts > 1 for _, parts in stretches(graph, order(graph, even(graph), 0))) >= 2


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 30), last=st.integers(0, 79))
def test_the_border_is_shorter_than_breadth_first(seed, last) -> None:
    mesh = potato(seed, 0.05)
    graph, lengths = graph_of(mesh), mesh.edge_lengths
    found = order(graph, lengths, last)
    own, plain = (border_lengths(graph, lengths, o) for o in (found, breadth_first(graph, found[0])))
    assert own.mean() < plain.mean()


def test_the_border_stays_near_the_equator() -> None:
    mesh = geodesic(2)
    graph, lengths = graph_of(mesh), mesh.edge_lengths
    borders = border_lengths(graph, lengths, order(graph, lengths, 0))
    plain = border_lengths(graph, lengths, breadth_first(graph, 0))
    assert borders[-1] == pytest.approx(0, abs=1e-9)
    assert borders.max() < 1.7 * 2 * np.pi
    assert borders.mean() < 0.85 * plain.mean()


def test_border_lengths_are_those_of_the_joints_between_what_stands_and_what_does_not() -> None:
    mesh = potato(1)
    graph, rng = graph_of(mesh), np.random.default_rng(0)
    pieces = rng.permutation(len(mesh.faces)).tolist()
    found = border_lengths(graph, mesh.edge_lengths, pieces)
    for count in (1, 17, 60, 80):
        stands = np.isin(graph.pieces, pieces[:count])
        assert found[count - 1] == pytest.approx(mesh.edge_lengths[stands[:, 0] != stands[:, 1]].sum())


def test_order_does_not_hang_on_rounding() -> None:
    mesh = icosahedron()
    graph = graph_of(mesh)
    noisy = mesh.edge_lengths * (1 + 1e-13 * np.arange(30))
    assert order(graph, noisy, 4) == order(graph, mesh.edge_lengths, 4)
