import io

import numpy as np
import pytest
from skimage.io import imread

from drkid.export.kit_document import parts_list, printed_meshes
from drkid.report.part_picture import HEIGHT, WIDTH, part_picture
from drkid.report.tables import parts_table


def test_a_part_is_seen_in_its_colour_on_white(kit):
    mesh = next(iter(printed_meshes(kit).values()))
    pixels = imread(io.BytesIO(part_picture(mesh, "#3366CC"))).astype(float)
    assert pixels.shape[:2] == (HEIGHT, WIDTH)
    shown = pixels[..., :3].min(axis=2) < 250
    assert 0.15 < shown.mean() < 0.9
    assert np.median(pixels[shown][:, 2]) > 1.5 * np.median(pixels[shown][:, 0])


@pytest.mark.parametrize("with_pictures", [True, False])
def test_every_printed_part_of_the_list_has_its_picture(kit, with_pictures):
    meshes = printed_meshes(kit)
    rows = parts_list(kit, meshes)
    pictures = dict.fromkeys(meshes, b"png") if with_pictures else {}
    html = parts_table(rows, pictures)
    assert html.count("<img") == (len(meshes) if with_pictures else 0)
    assert all(row.part in html for row in rows)
