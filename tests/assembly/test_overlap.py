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


def test_the_figures_of_an_assembly_count_pairs_at_rest_and_within_the_swing() -> None:
    parts = make_parts(decomposed(geodesic()), KitSpec(connector="none"))
    mesh = geodesic().scaled(parts.scale_mm_per_unit)
    free, wide = (assemble(mesh, parts, spec=KitSpec(swing_degrees=s)).figures.overlap for s in (5.5, 25.5))
    assert free is not None
    assert (free.pairs, free.swung, free.swing_degrees, free.faces) == (0, 0, 5.0, None)
    assert wide is not None
    assert (wide.pairs, wide.swing_degrees) == (0, 25.0)
    assert wide.swung >= len(mesh.edges)  # every hinge's own pair, and others


def test_the_figures_name_the_worst_pair() -> None:
    assembly, parts = built(potato(2), 6, thickening="perpendicular", connector="none")
    found, figures = overlaps(assembly.pieces, parts.parts), assembly.figures.overlap
    assert figures is not None
    assert (figures.pairs, figures.faces, figures.largest_mm3) == (len(found), found[0].faces, found[0].volume_mm3)
    assert any(f"{len(found)} pairs of pieces reach into one another" in note for note in assembly.notes)


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
