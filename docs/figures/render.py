"""A small z-buffer renderer: flat-shaded triangles, lines where the surface breaks, light from above.

Depth is decided for each pixel, so that pieces with pockets hide one another as they should (a painter's order of
whole triangles cannot do that).
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.ndimage import gaussian_filter

from drkid.mesh import Floats, Ints, TriMesh

OVERSAMPLING = 3  # pixels a side that are averaged into one
LIGHTS = (((-0.35, 0.6, 0.7), 0.55), ((0.7, -0.2, 0.6), 0.18))  # direction (right, up, to the eye) and strength
AMBIENT = 0.42
MIST = 0.45  # of white over what is farthest from the eye
LINE = np.array([0.10, 0.10, 0.13])
CREASE_COSINE = 0.9  # normals of neighbouring pixels that differ by more than about 26° are parted by a line
MARGIN = 0.03  # of the larger side of the picture


@dataclass(frozen=True, eq=False)
class Body:
    """Something to draw: a mesh and its colours, one (3,) for all faces or one for each face (F, 3), in [0, 1].

    `smooth` shades by vertex normals; `edges` draws a line around every face.
    """

    mesh: TriMesh
    colour: Floats
    smooth: bool = False
    edges: bool = False


def colour(code: str) -> Floats:
    """The three channels of #RRGGBB."""
    return np.array([int(code[i : i + 2], 16) for i in (1, 3, 5)]) / 255


def camera(azimuth_degrees: float, elevation_degrees: float, roll_degrees: float = 0.0) -> Floats:
    """(3, 3): rows right, up and to the eye of a viewer at this azimuth (from +x) and elevation."""
    azimuth, elevation, roll = np.radians([azimuth_degrees, elevation_degrees, roll_degrees])
    eye = np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    up = np.cross(eye, right)
    return np.stack([np.cos(roll) * right + np.sin(roll) * up, np.cos(roll) * up - np.sin(roll) * right, eye])


def render(bodies: list[Body], view: Floats, width: int, scale: float | None = None) -> Floats:
    """(height, width, 3): the bodies as seen without perspective, on white.

    `scale` is pixels a unit, the bodies in the middle; without it they fill the width.
    """
    corners = np.concatenate([body.mesh.corners for body in bodies]) @ view.T
    low, high = corners.reshape(-1, 3).min(axis=0), corners.reshape(-1, 3).max(axis=0)
    scale = width * (1 - 2 * MARGIN) / (high - low)[0] if scale is None else scale
    height = int(np.ceil(scale * (high - low)[1] + 2 * MARGIN * width))
    fine = OVERSAMPLING * scale
    size = np.array([width, height]) * OVERSAMPLING
    pixels = (corners - [*(low + high)[:2] / 2, 0.0]) * [fine, -fine, fine] + [*size / 2, 0.0]
    faces, depth, share = _rasterise(pixels, int(size[0]), int(size[1]))
    picture = _shaded(bodies, view, faces, share)
    picture *= (1 - 0.5 * _hollows(depth, faces, fine * float((high - low).max())))[..., None]
    picture[_lines(bodies, view, faces)] = LINE
    mist = MIST * np.clip((high[2] * fine - depth) / (fine * (high - low)[2]), 0, 1) ** 1.5
    picture += mist[..., None] * (1 - picture)
    picture[faces < 0] = 1.0
    picture = picture.reshape(height, OVERSAMPLING, width, OVERSAMPLING, 3).mean(axis=(1, 3))
    return np.clip(picture, 0, 1)


