"""Triangle-triangle intersection, decided exactly: which faces of a mesh cut one another.

Guigue and Devillers, "Fast and robust triangle-triangle overlap test using orientation predicates" (2003), for deciding
by signs of determinants alone; Shewchuk, "Adaptive precision floating-point arithmetic and fast robust geometric
predicates" (1997), for getting those signs right.
"""

import numpy as np
from numba import njit

from drkid.mesh import Floats, Ints, TriMesh, read_only

UNIT_ROUNDOFF = 2.0**-53
ORIENT_BOUND = (7 + 56 * UNIT_ROUNDOFF) * UNIT_ROUNDOFF  # Shewchuk's filter for orient3d, table 2
SPLITTER = 2.0**27 + 1  # Veltkamp's, for 53 bits


@njit(cache=True)
def _add_exactly(partials: Floats, used: int, x: float) -> int:
    # Grow-expansion (Shewchuk, figure 6): `partials` add up to the exact sum, without zeros, smallest first.
    kept = 0
    for i in range(used):
        y = partials[i]
        high = x + y
        virtual = high - x
        low = (x - (high - virtual)) + (y - virtual)
        if low != 0.0:
            partials[kept] = low
            kept += 1
        x = high
    if x != 0.0:
        partials[kept] = x
        kept += 1
    return kept


@njit(cache=True)
def _product(a: float, b: float) -> tuple[float, float]:
    # Two-product (Shewchuk, figure 11): a b = high + low exactly.
    high = a * b
    t = SPLITTER * a
    a1 = t - (t - a)
    a2 = a - a1
    t = SPLITTER * b
    b1 = t - (t - b)
    b2 = b - b1
    return high, a2 * b2 - (((high - a1 * b1) - a2 * b1) - a1 * b2)


@njit(cache=True)
def _add_triple(partials: Floats, used: int, a: float, b: float, c: float) -> int:
    high, low = _product(a, b)
    for factor in (high, low):
        big, small = _product(factor, c)
        used = _add_exactly(partials, used, small)
        used = _add_exactly(partials, used, big)
    return used


@njit(cache=True)
def _sign(partials: Floats, used: int) -> int:
    if used == 0:
        return 0
    return 1 if partials[used - 1] > 0 else -1


@njit(cache=True)
def _add_determinant(partials: Floats, used: int, p: Floats, q: Floats, r: Floats, sign: float) -> int:
    used = _add_triple(partials, used, sign * p[0], q[1], r[2])
    used = _add_triple(partials, used, sign * p[1], q[2], r[0])
    used = _add_triple(partials, used, sign * p[2], q[0], r[1])
    used = _add_triple(partials, used, -sign * p[2], q[1], r[0])
    used = _add_triple(partials, used, -sign * p[1], q[0], r[2])
    return _add_triple(partials, used, -sign * p[0], q[2], r[1])


@njit(cache=True)
def _orient3d(a: Floats, b: Floats, c: Floats, d: Floats) -> int:
    # Sign of det(a − d, b − d, c − d).
    ax, ay, az = a[0] - d[0], a[1] - d[1], a[2] - d[2]
    bx, by, bz = b[0] - d[0], b[1] - d[1], b[2] - d[2]
    cx, cy, cz = c[0] - d[0], c[1] - d[1], c[2] - d[2]
    value = az * (bx * cy - cx * by) + bz * (cx * ay - ax * cy) + cz * (ax * by - bx * ay)
    permanent = (
        (abs(bx * cy) + abs(cx * by)) * abs(az)
        + (abs(cx * ay) + abs(ax * cy)) * abs(bz)
        + (abs(ax * by) + abs(bx * ay)) * abs(cz)
    )
    if abs(value) > ORIENT_BOUND * permanent:
        return 1 if value > 0 else -1
    partials = np.empty(97)
    used = _add_determinant(partials, int(np.int64(0)), a, b, c, 1.0)
    used = _add_determinant(partials, used, a, b, d, -1.0)
    used = _add_determinant(partials, used, a, c, d, 1.0)
    used = _add_determinant(partials, used, b, c, d, -1.0)
    return _sign(partials, used)


@njit(cache=True)
def _orient2d(a: Floats, b: Floats, c: Floats, x: int, y: int) -> int:
    # Sign of the area of a, b, c in the coordinates x and y.
    partials, used = np.empty(13), int(np.int64(0))
    for p, q, sign in ((a, b, 1.0), (b, c, 1.0), (c, a, 1.0)):
        used = _add_triple(partials, used, sign * p[x], q[y], 1.0)
        used = _add_triple(partials, used, -sign * p[y], q[x], 1.0)
    return _sign(partials, used)


@njit(cache=True)
def _apart(a: float, b: float, c: float, d: float) -> bool:
    return max(a, b) < min(c, d) or max(c, d) < min(a, b)


