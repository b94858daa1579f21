"""The shortest loop along a surface's edges that does not part it: around a handle, or through a tunnel.

A tree and a cotree leave 2g edges over, and each of them closes a curve through faces; the curves span the homology
(Eppstein, "Dynamic generators of topologically embedded graphs", SODA 2003). A loop that crosses one of them an odd
number of times does not part the surface, and one that does not part it crosses some curve so. The shortest through a
vertex is the shortest path between the vertex's two copies in the curve's double cover (Erickson, "Combinatorial
optimization of cycles and bases", 2012, section 3).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from heapq import heappop, heappush
from typing import Any

import numpy as np
from numba import njit
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order

from drkid.mesh import Bools, Floats, Ints, TriMesh

Index = Any  # a number out of an array of them, which numpy's stubs take for an array
SLACK = 0.02  # of its length, by which a loop may be too long: starts of the search so near to one another are one


@njit(cache=True)
def _straight(vertices: Floats, v: Index, w: Index) -> float:
    squared = 0.0
    for d in range(3):
        squared += (vertices[w, d] - vertices[v, d]) ** 2
    return float(np.sqrt(squared))


@njit(cache=True)
def _odd_path(
    graph: tuple[Ints, Ints, Ints, Floats],
    vertices: Floats,
    crossed: Bools,
    base: int,
    limit: float,
    memory: tuple[Floats, Ints],
) -> float:
    # A*, by the straight distance to the base, from its one copy to the other; the length, or infinity where it is not
    # below the limit. State 2 v + side; memory: the distance of each state and the state before it, clean again after
    # a search that found nothing.
    first, neighbour, edge, length = graph
    distance, before = memory
    heap = [(0.0, 2 * base)]
    touched = [2 * base]
    distance[2 * base] = 0.0
    found = np.inf
    while heap:
        bound, state = heappop(heap)
        if bound >= limit or state == 2 * base + 1:
            found = bound if bound < limit else np.inf
            break
        v, side = state // 2, state % 2
        for k in range(first[v], first[v + 1]):
            w = neighbour[k]
            there = 2 * w + (side ^ crossed[edge[k]])
            reached = distance[state] + length[edge[k]]
            if reached >= distance[there]:
                continue
            if reached + _straight(vertices, base, w) < limit:
                touched.append(there)
                distance[there] = reached
                before[there] = state
                heappush(heap, (reached + _straight(vertices, base, w), there))
    for state in touched:
        distance[state] = np.inf
    return found


@dataclass(frozen=True, eq=False)
class _Search:
    """A closed, connected surface with the graph of its edges."""

    mesh: TriMesh

    @cached_property
    def graph(self) -> tuple[Ints, Ints, Ints, Floats]:
        """For each vertex the range of its neighbours, those, the edges to them; and the edges' lengths."""
        a, b = self.mesh.edges.T
        ends, others = np.concatenate([a, b]), np.concatenate([b, a])
        order = np.argsort(ends, kind="stable")
        first = np.concatenate([[0], np.cumsum(np.bincount(ends, minlength=len(self.mesh.vertices)))])
        return first, others[order], order % len(a), self.mesh.edge_lengths.copy()

    def curves(self) -> list[Ints]:
        """2g closed curves through faces, each the edges that it crosses, in its order."""
        mesh = self.mesh
        faces, crossed = _spanning_tree(mesh.edge_faces, np.arange(len(mesh.edges)), len(mesh.faces))
        rest = np.setdiff1d(np.arange(len(mesh.edges)), crossed)
        _, along = _spanning_tree(mesh.edges, rest, len(mesh.vertices))
        return [self._closed(edge, faces, crossed) for edge in np.setdiff1d(rest, along)]

    def _closed(self, edge: int, before: Ints, crossed: Ints) -> Ints:
        one, two = (_way_to_root(face, before, crossed) for face in self.mesh.edge_faces[edge])
        while one and two and one[-1] == two[-1]:
            one.pop()
            two.pop()
        return np.array([edge, *two, *one[::-1]], np.int64)

    def shortest(self, curve: Ints, limit: float) -> tuple[float, Ints]:
        """The shortest loop, below the limit, that crosses the curve an odd number of times; (limit, none) if none."""
        crossed = np.zeros(len(self.mesh.edges), np.bool_)
        crossed[curve] = True
        states = 2 * len(self.mesh.vertices)
        memory = np.full(states, np.inf), np.full(states, -1, np.int64)
        loop, since, last = np.empty(0, np.int64), np.inf, -1
        for base in self.mesh.edges[curve, 0]:  # a loop that crosses the curve goes through one of these
            since += 0.0 if last < 0 else float(np.linalg.norm(self.mesh.vertices[base] - self.mesh.vertices[last]))
            last = base
            if 2 * since < SLACK * limit:
                continue
            since = 0.0
            found = _odd_path(self.graph, self.mesh.vertices, crossed, base, limit, memory)
            if found < limit:
                loop = self._simple(_path(memory[1], base), crossed)
                limit = self.length(loop)
        return limit, loop

    def length(self, loop: Ints) -> float:
        """Of a closed loop of vertices."""
        places = self.mesh.vertices[loop]
        return float(np.linalg.norm(np.roll(places, -1, axis=0) - places, axis=1).sum())

    def _simple(self, loop: Ints, crossed: Bools) -> Ints:
        """The loop without repeated vertices and without chords: of each two halves the one that crosses oddly."""
        while True:
            split = self._split(loop)
            if split is None:
                return loop
            i, j = split
            end = int(loop[i] != loop[j])  # of a chord both halves keep both ends
            inner, outer = loop[i : j + end], np.concatenate([loop[j:], loop[: i + end]])
            loop = inner if self._is_odd(inner, crossed) else outer

    def _split(self, loop: Ints) -> tuple[int, int] | None:
        """Two places of a loop at which it is in the same vertex, or in two that an edge joins; None where not."""
        first, neighbour, _, _ = self.graph
        at, last = {int(v): i for i, v in enumerate(loop)}, len(loop) - 1
        for i, v in enumerate(loop):
            for w in (v, *neighbour[first[v] : first[v + 1]]):
                j = at.get(int(w), i)
                if j > i + (w != v) and (i, j) != (0, last * (w != v)):
                    return i, j
        return None

    def _is_odd(self, loop: Ints, crossed: Bools) -> bool:
        first, neighbour, edge, _ = self.graph
        total = 0
        for v, w in zip(loop, np.roll(loop, -1), strict=True):
            here = slice(first[v], first[v + 1])
            total += int(crossed[edge[here][neighbour[here] == w]].sum())
        return total % 2 == 1


