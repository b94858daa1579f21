"""Patches: the quadratic model of a piece of the mesh with everything outside it frozen.

A patch has a core, whose edges may take other labels and be flipped, and around it more vertices that answer by moving.
Its Hessian is the block of the whole mesh's Hessian at the moving vertices, so that a patch costs the same whatever
the size of the mesh (block coordinate descent; Bertsekas 2016, section 3.7). The moving sets of one packing are
disjoint: no face can then be touched by two patches, and they may be annealed at the same time.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_array

from drkid.congruence.annealing import Schedule, anneal
from drkid.congruence.framework import Framework, framework_of
from drkid.congruence.quadratic_model import Connectivity, QuadraticModel
from drkid.congruence.rigidity import edge_vectors
from drkid.congruence.sparse_solve import SparseLinearisation
from drkid.mesh import Bools, Floats, Ints, TriMesh

FLIP_SHARE = 0.3


@dataclass(frozen=True, eq=False)
class Patch:
    """Vertices `moving` (m,), of which the first `core` are those between which edges may change."""

    moving: Ints
    core: int


@dataclass(frozen=True, eq=False)
class LocalModel:
    """A patch's connectivity, model and labels in its own numbers, with the numbers of its rows in the whole mesh.

    Local vertex m stands for everything that is frozen. `vertices` (m,), `faces` and `edges` are the whole mesh's
    numbers of the local ones; `free` says which local edges may change.
    """

    net: Connectivity
    model: QuadraticModel
    labels: Ints
    free: Bools
    vertices: Ints
    faces: Ints
    edges: Ints


def neighbours(mesh: TriMesh) -> list[list[int]]:
    """Of each vertex, those joined to it."""
    around: list[list[int]] = [[] for _ in mesh.vertices]
    for a, b in mesh.edges.tolist():
        around[a].append(b)
        around[b].append(a)
    return around


def ball(around: list[list[int]], centre: int, count: int, closed: set[int]) -> list[int]:
    """The `count` vertices nearest to the centre along edges, breadth first, without going through `closed` ones."""
    seen, queue = {centre}, [centre]
    for vertex in queue:
        for other in around[vertex]:
            if len(queue) >= count:
                return queue
            if other not in seen and other not in closed:
                seen.add(other)
                queue.append(other)
    return queue


def packing(mesh: TriMesh, core: int, moving: int, visits: Ints, rng: np.random.Generator) -> list[Patch]:
    """Disjoint patches around the least visited vertices (V,) first, as many as find room for a whole core."""
    around, taken, patches = neighbours(mesh), set[int](), list[Patch]()
    for centre in np.argsort(visits + rng.random(len(visits)), kind="stable").tolist():
        if centre in taken:
            continue
        inside = ball(around, centre, moving, taken)
        if len(inside) >= min(core, len(visits)):
            patches.append(Patch(np.array(inside, np.int64), core))
            taken.update(inside)
    return patches


def local_model(frame: Framework, at: SparseLinearisation, patch: Patch, damping: float) -> LocalModel:
    """The model of `quadratic_model`, at a framework linearised sparsely, with only the patch's vertices moving.

    Raises:
        numpy.linalg.LinAlgError: the patch is degenerate.
    """
    mesh, count = frame.mesh, len(patch.moving)
    number = np.full(len(mesh.vertices), count, np.int64)
    number[patch.moving] = np.arange(count)
    edges = np.flatnonzero((number[mesh.edges] < count).any(axis=1))
    faces = np.flatnonzero((number[mesh.faces] < count).sum(axis=1) >= 2)
    return LocalModel(
        _connectivity(mesh, number, faces, edges, count),
        _model(frame, at, patch, edges, damping),
        frame.labels[edges],
        np.asarray((number[mesh.edges[edges]] < patch.core).all(axis=1), np.bool_),
        patch.moving,
        faces,
        edges,
    )


def _connectivity(mesh: TriMesh, number: Ints, faces: Ints, edges: Ints, count: int) -> Connectivity:
    edge_number, face_number = np.full(len(mesh.edges), -1), np.full(len(mesh.faces), -1)
    edge_number[edges], face_number[faces] = np.arange(len(edges)), np.arange(len(faces))
    ends, valence = number[mesh.edges[edges]], np.zeros(count + 1, np.int64)
    valence[number] = mesh.valence  # the frozen vertex gets one of theirs, and nobody asks for it
    joined = np.zeros((count + 1, count + 1), np.bool_)
    joined[ends[:, 0], ends[:, 1]] = joined[ends[:, 1], ends[:, 0]] = True
    return Connectivity(
        number[mesh.faces[faces]],
        edge_number[mesh.face_edges[faces]],
        ends,
        face_number[mesh.edge_faces[edges]],
        valence,
        joined,
    )


def _model(frame: Framework, at: SparseLinearisation, patch: Patch, edges: Ints, damping: float) -> QuadraticModel:
    freedoms = (3 * patch.moving[:, None] + np.arange(3)).ravel()
    size = len(freedoms)
    hessian = csc_array(at.hessian[:, freedoms])[freedoms].toarray()
    hessian[np.diag_indices_from(hessian)] += damping**2
    inverse = np.zeros((size + 3, size + 3))  # the last vertex is frozen: it answers to nothing
    inner = np.linalg.inv(hessian)
    inverse[:size, :size] = (inner + inner.T) / 2
    jacobian = csc_array(at.jacobian[edges])[:, freedoms].toarray()
    coupling = jacobian @ inverse[:size, :size] @ jacobian.T
    shift = -inverse[:, :size] @ at.gradient[freedoms]
    direction, length = edge_vectors(frame.mesh.vertices, frame.mesh.edges[edges])
    position = np.vstack([frame.mesh.vertices[patch.moving], np.zeros(3)])
    residual = -frame.residual[edges] - jacobian @ shift[:size]
    return QuadraticModel(
        inverse, np.ascontiguousarray((coupling + coupling.T) / 2), shift, residual, direction, length, position
    )


def annealed_patch(
    local: LocalModel, lengths: Floats, allowed: Bools, heat: float, steps_per_edge: int, rng: np.random.Generator
) -> LocalModel:
    """Anneal the patch in place, from `heat` typical prices on, and return it; the global interpreter lock is free."""
    active = np.flatnonzero(local.free)
    softness = 1 - np.diag(local.model.coupling)[active]
    temperature = heat * float(softness.mean() * (lengths[-1] - lengths[0]) ** 2)
    schedule = Schedule(temperature, steps_per_edge * len(active), FLIP_SHARE, active, local.free)
    anneal(local.net, local.model, local.labels, lengths, allowed, rng, schedule)
    return local


def put_back(frame: Framework, patches: list[LocalModel]) -> Framework:
    """The whole mesh with the patches' labels and flips; vertices stay where they are."""
    faces, edges, labels = frame.mesh.faces.copy(), frame.mesh.edges.copy(), frame.labels.copy()
    for local in patches:
        frozen = len(local.vertices)
        labels[local.edges] = local.labels
        for whole, rows, own in ((faces, local.faces, local.net.faces), (edges, local.edges, local.net.edges)):
            inside = (own < frozen).all(axis=1)  # nothing else can have been flipped
            whole[rows[inside]] = local.vertices[own[inside]]
    return framework_of(frame.mesh.vertices, faces, edges, labels, frame.lengths)
