"""Closed meshes whose triangles fall into few classes, exactly or nearly, and what is made of them."""

import numpy as np
import trimesh

from drkid.kit import Decomposition, Outcome
from drkid.mesh import Floats, TriMesh

TETRAHEDRON = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])


def icosahedron() -> TriMesh:
    solid = trimesh.creation.icosahedron()
    return TriMesh(solid.vertices, solid.faces)


def tetrahedron() -> TriMesh:
    return TriMesh(TETRAHEDRON, np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]))


def geodesic(divisions: int = 1) -> TriMesh:
    sphere = trimesh.creation.icosphere(subdivisions=divisions)
    return TriMesh(sphere.vertices, sphere.faces)


def sixths() -> TriMesh:
    """The octahedron's faces divided into six about their centres: 24 right and 24 left scalene faces of one class."""
    points: list[Floats] = []
    faces = []
    for x, y, z in np.array(np.meshgrid([1.0, -1.0], [1.0, -1.0], [1.0, -1.0])).T.reshape(-1, 3):
        face = np.diag([x, y, z])[:: 1 if x * y * z > 0 else -1]
        for i in range(3):
            a, b, centre = face[i], face[(i + 1) % 3], face.mean(axis=0)
            for triple in ((a, (a + b) / 2, centre), ((a + b) / 2, b, centre)):
                faces.append(range(len(points), len(points) + 3))
                points += [p / np.linalg.norm(p) for p in triple]
    unique, index = np.unique(np.round(points, 12), axis=0, return_inverse=True)
    return TriMesh(unique, index.reshape(-1)[np.array(faces)])


def potato(seed: int = 0, bump: float = 0.1) -> TriMesh:
    """A geodesic sphere, oblong and dented at random: no two faces alike, some joints concave."""
    rng = np.random.default_rng(seed)
    sphere = geodesic()
    radius = 1 + bump * rng.standard_normal((len(sphere.vertices), 1))
    return TriMesh(sphere.vertices * radius * [1.0, 1.1, 1.3], sphere.faces)


def decomposed(mesh: TriMesh, classes: int | None = None) -> Decomposition:
    """Faces classed by their exact lengths, or, where a number is given, in as many equal shares by their size."""
    sides = np.sort(mesh.side_lengths, axis=1)
    if classes is None:
        _, own = np.unique(np.round(sides / mesh.mean_edge, 6), axis=0, return_inverse=True)
    else:
        own = np.argsort(np.argsort(sides.sum(axis=1))) * classes // len(sides)
    own = own.reshape(-1).astype(np.int64)
    lengths = np.array([sides[own == k].mean(axis=0) for k in range(own.max() + 1)])
    errors = np.linalg.norm(sides - lengths[own], axis=1)
    return Decomposition(mesh, own, lengths, errors, 0, (), Outcome("converged", "as given"))
