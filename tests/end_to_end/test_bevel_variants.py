"""A kit whose classes are split by their bevels, from the pieces to the documents."""

import csv
import json
import re
from collections import Counter

import numpy as np
import pytest

import drkid
from drkid.verification import verify_kit


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    spec = drkid.KitSpec(faces=60, rounds=2, tolerance_percent=2, bevel_variants=2)
    return drkid.make_kit(None, spec).write(tmp_path_factory.mktemp("variants") / "kit")


@pytest.fixture(scope="module")
def document(folder):
    return json.loads((folder / "kit.json").read_text())


def test_the_kit_bears_out_what_it_states(folder) -> None:
    assert [check for check in verify_kit(folder).checks if not check.passed] == []


def test_every_variant_is_a_class_with_one_part(document) -> None:
    classes = document["classes"]
    assert [one["id"] for one in classes] == ["A1", "A2", "B1", "B2"]
    assert all(one["mirror_symmetric"] and len(one["parts"]) == 1 for one in classes)
    assert all(one["parts"][0]["handedness"] == "any" for one in classes)
    assert classes[0]["edge_lengths"] == classes[1]["edge_lengths"] != classes[2]["edge_lengths"]
    assert document["metrics"]["classes"] == document["metrics"]["unique_piece_parts"] == 4
    assert document["spec"]["classes"] == 2
    counts = Counter(piece["class"] for piece in document["pieces"])
    assert {one["id"]: one["count"] for one in classes} == counts
    for one in classes:
        assert one["parts"][0]["file"] == f"parts/{one['id']}.stl"
        assert {p["part"] for p in document["pieces"] if p["class"] == one["id"]} == {one["parts"][0]["file"]}


def test_the_assembled_surface_names_the_variant_of_each_face(folder, document) -> None:
    ids = [one["id"] for one in document["classes"]]
    raw = (folder / "assembled.ply").read_bytes()
    faces = np.frombuffer(raw[-60 * 17 :], np.dtype([("count", "u1"), ("corners", "<i4", 3), ("class", "<i4")]))
    assert (faces["count"] == 3).all()
    assert [ids[k] for k in faces["class"]] == [piece["class"] for piece in document["pieces"]]


def test_documents_name_the_variants(folder, document) -> None:
    classes = {one["id"]: one["count"] for one in document["classes"]}
    rows = [
        row for row in csv.DictReader((folder / "bom.csv").read_text().splitlines()) if row["part"].startswith("piece")
    ]
    assert {row["part"].removeprefix("piece "): int(row["count"]) for row in rows} == classes
    assert len({row["colour"] for row in rows}) == len(classes)
    net = (folder / "net.svg").read_text()
    assert Counter(re.findall(r'data-class="(\w+)"', net)) == classes
    for page in ("guide.html", "report.html"):
        text = (folder / page).read_text()
        assert all(name in text for name in classes)
    plates = {path.name for path in (folder / "plates").iterdir()}
    assert len(plates) >= len(classes)
