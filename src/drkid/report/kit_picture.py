"""The picture of a kit: its pieces at their places, whole or moved apart."""

from pathlib import Path

import numpy as np

from drkid.errors import SpecError
from drkid.mesh import Floats
from drkid.report.colouring import UNITS, Colouring, piece_colours, piece_values
from drkid.report.picture import Body, camera, render
from drkid.report.png import png_bytes
from drkid.report.scene import Scene, scene_at

VIEWS = {
    "front": (-90.0, 0.0), "back": (90.0, 0.0), "left": (180.0, 0.0), "right": (0.0, 0.0),
    "top": (-90.0, 90.0), "bottom": (-90.0, -90.0), "corner": (-62.0, 34.0),
}  # fmt: skip
TILT_DEGREES = 30.0  # of the broad side's view, so that it is seen a little from above
MOST_PIXELS = 8000  # a side of a picture


def draw_kit(
    folder: Path,
    *,
    view: str = "broad",
    size: str = "1200",
    explode: float = 0.0,
    by: Colouring = "class",
    surface: bool = False,
) -> tuple[bytes, str]:
    """A kit folder as PNG, and what its colours mean, in a sentence; empty for classes.

    `explode` moves pieces out by this share of their distance to the middle, `surface` lays M_i over them.

    Raises:
        SpecError: the view or the size cannot be used.
        KitFolderError: the folder is no kit.
    """
    width, height = size_named(size)
    scene = scene_at(folder)
    picture = kit_picture(scene, view_named(scene, view), width, height, explode=explode, by=by, surface=surface)
    values = piece_values(scene, by)
    if values is None:
        return png_bytes(picture), ""
    legend = f"{by} from 0 (dark) to {values.max():.3g} {UNITS[by]} (bright), mean {values.mean():.3g}"
    return png_bytes(picture), legend


def kit_picture(
    scene: Scene,
    view: Floats,
    width: int,
    height: int | None = None,
    *,
    explode: float = 0.0,
    by: Colouring = "class",
    surface: bool = False,
) -> Floats:
    """(height, width, 3): the kit on white; `explode` moves pieces out by this share, `surface` lays M_i over them."""
    colours = piece_colours(scene, by)
    bodies = [Body(scene.placed(i, explode), tint) for i, tint in enumerate(colours)]
    return render(bodies, view, width, height, ghost=scene.surface if surface else None)


def view_named(scene: Scene, name: str) -> Floats:
    """(3, 3): the camera of a name of `VIEWS`, of 'broad', which shows the longest two axes, or of two angles.

    Raises:
        SpecError: it is none of these.
    """
    if name == "broad":
        return _broad(scene)
    if name in VIEWS:
        return camera(*VIEWS[name])
    try:
        azimuth, elevation = (float(word) for word in name.split(","))
    except ValueError:
        raise SpecError(
            "the view cannot be used",
            wanted=f"broad, {', '.join(VIEWS)}, or AZIMUTH,ELEVATION in degrees",
            found=name,
            remedy="--view corner, or --view=-62,34",
        ) from None
    return camera(azimuth, elevation)


def size_named(text: str) -> tuple[int, int | None]:
    """Width, and height where it is given, of '1200' or '1200x800'.

    Raises:
        SpecError: it is neither, or too large.
    """
    words = text.lower().split("x")
    if len(words) > 2 or not all(w.isascii() and w.isdigit() and 16 <= int(w) <= MOST_PIXELS for w in words):
        raise SpecError(
            "the size cannot be used",
            wanted=f"WIDTH or WIDTHxHEIGHT in pixels, 16 to {MOST_PIXELS} each",
            found=text,
            remedy="--size 1200, or --size 1200x800",
        )
    return int(words[0]), int(words[1]) if len(words) == 2 else None


def _broad(scene: Scene) -> Floats:
    """Right along the longest principal axis, the eye near the shortest, tilted."""
    points = scene.assembled.vertices - scene.assembled.vertices.mean(axis=0)
    axes = np.linalg.eigh(points.T @ points)[1]
    right, eye = _upright(axes[:, 2]), _upright(axes[:, 0])
    up = np.cross(eye, right)
    tilt = np.radians(TILT_DEGREES)
    return np.stack([right, np.cos(tilt) * up - np.sin(tilt) * eye, np.cos(tilt) * eye + np.sin(tilt) * up])


def _upright(axis: Floats) -> Floats:
    """The axis with its largest component positive: an eigenvector's sign is arbitrary."""
    return axis * np.sign(axis[np.abs(axis).argmax()])
