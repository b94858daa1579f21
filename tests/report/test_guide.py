"""The guide: every step once, sides that meet are the sides that are told, and pages that print."""

import io
import re

import numpy as np
import pytest
from pypdf import PdfReader

from drkid.report.building_picture import Builder
from drkid.report.guide import STEPS_A_PICTURE, Guide, ranks, tick_word


@pytest.fixture(scope="module")
def guide(scene) -> Guide:
    return Guide(scene)


def test_every_step_is_in_one_group_in_order(guide, scene):
    steps = [one.step for group in guide.groups for one in group]
    assert steps == list(range(1, len(scene.document.pieces) + 1))
    assert max(map(len, guide.groups)) <= STEPS_A_PICTURE


def test_each_step_joins_all_neighbours_that_stand(guide, scene):
    for one, step in zip(guide.instructions, scene.document.assembly, strict=True):
        faces = {scene.face_piece[face] for face in step.joins}
        assert {int(scene.piece_step[i]) for i in faces} == {join.other_step for join in one.joins}


def test_sides_that_meet_are_about_as_long_as_their_ticks_say(guide, scene):
    lengths = [
        dict(zip(map(tick_word, t), c.edge_lengths, strict=True))
        for t, c in zip(guide.ticks, scene.document.classes, strict=True)
    ]
    longest = max(c.edge_lengths[-1] for c in scene.document.classes)
    piece_of = {int(step): i for i, step in enumerate(scene.piece_step)}
    for one in guide.instructions:
        for join in one.joins:
            own = lengths[scene.piece_class[one.piece]][join.side]
            other = lengths[scene.piece_class[piece_of[join.other_step]]][join.other_side]
            assert abs(own - other) < 0.12 * longest  # two errors of 5 % of the mean edge


def test_parts_are_told_apart_by_bevel_and_hand(guide, scene):
    files = [part.file for one in scene.document.classes for part in one.parts]
    assert list(guide.part_names) == files
    assert len(set(guide.part_names.values())) == len(files)
    for file, name in guide.part_names.items():
        assert file == f"parts/{name.replace(' ', '_')}.stl"


def test_equal_sides_have_equal_ticks():
    assert ranks(np.array([3.0, 3.0 + 1e-9, 4.0])) == (1, 1, 2)
    assert ranks(np.array([3.0, 3.5, 4.0])) == (1, 2, 3)


def test_new_pieces_are_labelled_in_their_pictures(guide):
    builder = Builder(guide)
    group = guide.groups[1]
    words = set()
    for view in builder.views(group):
        drawing = builder.drawing(group, view, 150, 150)
        assert drawing.width <= 151
        assert drawing.height <= 151
        words |= {item.text for item in drawing.items if hasattr(item, "text")}
    assert {str(one.step) for one in group} <= words


def test_the_page_opens_without_a_request(watched, documents, scene):
    watched.page.goto((documents / "guide.html").as_uri())
    assert watched.errors == []
    assert watched.requests == [(documents / "guide.html").as_uri()]
    text = watched.page.inner_text("body")
    for one in scene.document.classes:
        assert re.search(rf"\b{one.id}\b", text)
    assert re.search(rf"\b{len(scene.document.pieces)}\b", text)
    assert watched.page.locator("svg").count() > len(scene.document.pieces) // STEPS_A_PICTURE


def test_the_pdf_has_the_steps_in_few_pages(documents, guide):
    reader = PdfReader(io.BytesIO((documents / "guide.pdf").read_bytes()))
    text = "".join(page.extract_text() for page in reader.pages)
    assert len(reader.pages) <= len(guide.groups) + 4
    for one in guide.instructions:
        assert f"{one.step} {one.part}:" in text


def test_the_same_kit_makes_the_same_bytes(odd_kit, documents):
    again = odd_kit.documents(odd_kit, lambda _what, _fraction: None)
    for name in ("guide.html", "guide.pdf", "report.html"):
        assert again[name] == (documents / name).read_bytes()
