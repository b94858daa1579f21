"""Pictures without a GPU: nearer bodies hide farther ones, and the file is a PNG that others can read."""

import io

import numpy as np
import pytest
from PIL import Image

from drkid.cli import run
from drkid.mesh import TriMesh
from drkid.report.kit_picture import kit_picture, view_named
from drkid.report.picture import Body, camera, render
from drkid.report.png import png_bytes
from drkid.report.scene import scene_at

RED, BLUE = np.array([0.9, 0.1, 0.1]), np.array([0.1, 0.1, 0.9])


def plate(z, half):
    corners = np.array([[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]])
    return TriMesh(corners, np.array([[0, 1, 2], [0, 2, 3]]))


@pytest.mark.parametrize("order", [1, -1])
def test_the_nearer_plate_is_seen_whatever_the_order(order):
    bodies = [Body(plate(0.0, 2.0), RED), Body(plate(1.0, 1.0), BLUE)][::order]
    shown = render(bodies, camera(-90, 90), 60, 60)
    assert shown[30, 30].argmax() == 2
    assert shown[30, 8].argmax() == 0
    assert (shown[0, 0] == 1).all()


def test_png_is_read_back_as_it_was():
    rng = np.random.default_rng(0)
    picture = rng.integers(0, 256, (7, 5, 3)) / 255
    image = Image.open(io.BytesIO(png_bytes(picture)))
    assert (np.asarray(image) == (255 * picture).round()).all()


def test_pieces_moved_apart_and_other_colours_give_other_pictures(scene):
    view = view_named(scene, "broad")
    shown = [kit_picture(scene, view, 120, 90)]
    shown.append(kit_picture(scene, view, 120, 90, explode=0.5))
    shown.append(kit_picture(scene, view, 120, 90, by="distance"))
    shown.append(kit_picture(scene, view, 120, 90, surface=True))
    assert all((other != shown[0]).any() for other in shown[1:])
    assert all(picture.shape == (90, 120, 3) for picture in shown)


def test_a_folder_is_the_same_scene_as_its_kit(scene, kit_folder):
    found = scene_at(kit_folder)
    np.testing.assert_allclose(found.error_percent, scene.error_percent)
    np.testing.assert_allclose(found.bend_degrees, scene.bend_degrees)
    np.testing.assert_allclose(found.distance_percent, scene.distance_percent)
    assert (found.piece_step == scene.piece_step).all()


def test_figures_of_pieces_are_those_of_the_kit(scene):
    metrics = scene.document.metrics
    assert scene.error_percent.max() == pytest.approx(metrics.error_max_percent)
    assert scene.error_percent.mean() == pytest.approx(metrics.error_mean_percent)
    assert scene.bend_degrees.max() == pytest.approx(max(abs(180 - j.dihedral_degrees) for j in scene.document.joints))


def test_render_writes_a_picture_and_says_what_colours_mean(kit_folder, tmp_path, capsys):
    path = tmp_path / "kit.png"
    arguments = [
        "render",
        str(kit_folder),
        "--out",
        str(path),
        "--size",
        "120x80",
        "--colour",
        "error",
        "--view",
        "top",
    ]
    assert run(arguments) == 0
    assert "% of the mean edge" in capsys.readouterr().out
    with Image.open(path) as image:
        assert image.size == (120, 80)


@pytest.mark.parametrize(
    ("flags", "word"),
    [
        (["--view", "above"], "broad"),
        (["--size", "12"], "WIDTH"),
        (["--explode", "-1"], "0 to 10"),
        (["--out", "kit.jpg"], ".png"),
        (["--out", "nowhere/kit.png"], "folder"),
    ],
)
def test_what_cannot_be_drawn_is_explained(flags, word, kit_folder, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run(["render", str(kit_folder), *(() if "--size" in flags else ("--size", "40")), *flags]) == 2
    assert word in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
