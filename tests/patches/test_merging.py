from collections import Counter

import numpy as np
import pytest
import trimesh

from drkid.kit import Decomposition, Outcome
from drkid.mesh import TriMesh
from drkid.patches.matching import paired
from drkid.patches.merging import merged_patches
from drkid.patches.outline import SHARPEST_FOLD, outlined
from drkid.patches.vertex_star import starred
from drkid.spec import KitSpec

TETRAHEDRON = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])


def icosahedron() -> TriMesh:
    ico = trimesh.creation.icosahedron()
    return TriMesh(np.asarray(ico.vertices), np.asarray(ico.faces))


def one_class(mesh: TriMesh) -> Decomposition:
    lengths = np.sort(mesh.side_lengths, axis=1)
    errors = np.linalg.norm(lengths - lengths.mean(axis=0), axis=1)
    zeros = np.zeros(len(mesh.faces), np.int64)
    return Decomposition(mesh, zeros, lengths.mean(axis=0)[None], errors, 0, (), Outcome("converged", ""))


def test_a_matching_covers_every_face_once_by_neighbours(pebble) -> None:
    pairs = paired(pebble, 0.01)
    assert Counter(map(len, pairs)) == {2: len(pebble.faces) // 2}
    assert sorted(f for pair in pairs for f in pair) == list(range(len(pebble.faces)))
    beside = {frozenset(p) for p in pebble.edge_faces.tolist()}
    assert all(frozenset(pair) in beside for pair in pairs)


@pytest.mark.parametrize("size", [5, 6, 7])
def test_stars_are_disjoint_whole_or_convex_parts(pebble, size) -> None:
    groups = starred(pebble, size, 0.01)
    assert sorted(f for group in groups for f in group) == list(range(len(pebble.faces)))
    whole = {len(group) for group in groups if len(outlined(pebble, group).inner) == 1}
    assert whole <= set(range(3, size + 1))
    assert size in whole or not (pebble.valence == size).any()
    for group in groups:
        piece = outlined(pebble, group)
        common = set.intersection(*(set(pebble.faces[f].tolist()) for f in group))
        assert common, "all triangles of a star meet at its middle"
        assert len(piece.inner) == (1 if len(group) == pebble.valence[min(common)] and len(group) > 2 else 0)
        assert piece.makes_a_piece(pebble)


@pytest.mark.parametrize("merge", [2, 4, 6])
def test_no_piece_is_folded_by_more_than_a_right_angle(merge) -> None:
    """Of a double pyramid so flat that its rim is sharper; a tetrahedron, all of whose edges are, stays as it is."""
    around = np.linspace(0, 2 * np.pi, 7)[:-1]
    rim = np.column_stack([np.cos(around), np.sin(around), np.zeros(6)])
    mesh = TriMesh(
        np.vstack([rim, [[0, 0, 0.3], [0, 0, -0.3]]]),
        np.array([f for i in range(6) for f in ((i, (i + 1) % 6, 6), ((i + 1) % 6, i, 7))]),
    )
    groups = paired(mesh, 0.01) if merge == 2 else starred(mesh, merge, 0.01)
    folds = [outlined(mesh, group).sharpest_fold(mesh) for group in groups]
    assert max(map(len, groups)) > 1
    assert max(folds) <= SHARPEST_FOLD
    tetrahedron = TriMesh(np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]), TETRAHEDRON)
    alone = paired(tetrahedron, 0.01) if merge == 2 else starred(tetrahedron, merge, 0.01)
    assert sorted(alone) == [(0,), (1,), (2,), (3,)]


@pytest.mark.parametrize("size", [5, 6, 7])
@pytest.mark.parametrize("seed", range(3))
def test_three_pieces_at_least_meet_in_every_corner(seed, size) -> None:
    """Two that met on both sides of a corner would have two hinges, and could turn about neither."""
    ball = icosahedron()
    mesh = ball.moved(ball.vertices * (1 + 0.1 * np.random.default_rng(seed).standard_normal((12, 1))))
    groups = starred(mesh, size, 0.01)
    meeting = Counter(v for group in groups for v in outlined(mesh, group).vertices)
    assert min(meeting.values()) >= 3
    assert len(groups) <= 8


def test_an_icosahedron_merges_into_one_shape() -> None:
    for merge, pieces in ((2, 10), (5, 8)):
        found = merged_patches(one_class(icosahedron()), KitSpec(merge=merge, merge_shift_percent=5), 1e-6)
        assert found.misfit == pytest.approx(np.zeros(len(found.pieces)), abs=1e-9)
        if merge == 2:
            assert len(found.pieces) == pieces
            assert len(found.merged) == 1
            assert found.merged[0].achiral
        else:
            assert Counter(len(p.faces) for p in found.pieces)[5] >= 2
            assert len(found.merged) < len(found.pieces)


@pytest.mark.parametrize("tolerance", [0.0, 1e-6])
def test_without_a_tolerance_every_face_is_paired_too(tolerance) -> None:
    pairs = paired(icosahedron(), tolerance)
    assert Counter(map(len, pairs)) == {2: 10}


def test_a_looser_tolerance_needs_fewer_shapes(pebble) -> None:
    as_it_is = KitSpec(merge=2, merge_shift_percent=0)
    counts = [len(merged_patches(one_class(pebble), as_it_is, t).merged) for t in (1e-6, 0.3)]
    assert counts[0] > counts[1]


def test_corners_lie_within_the_tolerance_of_their_shape(pebble) -> None:
    tolerance = 0.1
    found = merged_patches(one_class(pebble), KitSpec(merge=6, merge_shift_percent=5), tolerance)
    assert found.misfit is not None
    assert found.misfit.max() <= tolerance + 1e-9
    lengths = found.decomposition.class_lengths
    for piece in found.pieces:
        shape = found.merged[piece.class_index]
        assert len(piece.vertices) == len(shape.corners) == int((~np.isnan(lengths[piece.class_index])).sum())


def test_gently_bent_pieces_are_made_flat(pebble) -> None:
    as_it_is = KitSpec(merge=2, merge_shift_percent=0)
    bent = merged_patches(one_class(pebble), as_it_is, 0.01)
    flat = merged_patches(one_class(pebble), as_it_is.model_copy(update={"merge_flat_degrees": 45.0}), 0.01)
    assert max(np.abs(c.corners[:, 2]).max() for c in bent.merged) > 1e-3
    assert max(np.abs(c.corners[:, 2]).max() for c in flat.merged) < 1e-12
    assert flat.misfit is not None
    assert flat.misfit.max() > 0.01
