"""Nets are read back from the SVG and from the PDF's own drawing operators."""

import io
import re
from collections import Counter
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pypdf
import pytest

from drkid.kit import Kit, class_id
from drkid.report.net import PAPERS, joints_of, net_files, net_of, net_svg, printable_scale
from drkid.report.unfolding import overlapping
from drkid.solid import triangulated

SVG = "{http://www.w3.org/2000/svg}"
MM = 25.4 / 72


@pytest.fixture(scope="module")
def written(kit) -> dict[str, bytes]:
    return net_files(kit)


def svg_faces(content: bytes) -> list[tuple[int, str, np.ndarray]]:
    """Piece, class and outline; the pages' groups are moved along x."""
    found = []
    for group in ElementTree.fromstring(content).iter(f"{SVG}g"):
        shift = float(re.match(r"translate\(([\d.]+) 0\)", group.get("transform"))[1])
        for polygon in group.iter(f"{SVG}polygon"):
            if polygon.get("class") == "face":
                points = [[float(x) for x in pair.split(",")] for pair in polygon.get("points").split()]
                outline = (np.array(points) * [1, -1] + [shift, 0]).round(9)
                found.append((int(polygon.get("data-piece")), polygon.get("data-class"), outline))
    return found


def pdf_faces(content: bytes) -> list[list[np.ndarray]]:
    """Every filled, unstroked path by page, in mm of the paper."""
    return [page_faces(page) for page in pypdf.PdfReader(io.BytesIO(content)).pages]


def page_faces(page: pypdf.PageObject) -> list[np.ndarray]:
    matrix, path, faces = np.eye(3), [], []
    for operands, operator in pypdf.generic.ContentStream(page.get_contents(), page.pdf).operations:
        numbers = [float(x) for x in operands] if operator in (b"cm", b"m", b"l") else []
        assert operator not in (b"q", b"Q")
        if operator == b"cm":
            step = np.eye(3)
            step[:, :2] = np.reshape(numbers, (3, 2))
            matrix = step @ matrix
        elif operator in (b"m", b"l"):
            path.append((np.array([*numbers, 1.0]) @ matrix)[:2] * MM)
        elif operator in (b"f", b"f*", b"S", b"n"):
            faces += [np.array(path)] if operator.startswith(b"f") else []
            path = []
    return faces


def class_sides(kit: Kit) -> list[np.ndarray]:
    """Ascending side lengths of every piece's class."""
    return [
        np.sort(kit.decomposition.class_lengths[kit.part_set.parts[piece.part].class_index])
        for piece in kit.assembly.pieces
    ]


def sides(outline: np.ndarray) -> np.ndarray:
    return np.sort(np.linalg.norm(np.roll(outline, -1, axis=0) - outline, axis=1))


def apart(outlines: list[np.ndarray]) -> bool:
    bodies = [outline[triangulated(outline)] for outline in outlines]
    return not any(overlapping(bodies[i], np.concatenate(bodies[:i]), 0.02).any() for i in range(1, len(bodies)))


def test_svg_draws_every_piece_once_to_its_classs_size_and_apart(kit, written):
    faces = svg_faces(written["net.svg"])
    assert sorted(piece for piece, _, _ in faces) == list(range(len(kit.assembly.pieces)))
    lengths = class_sides(kit)
    for piece, name, outline in faces:
        assert name == class_id(kit.part_set.parts[kit.assembly.pieces[piece].part].class_index)
        assert sides(outline) == pytest.approx(lengths[piece], abs=0.01)
    assert apart([outline for _, _, outline in faces])


def test_pdf_draws_the_same_in_true_size_within_the_pages(kit, written):
    pages = pdf_faces(written["net.pdf"])
    width, height = PAPERS["a4"]
    everything = [outline for page in pages for outline in page]
    assert len(everything) == len(kit.assembly.pieces)
    found = Counter(tuple(np.round(sides(outline), 1)) for outline in everything)
    assert found == Counter(tuple(np.round(length, 1)) for length in class_sides(kit))
    drawn = np.sort([sides(outline) for outline in everything], axis=0)
    assert drawn == pytest.approx(np.sort(class_sides(kit), axis=0), abs=0.01)
    for page in pages:
        assert apart(page)
        points = np.vstack(page)
        assert (points > 10).all()
        assert (points < [width - 10, height - 10]).all()


def test_outlines_are_drawn_as_seen_from_outside(kit, written):
    for piece, _, outline in svg_faces(written["net.svg"]):
        corners = kit.part_set.parts[kit.assembly.pieces[piece].part].corners[:, :2]
        a, b = outline - outline.mean(axis=0), corners - corners.mean(axis=0)
        u, _, v = np.linalg.svd(a.T @ b)
        assert np.linalg.det(u @ v) > 0
        assert a == pytest.approx(b @ (u @ v).T, abs=1e-4)


def test_cut_numbers_come_in_pairs_and_folds_join_a_strip(kit):
    net = net_of(kit)
    numbers = Counter(label.text for page in net.pages for label in page.labels if " " not in label.text)
    kinds = Counter(line.kind for page in net.pages for line in page.lines)
    folds = sum(count for kind, count in kinds.items() if kind != "cut")
    assert set(numbers.values()) == {2}
    assert len(numbers) + folds == len(kit.assembly.joints) == len(joints_of(kit))
    assert folds == len(kit.assembly.pieces) - net.strips  # a tree in every strip
    assert {"mountain", "valley"} <= set(kinds)
    assert kinds["cut"] == 2 * len(numbers)
    # In a slit between two faces there is no room for a tab: those edges are taped.
    assert len(numbers) * 0.6 < sum(len(page.tabs) for page in net.pages) <= len(numbers)


def test_tabs_overlap_no_face(kit):
    for page in net_of(kit).pages:
        faces = np.concatenate([face.outline[triangulated(face.outline)] for face in page.faces])
        for tab in page.tabs:
            assert not overlapping(tab[[[0, 1, 2], [0, 2, 3]]], faces, 0.06).any()


@pytest.mark.parametrize("paper", ["a4", "letter"])
def test_the_whole_net_fits_on_one_page(kit, paper):
    spec = kit.spec.model_copy(update={"net_on_one_page": True, "paper": paper})
    net = net_of(replace(kit, spec=spec))
    assert (len(net.pages), net.size_mm) == (1, PAPERS[paper])
    assert 0.1 < net.scale < 1
    faces = svg_faces(net_svg(net))
    ratios = [sides(outline) / class_sides(kit)[piece] for piece, _, outline in faces]
    assert np.array(ratios) == pytest.approx(net.scale, rel=1e-3)


def test_every_page_has_a_ruler_that_is_as_long_as_it_says(written):
    for page in ElementTree.fromstring(written["net.svg"]).iter(f"{SVG}g"):
        lines = [line for line in page.iter(f"{SVG}line") if float(line.get("y1")) < 16 and float(line.get("y2")) < 16]
        assert max(abs(float(line.get("x2")) - float(line.get("x1"))) for line in lines) == 100
        assert len(lines) == 12
        assert "100 mm" in "".join(text.text for text in page.iter(f"{SVG}text"))


def test_a_piece_larger_than_the_page_shrinks_the_net():
    outline = np.array([[0.0, 0.0], [30.0, 0.0], [0.0, 40.0]])
    room = np.array([200.0, 300.0])
    assert printable_scale([outline], 1.0, room) == 1.0
    assert printable_scale([outline], 20.0, room) * 50 == pytest.approx(200)


def test_the_same_kit_makes_the_same_bytes(kit, written):
    assert net_files(kit) == written
