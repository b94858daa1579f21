import numpy as np
import pytest
import trimesh
from exact_shapes import decomposed, tetrahedron

from drkid.assembly import assemble
from drkid.assembly.overlap import overlaps
from drkid.kit import Decomposition, PartSet
from drkid.mesh import TriMesh
from drkid.parts import make, make_parts
from drkid.parts.prismoid import bevelled, cut_corners
from drkid.parts.truncation import Truncated
from drkid.spec import KitSpec


def spiked(height: float = 2.2) -> TriMesh:
    """A geodesic sphere with one vertex of valence five drawn out into a needle."""
    ball = trimesh.creation.icosphere(subdivisions=1)
    vertices = np.array(ball.vertices)
    vertices[0] *= height
    return TriMesh(vertices, ball.faces)


def across_vertices(decomposition: Decomposition, parts: PartSet) -> list[float]:
    """The shares of overlaps of pieces that are no neighbours."""
    mesh = decomposition.mesh.scaled(parts.scale_mm_per_unit)
    joined = {tuple(sorted(pair)) for pair in mesh.edge_faces.tolist()}
    pieces = assemble(mesh, parts).pieces
    return [one.share for one in overlaps(pieces, parts.parts) if tuple(sorted(one.faces)) not in joined]


def test_pieces_of_a_sharp_vertex_stay_apart(monkeypatch) -> None:
    d = decomposed(spiked())
    spec = KitSpec(connector="none", thickness_mm=8.0, size_mm=90.0)
    cut = make_parts(d, spec)
    monkeypatch.setattr(make, "truncated", lambda shapes, *_: Truncated(shapes))
    assert across_vertices(d, make_parts(d, spec))
    assert cut.cut_corners > 0
    assert cut.deepest_cut_mm > 0
    assert not across_vertices(d, cut)
    assert any("corners of the pieces are cut off" in note for note in cut.notes)


def test_pieces_for_every_shape_keep_their_corners() -> None:
    d = decomposed(spiked())
    for choice in ({"bevel_degrees": (100.0, 120.0)}, {"thickening": "perpendicular"}):
        parts = make_parts(d, KitSpec(connector="none", **choice))
        assert (parts.cut_corners, parts.deepest_cut_mm) == (0, 0.0)


def test_where_all_pieces_are_neighbours_nothing_is_cut() -> None:
    assert make_parts(decomposed(tetrahedron()), KitSpec(connector="none")).cut_corners == 0


def test_a_cut_lies_as_far_behind_the_corner_as_it_says() -> None:
    outline = np.array([[0.0, 0.0], [10.0, 0.0], [2.0, 8.0]])
    depths = np.array([1.0, 0.5, 0.0])
    ends = cut_corners(outline, depths)
    for i in range(3):
        ways = np.stack([outline[i - 1], outline[(i + 1) % 3]]) - outline[i]
        bisector = (ways / np.linalg.norm(ways, axis=1, keepdims=True)).sum(axis=0)
        bisector /= np.linalg.norm(bisector)
        assert (ends[i] - outline[i]) @ bisector == pytest.approx([depths[i]] * 2)
        for end, way in zip(ends[i] - outline[i], ways, strict=True):
            assert end[0] * way[1] - end[1] * way[0] == pytest.approx(0.0)


def test_a_truncated_piece_loses_its_corners_and_nothing_at_the_hinge_axis() -> None:
    triangle = np.array([[-15.0, -9.0], [15.0, -9.0], [0.0, 18.0]])
    whole = bevelled(triangle, np.array([[1.5] * 3, [0.1] * 3, [1.0] * 3]), 6.0)
    cut = whole.truncated(np.array([[2.0, 2.0, 0.0], [0.0, 0.0, 1.0]]))
    lost = whole.solid - cut.solid
    assert (cut.solid - whole.solid).volume < 1e-6
    assert 0.01 < lost.volume / whole.solid.volume * 100 < 2
    for height in (-1e-3, 1e-3):
        area = abs(lost.body.slice(height).area())
        assert area < 1e-3
