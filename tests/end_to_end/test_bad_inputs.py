"""Every file that cannot be used ends in one clear message and exit status 2, with nothing written."""

import gzip
from pathlib import Path

import numpy as np
import pytest
import trimesh

from drkid.cli import run


def volume(path: Path, values: np.ndarray) -> Path:
    np.save(path, values)
    return path


def ball(size: int = 12) -> np.ndarray:
    grid = np.indices((size,) * 3) - (size - 1) / 2
    return ((grid**2).sum(axis=0) < (size / 3) ** 2).astype(np.uint8)


def empty_file(folder):
    path = folder / "empty.tif"
    path.touch()
    return path, "empty"


def wrong_extension(folder):
    path = folder / "notes.docx"
    path.write_text("a thesis")
    return path, ".docx"


def truncated_gzip(folder):
    path = folder / "cut.nii.gz"
    content = gzip.compress(np.random.default_rng(0).bytes(20_000))
    path.write_bytes(content[: len(content) // 2])
    return path, "cut.nii.gz"


def not_a_number(folder):
    values = ball().astype(float)
    values[3, 4, 5] = np.nan
    return volume(folder / "nan.npy", values), "1"


def all_zero(folder):
    return volume(folder / "zero.npy", np.zeros((8, 8, 8), np.uint8)), "zero"


def one_voxel(folder):
    values = np.zeros((8, 8, 8), np.uint8)
    values[4, 4, 4] = 1
    return volume(folder / "speck.npy", values), "voxel"


def open_mesh(folder):
    mesh = trimesh.creation.icosphere(subdivisions=2)
    trimesh.Trimesh(mesh.vertices, mesh.faces[:-3], process=False).export(folder / "open.stl")
    return folder / "open.stl", "open"


def non_manifold_mesh(folder):
    mesh = trimesh.creation.box()
    fin = np.vstack([mesh.vertices, [[0, 0, 3]]])
    faces = np.vstack([mesh.faces, [[0, 1, 8]], [[1, 0, 8]]])
    trimesh.Trimesh(fin, faces, process=False).export(folder / "fin.ply")
    return folder / "fin.ply", "manifold"


def missing(folder):
    return folder / "nowhere.nii.gz", "does not exist"


def a_folder(folder):
    (folder / "folder.tif").mkdir()
    return folder / "folder.tif", "folder"


CASES = [
    empty_file, wrong_extension, truncated_gzip, not_a_number, all_zero, one_voxel, open_mesh, non_manifold_mesh,
    missing, a_folder,
]  # fmt: skip


@pytest.mark.parametrize("command", ["make", "inspect"])
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.__name__)
def test_it_is_refused(command, case, tmp_path, capsys):
    (tmp_path / "in").mkdir()
    path, word = case(tmp_path / "in")
    out = ["--out", str(tmp_path / "out")] if command == "make" else []
    assert run([command, str(path), *out]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert "error:" in captured.err
    assert word in captured.err
    assert "Traceback" not in captured.err
    assert [p.name for p in tmp_path.iterdir()] == ["in"]


def test_an_unknown_label_is_refused_and_the_known_ones_are_named(tmp_path, capsys):
    values = np.zeros((30, 14, 14), np.uint8)
    values[1:13, 1:13, 1:13], values[16:28, 1:13, 1:13] = ball() * 3, ball() * 7
    path = volume(tmp_path / "labels.npy", values)
    assert run(["make", str(path), "--label", "5", "--out", str(tmp_path / "out")]) == 2
    text = capsys.readouterr().err
    for word in ("5", "3", "7"):
        assert word in text


@pytest.mark.parametrize(
    "name", ["truncated.nii.gz", "corrupt_header.map", "empty_mesh.ply", "open_boundary_peanut.obj"]
)
def test_bad_files_met_in_the_wild_are_refused(name, shared_data, tmp_path, capsys):
    assert run(["make", str(shared_data / "bad" / name), "--out", str(tmp_path / "out")]) == 2
    assert "error:" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
