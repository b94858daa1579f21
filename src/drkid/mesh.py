"""TriMesh: immutable arrays and the topology derived from them (cached), nothing else."""

from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
Scalar = TypeVar("Scalar", bound=np.generic)
_TOPOLOGY = (
    *("half_edges", "_edges_and_sides", "edge_faces", "valence", "open_edges", "misoriented_edges"),
    *("pinched_vertices", "is_closed_manifold", "face_component", "used_vertices", "euler_characteristic"),
)


def read_only(array: NDArray[Scalar]) -> NDArray[Scalar]:
    """The same array, which nobody can write to any more."""
    array.setflags(write=False)
    return array


@dataclass(frozen=True, eq=False)
class TriMesh:
    """A triangle mesh: `vertices` (V, 3) float64, `faces` (F, 3) int64, counter-clockwise seen from outside."""

    vertices: Floats
    faces: Ints

    def __post_init__(self) -> None:
        """Copy to contiguous read-only arrays of the right shape.

        Raises:
            ValueError: an array is not (n, 3), or a face names a vertex that does not exist.
        """
        vertices = np.array(self.vertices, np.float64, order="C")
        faces = np.array(self.faces, np.int64, order="C")
        for name, array in (("vertices", vertices), ("faces", faces)):
            if array.ndim != 2 or array.shape[1] != 3:
                message = f"{name} must be an (n, 3) array, not {array.shape}"
                raise ValueError(message)
        if faces.size and (faces.min() < 0 or faces.max() >= len(vertices)):
            message = f"faces name vertices {faces.min()} to {faces.max()}, there are {len(vertices)}"
            raise ValueError(message)
        object.__setattr__(self, "vertices", read_only(vertices))
        object.__setattr__(self, "faces", read_only(faces))

    # ---- geometry

    @cached_property
    def corners(self) -> Floats:
        """(F, 3, 3): the corners of each face."""
        return read_only(self.vertices[self.faces])

    @cached_property
    def middles(self) -> Floats:
        """(F, 3): the centroid of each face."""
        return read_only(self.corners.mean(axis=1))

    @cached_property
    def _cross(self) -> Floats:
        a, b, c = np.moveaxis(self.corners, 1, 0)
        return read_only(np.cross(b - a, c - a))

    @cached_property
    def areas(self) -> Floats:
        """(F,): area of each face."""
        return read_only(np.linalg.norm(self._cross, axis=1) / 2)

    @cached_property
    def face_normals(self) -> Floats:
        """(F, 3): unit normals; zero where a face has no area."""
        length = np.linalg.norm(self._cross, axis=1, keepdims=True)
        return read_only(np.divide(self._cross, length, out=np.zeros_like(self._cross), where=length > 0))

    @cached_property
    def vertex_normals(self) -> Floats:
        """(V, 3): unit mean of the adjacent faces' unit normals (the paper, section Thickening)."""
        total = summed(self.faces.T.ravel(), np.tile(self.face_normals, (3, 1)), len(self.vertices))
        length = np.linalg.norm(total, axis=1, keepdims=True)
        return read_only(np.divide(total, length, out=np.zeros_like(total), where=length > 0))

    @cached_property
    def volume(self) -> float:
        """Signed enclosed volume: positive where the faces look outwards."""
        a, b, c = np.moveaxis(self.corners - self.vertices.mean(axis=0), 1, 0)
        return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)

    @cached_property
    def extents(self) -> Floats:
        """(3,): side lengths of the axis-aligned bounding box."""
        return read_only(np.ptp(self.vertices, axis=0))

    @property
    def diagonal(self) -> float:
        """Diagonal of the axis-aligned bounding box."""
        return float(np.linalg.norm(self.extents))

    @cached_property
    def side_lengths(self) -> Floats:
        """(F, 3): side i of a face runs from its corner i to its corner i + 1."""
        return read_only(np.linalg.norm(np.roll(self.corners, -1, axis=1) - self.corners, axis=2))

    @cached_property
    def edge_lengths(self) -> Floats:
        """(E,): length of each edge."""
        ends = self.vertices[self.edges]
        return read_only(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))

    @property
    def mean_edge(self) -> float:
        """Mean edge length, each edge counted once."""
        return float(self.edge_lengths.mean())

    # ---- topology

    @cached_property
    def half_edges(self) -> Ints:
        """(3F, 2), face by face: half-edge 3f + i is side i of face f."""
        return read_only(np.stack([self.faces, np.roll(self.faces, -1, axis=1)], axis=2).reshape(-1, 2))

    @cached_property
    def _edges_and_sides(self) -> tuple[Ints, Ints, Ints]:
        one, other = self.half_edges.T
        low, high = np.minimum(one, other), np.maximum(one, other)  # of two arrays: an axis of length two is slow
        count = max(len(self.vertices), 1)
        keys = low * count + high  # one number sorts faster than two
        order = _order(keys)
        keys = keys[order]
        first = np.ones(len(keys), np.bool_)
        first[1:] = keys[1:] != keys[:-1]
        index = np.empty(len(keys), np.int64)
        index[order] = np.cumsum(first) - 1
        edges = np.column_stack(np.divmod(keys[first], count))
        return read_only(edges), read_only(index.reshape(-1, 3)), read_only(order)

    @property
    def edges(self) -> Ints:
        """(E, 2): each undirected edge once, lower vertex first, in ascending order."""
        return self._edges_and_sides[0]

    @property
    def face_edges(self) -> Ints:
        """(F, 3): the edge at each side of a face."""
        return self._edges_and_sides[1]

    @property
    def sides_by_edge(self) -> Ints:
        """(3F,): the sides of all faces, 3f + i, in the order of their edges; those of one edge in ascending order."""
        return self._edges_and_sides[2]

    @cached_property
    def edge_faces(self) -> Ints:
        """(E, 2): the two faces of each edge; the first runs through it from lower to higher vertex.

        Raises:
            ValueError: the mesh is not closed, manifold and consistently oriented.
        """
        if not self.is_closed_manifold:
            message = "edge_faces needs a closed, manifold, consistently oriented mesh"
            raise ValueError(message)
        forward = self.half_edges[:, 0] < self.half_edges[:, 1]
        owner, edge = np.repeat(np.arange(len(self.faces)), 3), self.face_edges.ravel()
        pairs = np.empty((len(self.edges), 2), np.int64)
        pairs[edge[forward], 0] = owner[forward]
        pairs[edge[~forward], 1] = owner[~forward]
        return read_only(pairs)

    @cached_property
    def valence(self) -> Ints:
        """(V,): number of edges at each vertex."""
        return read_only(np.bincount(self.edges.ravel(), minlength=len(self.vertices)).astype(np.int64))

    @cached_property
    def open_edges(self) -> int:
        """Number of edges that have not exactly two faces."""
        return int((np.bincount(self.face_edges.ravel()) != 2).sum()) if len(self.faces) else 0

    @cached_property
    def misoriented_edges(self) -> int:
        """Number of two-faced edges through which both faces run in the same direction."""
        edge = self.face_edges.ravel()
        upward = np.bincount(edge[self.half_edges[:, 0] < self.half_edges[:, 1]], minlength=len(self.edges))
        return int(((np.bincount(edge, minlength=len(self.edges)) == 2) & (upward != 1)).sum())

    @cached_property
    def pinched_vertices(self) -> int:
        """Number of surplus fans: vertices around which the faces do not form one cycle."""
        sides = np.arange(3 * len(self.faces)).reshape(-1, 3)
        order = self.sides_by_edge
        edge = self.face_edges.ravel()[order]
        same = np.flatnonzero(edge[1:] == edge[:-1])
        one, two = order[same], order[same + 1]
        following = np.roll(sides, -1, axis=1).ravel()
        opposed = self.half_edges[one, 0] == self.half_edges[two, 1]
        one, two = one[opposed], two[opposed]
        fans = _component_count(
            sides.size, np.concatenate([one, following[one]]), np.concatenate([following[two], two])
        )
        return max(0, fans - self.used_vertices)

    @cached_property
    def is_closed_manifold(self) -> bool:
        """Every edge has two faces that run through it in opposite directions, every vertex one fan."""
        return (
            len(self.faces) > 0 and self.open_edges == 0 and self.misoriented_edges == 0 and self.pinched_vertices == 0
        )

    @cached_property
    def face_component(self) -> Ints:
        """(F,): number of the edge-connected component that each face belongs to."""
        owner = np.repeat(np.arange(len(self.faces)), 3)
        order = self.sides_by_edge
        edge, owner = self.face_edges.ravel()[order], owner[order]
        same = edge[1:] == edge[:-1]
        graph = coo_array(
            (np.ones(same.sum()), (owner[:-1][same], owner[1:][same])), shape=(len(self.faces), len(self.faces))
        )
        return read_only(connected_components(graph, directed=False)[1].astype(np.int64))

    @property
    def component_count(self) -> int:
        """Number of edge-connected components."""
        return int(self.face_component.max(initial=-1)) + 1

    @cached_property
    def used_vertices(self) -> int:
        """Number of vertices that some face has."""
        return int(np.count_nonzero(np.bincount(self.faces.ravel(), minlength=len(self.vertices))))

    @cached_property
    def euler_characteristic(self) -> int:
        """V − E + F over the vertices that are used."""
        return self.used_vertices - len(self.edges) + len(self.faces)

    @property
    def genus(self) -> int:
        """Total number of handles of a closed orientable surface."""
        return self.component_count - self.euler_characteristic // 2

    # ---- new meshes

    def moved(self, vertices: ArrayLike) -> "TriMesh":
        """The same faces with other vertex positions (V, 3); what is known of their topology already is kept."""
        mesh = TriMesh(np.asarray(vertices, np.float64), self.faces)
        if len(mesh.vertices) == len(self.vertices):
            vars(mesh).update({name: self.__dict__[name] for name in _TOPOLOGY if name in self.__dict__})
        return mesh

    def scaled(self, factor: float) -> "TriMesh":
        """All coordinates times `factor`."""
        return self.moved(self.vertices * factor)

    def flipped(self) -> "TriMesh":
        """The same surface seen from the other side."""
        return TriMesh(self.vertices, self.faces[:, ::-1])

    def submesh(self, keep: Bools | Ints) -> "TriMesh":
        """The chosen faces (mask or indices) and only the vertices that they use."""
        used, faces = np.unique(self.faces[keep], return_inverse=True)
        return TriMesh(self.vertices[used], faces.reshape(-1, 3).astype(np.int64))