@njit(cache=True)
def _straddled(a: Floats, b: Floats, c: Floats, d: Floats, x: int, y: int) -> bool:
    # Do the closed segments ab and cd of one plane meet?
    one, two = _orient2d(a, b, c, x, y), _orient2d(a, b, d, x, y)
    three, four = _orient2d(c, d, a, x, y), _orient2d(c, d, b, x, y)
    if one == 0 and two == 0:
        return not (_apart(a[x], b[x], c[x], d[x]) or _apart(a[y], b[y], c[y], d[y]))
    return one * two <= 0 and three * four <= 0


@njit(cache=True)
def _coplanar_meets(p: Floats, q: Floats, a: Floats, b: Floats, c: Floats) -> bool:
    # Does the closed segment pq meet the closed triangle abc of the same plane?
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    nx, ny, nz = abs(uy * vz - uz * vy), abs(uz * vx - ux * vz), abs(ux * vy - uy * vx)
    if nx >= ny and nx >= nz:
        x, y = 1, 2
    elif ny >= nz:
        x, y = 2, 0
    else:
        x, y = 0, 1
    if _straddled(p, q, a, b, x, y) or _straddled(p, q, b, c, x, y) or _straddled(p, q, c, a, x, y):
        return True
    one, two, three = _orient2d(a, b, p, x, y), _orient2d(b, c, p, x, y), _orient2d(c, a, p, x, y)
    return (one >= 0 and two >= 0 and three >= 0) or (one <= 0 and two <= 0 and three <= 0)


@njit(cache=True)
def _meets(p: Floats, q: Floats, a: Floats, b: Floats, c: Floats) -> bool:
    # Does the closed segment pq meet the closed triangle abc?
    one, two = _orient3d(a, b, c, p), _orient3d(a, b, c, q)
    if one * two > 0:
        return False
    if one == 0 and two == 0:
        return _coplanar_meets(p, q, a, b, c)
    first, second, third = _orient3d(p, q, a, b), _orient3d(p, q, b, c), _orient3d(p, q, c, a)
    return (first >= 0 and second >= 0 and third >= 0) or (first <= 0 and second <= 0 and third <= 0)


@njit(cache=True)
def _folded(v: Floats, w: Floats, a: Floats, b: Floats) -> bool:
    # Do the triangles vwa and wvb lie on top of one another: in one plane, a and b on the same side of vw?
    if _orient3d(v, w, a, b) != 0:
        return False
    for x in range(3):
        y = (x + 1) % 3
        if _orient2d(v, w, a, x, y) * _orient2d(v, w, b, x, y) > 0:
            return True
    return False


@njit(cache=True)
def _cuts(vertices: Floats, first: Ints, second: Ints) -> bool:
    # Do two faces meet anywhere but in the vertices and the edge that they share?
    s, t = first.copy(), second.copy()
    shared = 0
    for i in range(3):
        for j in range(shared, 3):
            if s[i] == t[j]:
                s[i], s[shared] = s[shared], s[i]
                t[j], t[shared] = t[shared], t[j]
                shared += 1
                break
    a, b, c = vertices[s[0]], vertices[s[1]], vertices[s[2]]
    d, e, f = vertices[t[0]], vertices[t[1]], vertices[t[2]]
    if shared == 3:
        return True
    if shared == 2:
        return _folded(a, b, c, f)
    # Two triangles with a common vertex share a segment from there, which ends on a side opposite to it.
    if _meets(b, c, d, e, f) or _meets(e, f, a, b, c):
        return True
    if shared == 1:
        return False
    return _meets(a, b, d, e, f) or _meets(c, a, d, e, f) or _meets(d, e, a, b, c) or _meets(f, d, a, b, c)


@njit(cache=True)
def _cutting_pairs(vertices: Floats, faces: Ints, low: Floats, high: Floats, order: Ints) -> list[tuple[int, int]]:
    # Sweep along x: `order` sorts the boxes by their lowest x.
    found = []
    for i in range(len(order)):
        f = order[i]
        for j in range(i + 1, len(order)):
            g = order[j]
            if low[g, 0] > high[f, 0]:
                break
            apart = low[g, 1] > high[f, 1] or low[f, 1] > high[g, 1] or low[g, 2] > high[f, 2] or low[f, 2] > high[g, 2]
            if not apart and _cuts(vertices, faces[f], faces[g]):
                found.append((min(f, g), max(f, g)))
    return found


def self_intersections(mesh: TriMesh) -> Ints:
    """The pairs of faces (n, 2), lower first, that meet anywhere but in the vertices or the edge that they share.

    Touching counts; so do neighbours folded flat on top of one another, and a face given twice. Exact as long as no
    product of three coordinates over- or underflows. Faces without area are taken as the segments that they are.
    """
    if not len(mesh.faces):
        return read_only(np.empty((0, 2), np.int64))
    low, high = mesh.corners.min(axis=1), mesh.corners.max(axis=1)
    turned = np.argsort(-mesh.extents)  # the sweep goes along the longest side of the bounding box
    order = np.argsort(low[:, turned[0]], kind="stable")
    pairs = _cutting_pairs(
        mesh.vertices, mesh.faces, np.ascontiguousarray(low[:, turned]), np.ascontiguousarray(high[:, turned]), order
    )
    return read_only(np.array(sorted(pairs), np.int64).reshape(-1, 2))
