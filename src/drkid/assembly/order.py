"""Order of building: a shell that grows with a short border and is closed by a piece that goes in from outside."""

import heapq
from collections import deque

import numpy as np

from drkid.kit import Step
from drkid.mesh import Floats, TriMesh

SAME_BEND = 1e-6  # radians: bends that differ by less are equal, so that rounding does not choose


def steps(mesh: TriMesh, bend_radians: Floats) -> tuple[Step, ...]:
    """Every face once, each after the first beside one that stands; `joins` are all its neighbours that stand.

    The last is the face whose least convex joint (E,) is the most convex: its neighbours do not lean over it, so it
    can be put in along its normal. Building begins as far from it as possible; next comes the face with the most
    standing neighbours, of those the one whose corners lack the fewest other faces, and the longest waiting.
    """
    neighbours = _neighbours(mesh)
    last = _most_convex(mesh, bend_radians)
    order = _grown(mesh, neighbours, _farthest(neighbours, last), last)
    rank = {face: i for i, face in enumerate(order)}
    return tuple(
        Step(face, tuple(sorted({int(n) for n in neighbours[face] if rank[int(n)] < i})))
        for i, face in enumerate(order)
    )


def _neighbours(mesh: TriMesh) -> list[list[int]]:
    pairs = mesh.edge_faces[mesh.face_edges]
    own = np.arange(len(mesh.faces))[:, None]
    return np.where(pairs[..., 0] == own, pairs[..., 1], pairs[..., 0]).tolist()


def _most_convex(mesh: TriMesh, bend_radians: Floats) -> int:
    least = np.round(bend_radians[mesh.face_edges].min(axis=1) / SAME_BEND)
    return int(np.argmax(least))


def _farthest(neighbours: list[list[int]], start: int) -> int:
    """The face that breadth-first search from `start` meets last."""
    seen, queue, face = {start}, deque([start]), start
    while queue:
        face = queue.popleft()
        fresh = [n for n in neighbours[face] if n not in seen]
        seen.update(fresh)
        queue.extend(fresh)
    return face


def _grown(mesh: TriMesh, neighbours: list[list[int]], first: int, last: int) -> list[int]:
    """Greedy growth by a priority queue; entries that have been overtaken are passed over."""
    corners, around = mesh.faces.tolist(), _faces_at(mesh)
    missing = mesh.valence.tolist()
    standing: dict[int, None] = {}
    waiting = {first: 0}

    def entry(face: int) -> tuple[bool, int, int, int, int]:
        beside = sum(n in standing for n in neighbours[face])
        return face == last, -beside, min(missing[v] for v in corners[face]), waiting[face], face

    queue = [entry(first)]
    while queue:
        current = heapq.heappop(queue)
        face = current[-1]
        if face in standing or current != entry(face):
            continue
        standing[face] = None
        for vertex in corners[face]:
            missing[vertex] -= 1
        for n in neighbours[face]:
            waiting.setdefault(n, len(waiting))
        for n in {n for vertex in corners[face] for n in around[vertex]}:
            if n in waiting and n not in standing:
                heapq.heappush(queue, entry(n))
    return list(standing)


def _faces_at(mesh: TriMesh) -> list[list[int]]:
    around: list[list[int]] = [[] for _ in mesh.vertices]
    for face, corners in enumerate(mesh.faces.tolist()):
        for vertex in corners:
            around[vertex].append(face)
    return around