def _component_count(nodes: int, a: Ints, b: Ints) -> int:
    graph = coo_array((np.ones(len(a)), (a, b)), shape=(nodes, nodes))
    return int(connected_components(graph, directed=False)[0])


def summed(index: Ints, values: Floats, count: int) -> Floats:
    """(count, d): the sums of the `values` (n, d) of each `index` (n,), added in the order given."""
    return np.column_stack([np.asarray(np.bincount(index, column, count), np.float64) for column in values.T])


def _order(keys: Ints) -> Ints:
    """The stable order that sorts `keys`, not negative: with its place behind it, a key is a number like others."""
    bits = len(keys).bit_length()
    if int(keys.max(initial=0)).bit_length() + bits > 63:
        return np.argsort(keys, kind="stable")
    places = np.arange(len(keys))
    return np.sort((keys << bits) | places) & ((1 << bits) - 1)


def rounded(mesh: TriMesh) -> TriMesh:
    """The mesh with coordinates as STL and 3MF store them, without the triangles that lose a corner by that."""
    single = np.asarray(mesh.vertices.astype(np.float32) + np.float32(0), np.float64)
    return coinciding_joined(single, mesh.faces)


def coinciding_joined(vertices: Floats, faces: Ints) -> TriMesh:
    """The mesh with equal vertices (V, 3) made one, without the triangles that lose a corner by that."""
    places, index = np.unique(vertices, axis=0, return_inverse=True)
    named = index.ravel()[faces]
    return TriMesh(places, named[(named != np.roll(named, 1, axis=1)).all(axis=1)])
