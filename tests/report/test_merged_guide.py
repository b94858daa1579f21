"""The guide of a merged kit: sides are told by numbers, and those that meet are the sides that are told."""

import numpy as np
import pytest

from drkid.pipeline import make_kit
from drkid.report.building_picture import Builder
from drkid.report.guide import Guide
from drkid.report.guide_pages import front_lines, guide_pages, part_lines
from drkid.report.guide_pdf import guide_pdf
from drkid.report.scene import Scene, scene_of
from drkid.report.tables import classes_table
from drkid.spec import KitSpec

QUICK = {"faces": 40, "method": "pressure", "classes": 2, "tolerance_percent": 40, "max_iterations": 100}


@pytest.fixture(scope="module")
def scene(potato_file) -> Scene:
    return scene_of(make_kit(potato_file, KitSpec(**QUICK, merge=6, process="sla", documents=False)))


@pytest.fixture(scope="module")
def guide(scene) -> Guide:
    return Guide(scene)


def test_sides_are_numbered_in_the_order_of_corners_and_tell_the_edge_where_pieces_meet(guide, scene) -> None:
    piece_of = {int(step): i for i, step in enumerate(scene.piece_step)}

    def ends(piece: int, word: str) -> set[int]:
        corners, side = scene.document.pieces[piece].corners, int(word.removeprefix("side ")) - 1
        return {corners[side], corners[(side + 1) % len(corners)]}

    told = [(one.piece, join) for one in guide.instructions for join in one.joins]
    assert len(told) == len(scene.document.joints)
    for piece, join in told:
        assert ends(piece, join.side) == ends(piece_of[join.other_step], join.other_side)


def test_the_table_has_the_sides_in_order_with_their_lengths(guide, scene) -> None:
    lines = part_lines(guide)
    assert [line.name for line in lines] == [one.id for one in scene.document.classes]
    report = classes_table(scene.document)
    for line, one in zip(lines, scene.document.classes, strict=True):
        corners = np.array(one.parts[0].corners)
        lengths = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
        assert [word for word, _ in line.sides] == [f"{i}:" for i in range(1, len(corners) + 1)]
        assert [length for _, length in line.sides] == pytest.approx(lengths.tolist())
        assert ", ".join(f"{i}: {length:.2f}" for i, length in enumerate(lengths, 1)) in report


def test_pictures_have_the_numbers_of_new_pieces_sides_within_their_sheet(guide) -> None:
    builder, group = Builder(guide), guide.groups[0]
    drawing = builder.drawing(group, builder.views(group)[0], 150, 150)
    words = [item for item in drawing.items if hasattr(item, "text")]
    assert {"1", "2", "3"} <= {word.text for word in words}
    assert all(0 < word.x < drawing.width and 0 < word.y < drawing.height for word in words)
    for file, sides in guide.part_sides.items():
        shown = {item.text for item in builder.part_drawing(file, 28.0).items if hasattr(item, "text")}
        assert shown == {guide.part_names[file], *map(str, sides)}


def test_the_front_tells_whether_pieces_bear_marks(guide, scene) -> None:
    assert any("bear no marks" in line for line in front_lines(guide))
    spec = scene.document.spec | {"mark_depth_mm": 0.4}
    marked = Guide(Scene(scene.document.model_copy(update={"spec": spec}), scene.parts, scene.surface, scene.assembled))
    assert not any("bear no marks" in line for line in front_lines(marked))
    assert any("engraved" in line for line in front_lines(marked))


def test_the_pdf_is_written(guide) -> None:
    assert guide_pdf(guide, *guide_pages(guide)).startswith(b"%PDF")
