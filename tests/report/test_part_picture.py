import io

import numpy as np
from PIL import Image

from drkid.export.kit_document import printed_meshes
from drkid.report.part_picture import HEIGHT, WIDTH, part_picture


def test_a_part_is_seen_in_its_colour_on_white(kit):
    mesh = next(iter(printed_meshes(kit).values()))
    for content, share in zip(part_picture(mesh, "#3366CC"), (1, 2), strict=True):
        pixels = np.asarray(Image.open(io.BytesIO(content)).convert("RGB")).astype(float)
        assert pixels.shape[:2] == (HEIGHT // share, WIDTH // share)
        shown = pixels.min(axis=2) < 250
        assert 0.15 < shown.mean() < 0.9
        assert np.median(pixels[shown][:, 2]) > 1.5 * np.median(pixels[shown][:, 0])
