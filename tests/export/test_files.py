"""What is written is read back by an independent reader (trimesh)."""

import csv
import io
import json

import numpy as np
import pytest
import trimesh

from drkid.export.bill_of_materials import bom_csv, bom_json, connector_row, piece_row, rod_row
from drkid.export.colour import COLOURS, class_colour
from drkid.export.layout import connector_file, part_file, part_label, picture_file, plate_file
from drkid.export.ply import ply_bytes
from drkid.export.stl import stl_bytes
from drkid.kit import class_id
from drkid.mesh import TriMesh, rounded
from drkid.solid import Solid
from drkid.spec import KitSpec


def read(content: bytes, kind: str) -> trimesh.Trimesh:
    return trimesh.load_mesh(io.BytesIO(content), file_type=kind, process=False)


def test_ply_keeps_every_bit_and_the_face_property(potato):
    classes = np.arange(len(potato.faces)) % 5
    mesh = read(ply_bytes(potato, piece_class=classes), "ply")
    assert (np.asarray(mesh.vertices) == potato.vertices).all()
    assert (np.asarray(mesh.faces) == potato.faces).all()
    raw = mesh.metadata["_ply_raw"]["face"]["data"]["piece_class"]
    assert np.asarray(raw).ravel().tolist() == classes.tolist()


def test_ply_without_properties(ring):
    assert (np.asarray(read(ply_bytes(ring), "ply").faces) == ring.faces).all()


def test_stl_triangles_normals_and_closedness(potato):
    mesh = rounded(potato)
    triangles = np.asarray(read(stl_bytes(mesh), "stl").triangles)
    assert triangles == pytest.approx(mesh.corners)
    corners, index = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    assert TriMesh(corners, index.reshape(-1, 3)).is_closed_manifold


def test_rounding_drops_triangles_that_lose_a_corner_and_stays_closed():
    box = Solid.box([1, 1, 1], [10, 10, 10]).mesh()
    near = box.vertices[box.edges[0, 0]] + 1e-9  # float32 cannot tell the two apart
    split = TriMesh(np.vstack([box.vertices, near]), split_edge(box))
    assert split.is_closed_manifold
    mesh = rounded(split)
    assert len(mesh.faces) == len(split.faces) - 2
    assert mesh.is_closed_manifold


def split_edge(mesh: TriMesh) -> np.ndarray:
    """Faces of the mesh with its first edge divided by a new last vertex."""
    a, b = mesh.edges[0]
    new = len(mesh.vertices)
    faces = []
    for face in mesh.faces.tolist():
        if a in face and b in face:
            faces += [[new if v == a else v for v in face], [new if v == b else v for v in face]]
        else:
            faces.append(face)
    return np.array(faces)


def test_parts_list_is_the_same_in_csv_and_json():
    rows = [
        piece_row("parts/A.stl", 0, 12, 1000.0, KitSpec()),
        connector_row("connector_half", "parts/connector_half.stl", 36, 50.0, KitSpec()),
        rod_row(2.0, 6.4, 18, KitSpec()),
    ]
    from_csv = list(csv.DictReader(io.StringIO(bom_csv(rows))))
    from_json = json.loads(bom_json(rows))
    columns = ["part", "file", "count", "spare", "volume_mm3", "mass_g", "colour", "diameter", "length"]
    further = ["total_mass_g", "total_length", "cost", "total_cost"]
    further += ["mould_cost", "moulded_cost", "break_even_count", "picture"]
    assert list(from_csv[0]) == columns + further
    for one, other in zip(from_csv, from_json, strict=True):
        assert one == {name: "" if value is None else str(value) for name, value in other.items()}
    assert from_json[0]["mass_g"] == pytest.approx(1.24)
    assert (from_csv[2]["file"], from_csv[2]["diameter"]) == ("", "2.0")


def test_names_of_files():
    assert [class_id(i) for i in (0, 25, 26, 51, 52, 701, 702)] == ["A", "Z", "AA", "AZ", "BA", "ZZ", "AAA"]
    assert part_file("B", "any") == "parts/B.stl"
    assert part_file("B", "left") == "parts/B_left.stl"
    assert part_file("A2", "any") == "parts/A2.stl"
    assert part_file("A1", "right") == "parts/A1_right.stl"
    assert connector_file("connector_half") == "parts/connector_half.stl"
    assert plate_file(3) == "plates/plate_03.3mf"
    assert picture_file("parts/A2_left.stl") == "pictures/A2_left.png"
    assert part_label("parts/A2_left.stl") == "A2 left"


def test_colours_differ_and_repeat():
    assert len(set(COLOURS)) == len(COLOURS) == 16
    assert class_colour(17) == class_colour(1)
