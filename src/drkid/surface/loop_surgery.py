"""Handles of a mesh closed: cut along a loop that does not part the surface, both rims capped.

Surgery takes one handle away. Along a loop around a bridge it cuts the bridge; along one through a tunnel it fills the
tunnel (Guskov and Wood, "Topological noise removal", Graphics Interface 2001).
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from drkid.errors import InputError
from drkid.intersection import self_intersections
from drkid.mesh import Bools, Floats, Ints, TriMesh
from drkid.surface.shortest_loop import shortest_loops

FLARE = 1.3  # times the first rim's extent: a bridge or tunnel ends where its rim gets wider than this
MOST_REMOVED = 0.05  # of the area, for one handle: the rest of a long bridge stays as two stubs


@dataclass(frozen=True, eq=False)
class ClosedHandle:
    """A bridge that was cut or a tunnel that was filled: the middle (3,) of the loop around it, and its length."""

    way: Literal["filled", "cut"]
    centre: Floats
    around: float


def without_mesh_handles(mesh: TriMesh, most: int) -> tuple[TriMesh, tuple[ClosedHandle, ...]]:
    """The mesh with its smallest handles closed, those of the shortest loops, until at most `most` are left.

    Elsewhere faces and vertices are what they were. The mesh is closed, manifold and in one piece, and stays so.

    Raises:
        InputError: a handle cannot be closed without caps that cut the surface.
    """
    closed: list[ClosedHandle] = []
    start = mesh.genus
    while mesh.genus > most:
        loops = shortest_loops(mesh)
        found = next((done for around, loop in loops if (done := _closed(mesh, loop, around)) is not None), None)
        if found is None:
            raise InputError(
                f"{mesh.genus - most} of {start} handles cannot be closed: every cap would cut the surface",
                wanted=f"a surface of genus {most} at most (--max-genus)",
                found=f"genus {mesh.genus} after {len(closed)} closings",
                remedy=f"--max-genus {mesh.genus}, or close them in the mesh",
            )
        mesh = found[0]
        closed.append(found[1])
    return mesh, tuple(closed)


def _closed(mesh: TriMesh, loop: Ints, around: float) -> tuple[TriMesh, ClosedHandle] | None:
    """With the whole of the bridge or tunnel gone, or else with a slit; None where caps cut the surface either way."""
    slit = _cut_along(mesh, loop)
    for opened in (slit.submesh(_outside_the_neck(slit, mesh.vertices[loop])), slit):
        capped = _capped(opened)
        caps = np.arange(len(opened.faces), len(capped.faces))
        if capped.genus == mesh.genus - 1 and capped.component_count == 1 and not _cuts(capped, caps):
            way = "filled" if capped.volume > mesh.volume else "cut"
            return capped, ClosedHandle(way, mesh.vertices[loop].mean(axis=0), around)
    return None


def _cut_along(mesh: TriMesh, loop: Ints) -> TriMesh:
    """Without what lies within half an edge of a loop that has no chord: a surface with two rims."""
    on = np.zeros(len(mesh.vertices), np.bool_)
    on[loop] = True
    split = np.flatnonzero(on[mesh.edges].sum(axis=1) == 1)
    number = np.full(len(mesh.edges), -1, np.int64)
    number[split] = len(mesh.vertices) + np.arange(len(split))
    touching = on[mesh.faces].sum(axis=1)
    faces = [mesh.faces[touching == 0]]
    for count in (1, 2):  # corners on the loop; turned so that the corner that differs from the two others is the first
        chosen = np.flatnonzero(touching == count)
        apart = (on[mesh.faces[chosen]] == (count == 1)).argmax(axis=1)
        turn = (apart[:, None] + np.arange(3)) % 3
        a, b, c = np.take_along_axis(mesh.faces[chosen], turn, axis=1).T
        ab, _, ca = np.take_along_axis(number[mesh.face_edges[chosen]], turn, axis=1).T
        faces += [np.column_stack(t) for t in (((ab, b, c), (ab, c, ca)) if count == 1 else ((a, ab, ca),))]
    whole = TriMesh(
        np.concatenate([mesh.vertices, mesh.vertices[mesh.edges[split]].mean(axis=1)]), np.concatenate(faces)
    )
    return whole.submesh(np.arange(len(whole.faces)))


def _outside_the_neck(mesh: TriMesh, loop: Floats) -> Bools:
    """(F,): the faces of a surface with two rims that are no part of the bridge or tunnel between them.

    Rings of faces go, one after the other at each rim, until the next rim would be `FLARE` times as wide as the loop,
    would not be a simple loop, or too much would be gone.
    """
    beyond = _neighbours(mesh)
    kept = np.ones(len(mesh.faces), np.bool_)
    one, two = _rims(mesh.half_edges[(beyond < 0).ravel()])
    for rim, other in ((one, two), (two, one)):
        left = MOST_REMOVED / 2 * float(mesh.areas.sum())
        here = rim
        while True:
            ring = np.flatnonzero(kept & np.isin(mesh.faces, here).any(axis=1))
            left -= float(mesh.areas[ring].sum())
            far = _far_rim(mesh, ring, beyond, kept)
            if far is None or left < 0 or _spread(mesh.vertices[far]) > FLARE * _spread(loop):
                break
            if np.isin(mesh.faces[ring], other).any():
                break
            kept[ring], here = False, far
    return kept


def _far_rim(mesh: TriMesh, ring: Ints, beyond: Ints, kept: Bools) -> Ints | None:
    """The other rim of the faces around a rim; None where they are no annulus."""
    inner = np.zeros(len(mesh.faces), np.bool_)
    inner[ring] = True
    across = beyond[ring]
    far = (across >= 0) & kept[across] & ~inner[across]
    rims = _rims(mesh.half_edges.reshape(-1, 3, 2)[ring][far])
    return rims[0] if len(rims) == 1 and mesh.submesh(ring).euler_characteristic == 0 else None


def _neighbours(mesh: TriMesh) -> Ints:
    """(F, 3): the face beyond each side; -1 at a rim."""
    edge = mesh.face_edges.ravel()
    order = np.argsort(edge, kind="stable")
    pairs = np.flatnonzero(edge[order][1:] == edge[order][:-1])
    one, two = order[pairs], order[pairs + 1]
    beyond = np.full(len(edge), -1, np.int64)
    beyond[one], beyond[two] = two // 3, one // 3
    return beyond.reshape(-1, 3)


def _rims(half_edges: Ints) -> list[Ints]:
    """The simple loops, as vertices in order, that half-edges (n, 2) join up to; none where one is not simple."""
    following = {int(a): int(b) for a, b in half_edges}
    if len(following) < len(half_edges) or set(following) != set(following.values()):
        return []
    rims: list[Ints] = []
    while following:
        v, b = following.popitem()
        rim = [v]
        while b != v:
            rim.append(b)
            b = following.pop(b)
        rims.append(np.array(rim, np.int64))
    return rims


def _spread(places: Floats) -> float:
    """Root mean square distance from the middle: how wide a loop is, whether or not it zigzags."""
    return float(np.sqrt(((places - places.mean(axis=0)) ** 2).sum(axis=1).mean()))


def _capped(mesh: TriMesh) -> TriMesh:
    """Every rim closed by a fan of triangles around its middle; these faces come last."""
    vertices, faces = [mesh.vertices], [mesh.faces]
    for number, rim in enumerate(_rims(mesh.half_edges[(_neighbours(mesh) < 0).ravel()])):
        vertices.append(mesh.vertices[rim].mean(axis=0, keepdims=True))
        faces.append(np.column_stack([np.roll(rim, -1), rim, np.full(len(rim), len(mesh.vertices) + number)]))
    return TriMesh(np.concatenate(vertices), np.concatenate(faces))


def _cuts(mesh: TriMesh, caps: Ints) -> bool:
    """Do any of the faces `caps` cut or touch others?"""
    low, high = mesh.corners.min(axis=1), mesh.corners.max(axis=1)
    near = (high >= low[caps].min(axis=0)).all(axis=1) & (low <= high[caps].max(axis=0)).all(axis=1)
    chosen = np.flatnonzero(near)
    return bool(np.isin(chosen[self_intersections(mesh.submesh(chosen))], caps).any())
