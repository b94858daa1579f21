"""The picture of a part, for its line in the parts list."""

from drkid.mesh import TriMesh
from drkid.report.colouring import channels
from drkid.report.picture import Body, camera, render
from drkid.report.png import png_bytes

AZIMUTH_DEGREES, ELEVATION_DEGREES = -60.0, -40.0  # from inside, where pockets and marks are
WIDTH, HEIGHT = 192, 144  # in pixels


def part_picture(mesh: TriMesh, colour: str) -> tuple[bytes, bytes]:
    """A part in its colour (#RRGGBB) as PNG, seen from its inner side; the same at half the size, for a page."""
    view = camera(AZIMUTH_DEGREES, ELEVATION_DEGREES)
    picture = render([Body(mesh, channels(colour))], view, WIDTH, HEIGHT)
    small = picture.reshape(HEIGHT // 2, 2, WIDTH // 2, 2, 3).mean(axis=(1, 3))
    return png_bytes(picture), png_bytes(small)
