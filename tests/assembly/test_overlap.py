import numpy as np
import pytest
from exact_shapes import decomposed, geodesic, icosahedron, potato
from hypothesis import given
from hypothesis import strategies as st

from drkid.assembly import assemble
from drkid.assembly.overlap import meeting_boxes, overlaps
from drkid.kit import Assembly, PartSet
from drkid.mesh import TriMesh
from drkid.parts import make_parts
from drkid.spec import KitSpec


def built(mesh: TriMesh, classes: int | None = None, **spec: object) -> tuple[Assembly, PartSet]:
    d = decomposed(mesh, classes)
    parts = make_parts(d, KitSpec(**spec))
    return assemble(mesh.scaled(parts.scale_mm_per_unit), parts), parts


@given(st.integers(0, 10**6), st.integers(0, 30))
def test_boxes_that_meet_are_found_and_no_others(seed, count) -> None:
    rng = np.random.default_rng(seed)
    low = rng.integers(0, 6, (count, 3)).astype(float)
    boxes = np.stack([low, low + rng.integers(0, 3, (count, 3))], axis=1)
    wanted = [
        [i, j]
        for i in range(count)
        for j in range(i + 1, count)
        if (boxes[i, 0] <= boxes[j, 1]).all() and (boxes[j, 0] <= boxes[i, 1]).all()
    ]
    assert meeting_boxes(boxes).tolist() == wanted


@pytest.mark.parametrize("connector", ["hinge", "none"])
def test_bisected_pieces_do_not_overlap(connector) -> None:
    assembly, parts = built(geodesic(), connector=connector)
    assert overlaps(assembly.pieces, parts.parts) == ()


def test_overlaps_are_the_kernel_s_for_every_pair() -> None:
    assembly, parts = built(potato(2), 6, thickening="perpendicular", connector="none")
    solids = [parts.parts[piece.part].solid.moved(piece.transform) for piece in assembly.pieces]
    found = {one.faces: one for one in overlaps(assembly.pieces, parts.parts)}
    pairs = [(a, b) for a in range(len(solids)) for b in range(a + 1, len(solids))]
    for a, b in pairs:
        volume = (solids[a] & solids[b]).volume
        assert (found[a, b].volume_mm3 if (a, b) in found else 0.0) == pytest.approx(volume, abs=1e-5)
    shares = [one.share for one in overlaps(assembly.pieces, parts.parts)]
    assert shares == sorted(shares, reverse=True)
    assert len(found) >= 100


def test_a_share_is_of_the_smaller_piece() -> None:
    assembly, parts = built(icosahedron(), thickening="perpendicular", connector="none")
    found = overlaps(assembly.pieces, parts.parts)
    assert len(found) >= 30
    for one in found:
        assert one.share == pytest.approx(one.volume_mm3 / parts.parts[0].solid.volume)
