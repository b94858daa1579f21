import pytest
from exact_shapes import icosahedron
from hinged import graph_of

from drkid.assembly.piece_graph import piece_graph


def test_joints_lie_between_sides_with_the_same_ends_in_opposite_order() -> None:
    mesh = icosahedron()
    graph = graph_of(mesh)
    for (v, w), pieces, sides in zip(mesh.edges.tolist(), graph.pieces, graph.sides, strict=True):
        ends = [(graph.outlines[p][i], graph.outlines[p][(i + 1) % 3]) for p, i in zip(pieces, sides, strict=True)]
        assert ends == [(v, w), (w, v)]
    assert graph.pieces.tolist() == mesh.edge_faces.tolist()


def test_two_pieces_may_share_several_joints() -> None:
    graph = piece_graph([[0, 1, 2, 3], [1, 0, 3, 2]], [(0, 1), (1, 2), (2, 3), (0, 3)])
    assert graph.neighbours == ((1, 1, 1, 1), (0, 0, 0, 0))


def test_an_edge_of_one_piece_is_no_joint() -> None:
    with pytest.raises(ValueError, match="edge 1 2"):
        piece_graph([[0, 1, 2]], [(1, 2)])
