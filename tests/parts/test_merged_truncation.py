"""Tips of merged pieces: cut where they meet, by no more than that."""

import numpy as np
import pytest
from exact_shapes import decomposed, icosahedron
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from drkid.kit import MergedPiece
from drkid.mesh import TriMesh
from drkid.parts import make_parts
from drkid.parts.merged_truncation import tips_cut
from drkid.patches import make_patches
from drkid.rigid_fit import rigid_fit
from drkid.solid import Solid
from drkid.spec import KitSpec


def dented(seed: int) -> TriMesh:
    """An icosahedron whose corners lie nearer or farther at random."""
    ball = icosahedron()
    return ball.moved(ball.vertices * (1 + 0.1 * np.random.default_rng(seed).standard_normal((12, 1))))


@settings(max_examples=3, phases=[Phase.generate])
@given(st.integers(0, 30), st.sampled_from([2, 5]))
def test_no_two_merged_pieces_share_anything_and_walls_stay(seed, merge) -> None:
    d, spec = decomposed(dented(seed)), KitSpec(merge=merge, size_mm=160)
    patches = make_patches(d, d.mesh, spec)
    assert patches is not None
    parts = make_parts(d, spec, patches=patches)
    mesh = patches.decomposition.mesh.scaled(parts.scale_mm_per_unit)
    placed = [
        parts.parts[p.class_index].solid.moved(
            rigid_fit(parts.parts[p.class_index].corners, mesh.vertices[list(p.vertices)])
        )
        for p in parts.merged
    ]
    boxes = np.stack([solid.bounds for solid in placed])
    for a in range(len(placed)):
        for b in range(a + 1, len(placed)):
            if (boxes[a, 0] <= boxes[b, 1]).all() and (boxes[b, 0] <= boxes[a, 1]).all():
                assert (placed[a] & placed[b]).volume < 1e-5
    assert not [note for note in parts.notes if "have walls of" in note]


@pytest.mark.parametrize(("together", "lost"), [(True, 5.0), (False, 0.0)])
def test_only_tips_of_pieces_with_a_vertex_in_common_are_cut(together, lost) -> None:
    """Two plates whose corners reach half a millimetre into one another."""
    plates = [Solid.box((0, 0, -1), (10, 10, 1)), Solid.box((-9.5, -9.5, -1), (0.5, 0.5, 1))]
    corners = [np.array([[0.0, 0, 0], [10, 0, 0], [0, 10, 0]]), np.array([[0.0, 0, 0], [-10, 0, 0], [0, -10, 0]])]
    mesh = TriMesh(np.vstack(corners), np.array([[0, 1, 2], [3, 4, 5]]))
    pieces = (MergedPiece((0,), 0, (0, 1, 2)), MergedPiece((1,), 1, (0 if together else 3, 4, 5)))
    cut = tips_cut(plates, corners, pieces, mesh, [False, False], 0.2)
    assert [plate.volume - one.volume < lost + 1e-9 for plate, one in zip(plates, cut, strict=True)] == [True, True]
    assert cut[0].gap(cut[1], 1.0) == pytest.approx(0.6 if together else 0.0, abs=1e-6)
