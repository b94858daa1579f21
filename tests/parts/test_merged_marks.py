"""Marks of merged pieces: in the inner faces of their triangles, a wall away from all else."""

from dataclasses import replace

import numpy as np
import pytest
from exact_shapes import decomposed, potato

from drkid.kit import MergedClass, Part, PartSet
from drkid.mesh import Floats
from drkid.parts import make_parts
from drkid.parts.engraving import engraving
from drkid.parts.merged_marks import _marks, merged_marked
from drkid.patches import make_patches
from drkid.solid import Solid
from drkid.spec import KitSpec

WIDTH, DEPTH = 0.5, 0.4


@pytest.fixture(scope="module", params=[2, 6])
def plain(request) -> tuple[PartSet, list[tuple[Part, MergedClass]]]:
    d, spec = decomposed(potato(3), 4), KitSpec(merge=request.param, process="sla")
    patches = make_patches(d, d.mesh, spec)
    assert patches is not None
    kit = make_parts(d, spec, patches=patches)
    inner = [shape.inner * kit.scale_mm_per_unit for shape in patches.merged]
    zipped = zip(kit.parts, patches.merged, inner, strict=True)
    return kit, [(part, replace(shape, corners=part.corners, inner=i)) for part, shape, i in zipped][:5]


def test_marks_keep_the_wall_to_pockets_bevels_and_ridges_at_the_smallest_size(plain) -> None:
    kit, pieces = plain
    d = kit.dimensions
    low, nearest = -d.thickness_mm / 2, np.inf
    for part, shape in pieces:
        triangles, _ = _marks(part, shape, d, WIDTH, DEPTH)
        for triangle in (t for t in triangles if t.lines):
            body = part.solid.moved(np.linalg.inv(triangle.frame))
            cut = engraving(np.concatenate(triangle.lines), WIDTH, low, low + DEPTH)
            assert (cut - body).volume < 1e-6
            outside = Solid.box((-90, -90, low + 1e-3), (90, 90, d.thickness_mm)) - body
            nearest = min(nearest, outside.gap(cut, 5.0))
    assert d.min_wall_mm <= nearest < d.min_wall_mm + 0.2


def test_one_triangle_has_the_letters_and_every_side_its_number_nearest_to_it(plain) -> None:
    kit, pieces = plain
    for part, shape in pieces:
        triangles, missing = _marks(part, shape, kit.dimensions, WIDTH, DEPTH)
        assert missing.count == 0
        assert sum(len(t.lines) for t in triangles) == len(part.corners) + 1
        assert sorted(side for t in triangles for side in t.sides) == list(range(len(part.corners)))
        for triangle in triangles:
            numbers = triangle.lines[len(triangle.lines) - len(triangle.sides) :]
            for side, lines in zip(sorted(triangle.sides), numbers, strict=True):
                away = {other: _away(ends, lines) for other, ends in triangle.sides.items()}
                assert min(away, key=lambda other: away[other]) == side


def _away(ends: Floats, lines: Floats) -> float:
    """Distance of the middle of strokes from a line."""
    middle = (lines.min(axis=(0, 1)) + lines.max(axis=(0, 1))) / 2
    along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    return abs(float((middle - ends[0]) @ [-along[1], along[0]]))


def test_marks_take_away_what_their_strokes_are_deep_and_no_more(plain) -> None:
    kit, pieces = plain
    for part, shape in pieces[:3]:
        marked, missing = merged_marked(part, shape, kit.dimensions, WIDTH, DEPTH)
        assert not missing
        taken = part.solid - marked.solid
        triangles, _ = _marks(part, shape, kit.dimensions, WIDTH, DEPTH)
        area = sum(engraving(np.concatenate(t.lines), WIDTH, 0, 1).volume for t in triangles if t.lines)
        assert taken.volume == pytest.approx(area * DEPTH, rel=1e-3)
        assert (marked.solid - part.solid).volume < 1e-6
        assert marked.solid.mesh().is_closed_manifold


def test_a_piece_without_room_bears_no_marks_and_tells_which(plain) -> None:
    kit, pieces = plain
    part, shape = pieces[0]
    marked, missing = merged_marked(part, shape, kit.dimensions, 10 * WIDTH, DEPTH)
    assert missing == ("letter", *(f"number of side {i}" for i in range(1, len(part.corners) + 1)))
    assert marked.solid.volume == pytest.approx(part.solid.volume)


def test_strokes_of_two_letters_keep_apart_from_those_of_numbers(plain) -> None:
    kit, pieces = plain
    part, shape = pieces[0]
    triangles, _ = _marks(replace(part, class_name="BF"), shape, kit.dimensions, WIDTH, DEPTH)
    for triangle in triangles:
        solids = [engraving(lines, WIDTH, 0, 1) for lines in triangle.lines]
        assert all(a.gap(b, 9.0) > WIDTH for i, a in enumerate(solids) for b in solids[:i])
