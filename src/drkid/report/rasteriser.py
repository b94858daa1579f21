"""The z-buffer: which triangle each pixel sees. Depth is decided for each pixel, so pieces hide one another rightly."""

import numpy as np
from numba import njit

from drkid.mesh import Floats, Ints


@njit(cache=True)
def rasterise(corners: Floats, width: int, height: int) -> tuple[Ints, Floats, Floats]:
    """Nearest triangle (height, width), its depth and its barycentric coordinates at each pixel's middle; -1: none.

    `corners` (n, 3, 3) are columns, rows running downwards, and height towards the eye. Triangles that are seen from
    behind are left out.
    """
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