def shortest_loops(mesh: TriMesh) -> Iterator[tuple[float, Ints]]:
    """Loops that do not part a closed, connected surface, with their lengths: the shortest, then others by length.

    Each is simple, has no chord, and is given by its vertices in order; lengths are right within a few percent. There
    is none on a sphere.
    """
    search = _Search(mesh)
    curves = search.curves()
    best, loop = np.inf, np.empty(0, np.int64)
    for curve in curves:
        length, found = search.shortest(curve, best)
        best, loop = (length, found) if len(found) else (best, loop)
    if len(loop):
        yield best, loop
        yield from sorted((search.shortest(curve, np.inf) for curve in curves), key=lambda found: found[0])


def _path(before: Ints, base: int) -> Ints:
    """The vertices of a search's way from a base's one copy to the other, each state's predecessor given."""
    states = [2 * base + 1]
    while states[-1] != 2 * base:
        states.append(int(before[states[-1]]))
    return np.array(states[:0:-1], np.int64) // 2


def _spanning_tree(links: Ints, chosen: Ints, count: int) -> tuple[Ints, Ints]:
    """Breadth first from node 0, by the chosen of the `links` (n, 2): each node's predecessor, and the link to it.

    Both are -1 for the root.
    """
    a, b = links[chosen].T
    number = np.concatenate([chosen, chosen]) + 1
    graph = coo_array((number, (np.concatenate([a, b]), np.concatenate([b, a]))), shape=(count, count)).tocsr()
    before = np.asarray(breadth_first_order(graph, 0, directed=False)[1], np.int64)
    before[0] = 0
    link = np.asarray(graph[np.arange(count), before]).ravel().astype(np.int64) - 1
    before[0] = -1
    return before, link


def _way_to_root(face: int, before: Ints, crossed: Ints) -> list[int]:
    way: list[int] = []
    while before[face] >= 0:
        way.append(int(crossed[face]))
        face = before[face]
    return way
