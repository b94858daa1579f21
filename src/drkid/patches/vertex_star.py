"""Vertex stars: the triangles round a vertex merged into a pentagon, hexagon or heptagon, and parts of stars."""

from collections import Counter

import numpy as np

from drkid.mesh import Bools, Floats, Ints, TriMesh
from drkid.patches.identity import residuals, shapes
from drkid.patches.outline import WIDEST, corner_angles, outlined

FREE = -1  # owner of a face that is in no piece yet


def starred(mesh: TriMesh, size: int, tolerance: float) -> list[tuple[int, ...]]:
    """Disjoint stars of vertices of valence `size`, then the largest convex parts of stars, then what is left.

    Whole stars are chosen so that many have few neighbours in common with others and a shape that is frequent;
    smaller whole stars follow, then runs of triangles round a vertex, of `size` at most. None meets another on both
    sides of a corner in which there is no third piece: two pieces with two hinges could not turn.
    """
    fans = _fans(mesh)
    owner = np.full(len(mesh.faces), FREE)
    taken: list[tuple[int, ...]] = []
    for valence in range(size, 2, -1):
        for vertex in _apart(mesh, fans, owner == FREE, valence, tolerance):
            if _meets_two(mesh, fans, owner, fans[vertex]):
                owner[list(fans[vertex])] = len(taken)
                taken.append(fans[vertex])
    angles = corner_angles(mesh)
    while (run := _longest_run(mesh, fans, owner, angles, size)) is not None:
        owner[list(run)] = len(taken)
        taken.append(run)
    return [*taken, *((int(f),) for f in np.flatnonzero(owner == FREE))]


def _meets_two(mesh: TriMesh, fans: list[tuple[int, ...]], owner: Ints, piece: tuple[int, ...]) -> bool:
    """Whether two others at least meet a piece in each of its corners, be it that free faces stay apart there."""
    for vertex in np.unique(mesh.faces[list(piece)]).tolist():
        around = [int(owner[face]) for face in fans[vertex] if face not in piece]
        if around and len(set(around) - {FREE}) + around.count(FREE) < 2:
            return False
    return True


def _fans(mesh: TriMesh) -> list[tuple[int, ...]]:
    """The faces round each vertex, in order."""
    follow: list[dict[int, tuple[int, int]]] = [{} for _ in mesh.vertices]
    for face, corners in enumerate(mesh.faces.tolist()):
        for i in range(3):
            follow[corners[i]][corners[i - 2]] = (face, corners[i - 1])
    fans: list[tuple[int, ...]] = []
    for around in follow:
        at, fan = min(around), list[int]()
        for _ in around:
            face, at = around[at]
            fan.append(face)
        fans.append(tuple(fan))
    return fans


def _apart(mesh: TriMesh, fans: list[tuple[int, ...]], free: Bools, valence: int, tolerance: float) -> list[int]:
    """Vertices of a valence whose stars are free and share no face: fewest rivals first, then frequent shapes."""
    open_ = [v for v, fan in enumerate(fans) if len(fan) == valence and free[list(fan)].all()]
    open_ = [v for v in open_ if outlined(mesh, fans[v]).makes_a_piece(mesh)]
    if not open_:
        return []
    stands = shapes(residuals(mesh, [outlined(mesh, fans[v]) for v in open_])[0], tolerance)
    frequency = Counter(stands.tolist())
    popular = {v: frequency[int(s)] for v, s in zip(open_, stands, strict=True)}
    neighbours: dict[int, set[int]] = {v: set() for v in open_}
    for a, b in mesh.edges.tolist():
        if a in neighbours and b in neighbours:
            neighbours[a].add(b)
            neighbours[b].add(a)
    chosen: list[int] = []
    left = set(open_)
    while left:
        best = min(left, key=lambda v: (len(neighbours[v] & left), -popular[v], v))
        chosen.append(best)
        left -= {best} | neighbours[best]
    return chosen


def _longest_run(
    mesh: TriMesh, fans: list[tuple[int, ...]], owner: Ints, angles: Floats, size: int
) -> tuple[int, ...] | None:
    """The most free faces in a row round any vertex that make a convex piece; None where no two are left."""
    best: tuple[int, ...] = ()
    for vertex, fan in enumerate(fans):
        turn = {f: float(angles[f][mesh.faces[f] == vertex][0]) for f in fan}
        for start in range(len(fan)):
            run: list[int] = []
            angle = 0.0
            for f in (*fan[start:], *fan[:start]):
                angle += turn[f]
                if owner[f] != FREE or len(run) == size or angle > WIDEST:
                    break
                run.append(f)
            if (
                len(run) > max(len(best), 1)
                and outlined(mesh, tuple(run)).makes_a_piece(mesh)
                and _meets_two(mesh, fans, owner, tuple(run))
            ):
                best = tuple(run)
    return best if len(best) > 1 else None