@njit(cache=True)
def _rasterise(corners: Floats, width: int, height: int) -> tuple[Ints, Floats, Floats]:
    # Nearest triangle, its depth and its barycentric coordinates at each pixel's middle; -1 where there is none.
    faces = np.full((height, width), -1, np.int64)
    depth, share = np.full((height, width), -np.inf), np.zeros((height, width, 3))
    for f in range(len(corners)):
        a, b, c = corners[f, 0], corners[f, 1], corners[f, 2]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area >= 0:  # seen from behind (rows run downwards), or edge-on
            continue
        x0, x1 = max(0, int(min(a[0], b[0], c[0]))), min(width - 1, int(max(a[0], b[0], c[0])) + 1)
        y0, y1 = max(0, int(min(a[1], b[1], c[1]))), min(height - 1, int(max(a[1], b[1], c[1])) + 1)
        for row in range(y0, y1 + 1):
            for column in range(x0, x1 + 1):
                x, y = column + 0.5, row + 0.5
                u = ((b[0] - x) * (c[1] - y) - (b[1] - y) * (c[0] - x)) / area
                v = ((c[0] - x) * (a[1] - y) - (c[1] - y) * (a[0] - x)) / area
                w = 1 - u - v
                if u < 0 or v < 0 or w < 0:
                    continue
                z = u * a[2] + v * b[2] + w * c[2]
                if z > depth[row, column]:
                    depth[row, column], faces[row, column] = z, f
                    share[row, column, 0], share[row, column, 1], share[row, column, 2] = u, v, w
    return faces, depth, share


def _shaded(bodies: list[Body], view: Floats, faces: Ints, share: Floats) -> Floats:
    normals = np.concatenate([_corner_normals(body) for body in bodies]) @ view.T
    colours = np.concatenate([np.broadcast_to(body.colour, (len(body.mesh.faces), 3)) for body in bodies])
    normal = np.einsum("hwc,hwck->hwk", share, normals[faces])
    normal /= np.maximum(np.linalg.norm(normal, axis=2, keepdims=True), 1e-12)
    light = np.full(faces.shape, AMBIENT)
    for direction, strength in LIGHTS:
        light += strength * np.maximum(normal @ (np.array(direction) / np.linalg.norm(direction)), 0)
    return np.minimum(colours[faces] * light[..., None] + 0.06 * light[..., None] ** 4, 1.0)


def _corner_normals(body: Body) -> Floats:
    if body.smooth:
        return body.mesh.vertex_normals[body.mesh.faces]
    return np.repeat(body.mesh.face_normals[:, None], 3, axis=1)


def _hollows(depth: Floats, faces: Ints, size: float) -> Floats:
    """How far each pixel lies behind its surroundings, in [0, 1]: a cheap stand-in for shadows in hollows."""
    seen = (faces >= 0).astype(float)
    filled = np.where(faces >= 0, depth, 0.0)
    total = np.zeros_like(filled)
    for share in (0.004, 0.012, 0.035):
        sigma = share * size
        around = gaussian_filter(filled, sigma) / np.maximum(gaussian_filter(seen, sigma), 1e-3)
        total += np.clip((around - filled) / (3 * sigma), 0, 1) / 3
    return np.where(faces >= 0, np.minimum(1.6 * total, 1), 0.0)


def _lines(bodies: list[Body], view: Floats, faces: Ints) -> Floats:
    """Where neighbouring pixels see different bodies, the background, or faces of a body that meet in a crease."""
    owner = np.repeat(np.arange(len(bodies)), [len(body.mesh.faces) for body in bodies])
    smooth, edges = np.array([body.smooth for body in bodies]), np.array([body.edges for body in bodies])
    normals = np.concatenate([body.mesh.face_normals for body in bodies]) @ view.T
    lines = np.zeros(faces.shape, bool)
    for axis in (0, 1):
        here = tuple(slice(None, -1) if a == axis else slice(None) for a in (0, 1))
        there = tuple(slice(1, None) if a == axis else slice(None) for a in (0, 1))
        f, g = faces[here], faces[there]
        both = (f >= 0) & (g >= 0)
        crease = np.einsum("hwk,hwk->hw", normals[f], normals[g]) < CREASE_COSINE
        apart = (f >= 0) != (g >= 0)
        apart |= both & ((owner[f] != owner[g]) | (crease & ~smooth[owner[f]]) | (edges[owner[f]] & (f != g)))
        lines[here] |= apart
        lines[there] |= apart
    return lines
