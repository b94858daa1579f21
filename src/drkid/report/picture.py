"""Pictures without a GPU: flat-shaded triangles, lines where the surface breaks, light from above, soft edges."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from drkid.mesh import Bools, Floats, Ints, TriMesh
from drkid.report.rasteriser import rasterise

OVERSAMPLING = 3  # pixels a side that are averaged into one
LIGHTS = (((-0.35, 0.6, 0.7), 0.55), ((0.7, -0.2, 0.6), 0.18))  # direction (right, up, to the eye) and strength
AMBIENT = 0.42
MIST = 0.45  # of white over what is farthest from the eye
LINE = np.array([0.10, 0.10, 0.13])
CREASE_COSINE = 0.9  # normals of neighbouring pixels that differ by more than about 26° are parted by a line
GHOST, VEIL = np.array([0.55, 0.62, 0.75]), 0.35  # colour of what is laid over the rest, and how much it hides
HOLLOWS = (0.004, 0.012, 0.035)  # widths of the surroundings, of the longest side of what is shown
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


def camera(azimuth_degrees: float, elevation_degrees: float, roll_degrees: float = 0.0) -> Floats:
    """(3, 3): rows right, up and to the eye of a viewer at this azimuth (from +x) and elevation."""
    azimuth, elevation, roll = np.radians([azimuth_degrees, elevation_degrees, roll_degrees])
    eye = np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    up = np.cross(eye, right)
    return np.stack([np.cos(roll) * right + np.sin(roll) * up, np.cos(roll) * up - np.sin(roll) * right, eye])


def render(
    bodies: Sequence[Body],
    view: Floats,
    width: int,
    height: int | None = None,
    *,
    scale: float | None = None,
    ghost: TriMesh | None = None,
) -> Floats:
    """(height, width, 3) in [0, 1]: the bodies as seen without perspective, on white.

    They fill the picture, whose height follows from the width where it is not given. `scale` is pixels a unit in
    place of that; `ghost` is laid over them, translucent.
    """
    shown = [body.mesh for body in bodies] + ([] if ghost is None else [ghost])
    everything = np.concatenate([mesh.corners for mesh in shown]) @ view.T
    low, high = everything.reshape(-1, 3).min(axis=0), everything.reshape(-1, 3).max(axis=0)
    extents = np.maximum(high - low, 1e-9)
    fitting = width * (1 - 2 * MARGIN) / extents[0]
    fitting = fitting if height is None else min(fitting, (height - 2 * MARGIN * width) / extents[1])
    scale = float(fitting) if scale is None else scale
    height = int(np.ceil(scale * extents[1] + 2 * MARGIN * width)) if height is None else height
    fine = OVERSAMPLING * scale
    size = np.array([width, height]) * OVERSAMPLING

    def on_screen(corners: Floats) -> Floats:
        middle, half = np.array([*(low + high)[:2] / 2, 0.0]), np.array([*size / 2, 0.0])
        return (corners - middle) * [fine, -fine, fine] + half

    corners = np.concatenate([body.mesh.corners for body in bodies]) @ view.T
    faces, depth, share = rasterise(on_screen(corners), int(size[0]), int(size[1]))
    picture = _shaded(bodies, view, faces, share)
    picture *= (1 - 0.5 * _hollows(depth, faces, fine * float(extents.max())))[..., None]
    picture[_lines(bodies, view, faces)] = LINE
    mist = MIST * np.clip((high[2] * fine - depth) / (fine * extents[2]), 0, 1) ** 1.5
    picture += mist[..., None] * (1 - picture)
    picture[faces < 0] = 1.0
    if ghost is not None:
        picture = _veiled(picture, depth, Body(ghost, GHOST, smooth=True), view, on_screen(ghost.corners @ view.T))
    return np.clip(_averaged(picture), 0, 1)


def _veiled(picture: Floats, depth: Floats, ghost: Body, view: Floats, corners: Floats) -> Floats:
    """The picture behind a translucent body, which is seen where it is nearer than what stands there."""
    faces, ghost_depth, share = rasterise(corners, depth.shape[1], depth.shape[0])
    veil = _shaded([ghost], view, faces, share)
    front = (faces >= 0) & (ghost_depth > depth)
    picture[front] += VEIL * (veil[front] - picture[front])
    return picture


def _shaded(bodies: Sequence[Body], view: Floats, faces: Ints, share: Floats) -> Floats:
    normals = np.concatenate([_corner_normals(body) for body in bodies]) @ view.T
    colours = np.concatenate([np.broadcast_to(body.colour, (len(body.mesh.faces), 3)) for body in bodies])
    lit = faces >= 0
    normal = np.einsum("pc,pck->pk", share[lit], normals[faces[lit]])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    light = np.full(len(normal), AMBIENT)
    for direction, strength in LIGHTS:
        light += strength * np.maximum(normal @ (np.array(direction) / np.linalg.norm(direction)), 0)
    picture = np.ones((*faces.shape, 3))
    picture[lit] = np.minimum(colours[faces[lit]] * light[:, None] + 0.06 * light[:, None] ** 4, 1.0)
    return picture


def _corner_normals(body: Body) -> Floats:
    if body.smooth:
        return body.mesh.vertex_normals[body.mesh.faces]
    return np.repeat(body.mesh.face_normals[:, None], 3, axis=1)


def _hollows(depth: Floats, faces: Ints, size: float) -> Floats:
    """How far each pixel lies behind its surroundings, in [0, 1]: a cheap stand-in for shadows in hollows.

    Taken on the finished picture's pixels: shadows are soft, and wide filters are dear.
    """
    seen = _averaged((faces >= 0).astype(np.float64))
    filled = _averaged(np.where(faces >= 0, depth, 0.0))
    here = filled / np.maximum(seen, 1e-3)
    total = np.zeros_like(filled)
    for share in HOLLOWS:
        sigma = share * size / OVERSAMPLING
        around = gaussian_filter(filled, sigma, truncate=2.5) / np.maximum(
            gaussian_filter(seen, sigma, truncate=2.5), 1e-3
        )
        total += np.clip((around - here) / (3 * sigma * OVERSAMPLING), 0, 1) / len(HOLLOWS)
    shadow = np.where(seen > 0, np.minimum(1.6 * total, 1), 0.0)
    return np.asarray(np.kron(shadow, np.ones((OVERSAMPLING, OVERSAMPLING))), np.float64)


def _averaged(fine: Floats) -> Floats:
    """(height, width, …): the means over the fine pixels of each pixel."""
    height, width = fine.shape[0] // OVERSAMPLING, fine.shape[1] // OVERSAMPLING
    return fine.reshape(height, OVERSAMPLING, width, OVERSAMPLING, *fine.shape[2:]).mean(axis=(1, 3), dtype=np.float64)


def _lines(bodies: Sequence[Body], view: Floats, faces: Ints) -> Bools:
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
