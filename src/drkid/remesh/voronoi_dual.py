"""The dual triangulation of a Voronoi diagram on a surface, and the cells in which it is no surface.

Edelsbrunner and Shah, "Triangulating topological spaces" (1997): the dual is the surface's twin where every cell, and
every meeting of cells, is one disk (the closed ball property). Where a cell is not, seeds are missing.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from drkid.measure import bend_radians
from drkid.mesh import Floats, Ints, TriMesh
from drkid.remesh.centroidal_voronoi import tessellate
from drkid.remesh.closest_point import ClosestPoint

MOST_BEND_DEGREES = 100.0  # between the normals of neighbours, beyond which the dual is too coarse for the surface
MOST_GROWTH = 4  # times the seeds asked for may be used to undo folds


def dual(closest: ClosestPoint, seeds: Floats) -> TriMesh | None:
    """The dual of the seeds' restricted Voronoi diagram, its vertices on the surface; None where it is not its twin.

    It is where it is closed, manifold, oriented outward, in one piece, of the surface's genus, and uses every seed.
    """
    triangles = tessellate(closest.surface, seeds).triangles
    mesh = TriMesh(closest(seeds)[0], triangles)
    return mesh if len(np.unique(triangles)) == len(seeds) and is_twin(mesh, closest.surface) else None


def is_twin(mesh: TriMesh, surface: TriMesh) -> bool:
    """Is the mesh a closed manifold, oriented outward, in one piece, of the surface's genus?"""
    return mesh.is_closed_manifold and mesh.component_count == 1 and mesh.genus == surface.genus and mesh.volume > 0


@dataclass(frozen=True, eq=False)
class Nerve:
    """The dual `triangles` (T, 3) of cells of a mesh's vertices; `broken` are the cells that are to blame."""

    triangles: Ints
    broken: Ints


def nerve(surface: TriMesh, cell: Ints) -> Nerve:
    """The dual of a partition of the surface's vertices, `cell` (V,), in numbers from 0 up, each used.

    A face whose corners lie in three cells is a dual triangle. Without broken cells these make the surface's twin:
    each cell is connected and of Euler characteristic 1, so a disk; each two meet in one strip of faces; no three
    meet twice.
    """
    count = int(cell.max()) + 1
    ends, corners = cell[surface.edges], cell[surface.faces]
    inside = ends[:, 0] == ends[:, 1]
    same = (corners == np.roll(corners, -1, axis=1)).sum(axis=1)  # equal sides of a face: 3 in one cell, 1 in two
    euler = _tally(cell, count) - _tally(ends[inside, 0], count) + _tally(corners[same == 3, 0], count)
    inner = surface.edges[inside]
    graph = coo_array((np.ones(len(inner)), (inner[:, 0], inner[:, 1])), shape=(len(cell), len(cell)))
    piece = connected_components(graph, directed=False)[1]
    pieces = _tally(cell[np.unique(piece, return_index=True)[1]], count)

    # A strip of faces between two cells that does not close has one edge across more than faces.
    between = np.column_stack([corners[same == 1].min(axis=1), corners[same == 1].max(axis=1)])
    met, which = np.unique(np.concatenate([np.sort(ends[~inside], axis=1), between]), axis=0, return_inverse=True)
    across = (~inside).sum()
    strips = _tally(which.ravel()[:across], len(met)) - _tally(which.ravel()[across:], len(met))
    triangles = corners[same == 0]
    three, times = np.unique(np.sort(triangles, axis=1), axis=0, return_counts=True)
    alone = np.flatnonzero((euler != 1) | (pieces != 1))
    return Nerve(triangles, np.unique(np.concatenate([alone, met[strips != 1].ravel(), three[times > 1].ravel()])))


def _tally(numbers: Ints, count: int) -> Ints:
    return np.bincount(numbers, minlength=count).astype(np.int64)


def refined_dual(surface: TriMesh, seeds: Floats) -> TriMesh:
    """A right dual of the seeds and of more, inserted at the far end of each broken cell until none is.

    The cells are of the surface's vertices, and so are the seeds after moving each to the nearest one. Cells whose dual
    triangles fold count as broken too, up to `MOST_GROWTH` times the seeds. It ends at the latest with the surface.
    """
    chosen = np.unique(cKDTree(surface.vertices).query(seeds)[1])
    while True:
        away, cell = cKDTree(surface.vertices[chosen]).query(surface.vertices)
        found = nerve(surface, np.asarray(cell, np.int64))
        broken, twin = found.broken, TriMesh(surface.vertices[chosen], found.triangles)
        if not len(broken) and len(chosen) <= MOST_GROWTH * len(seeds):
            broken = _folded(twin)
        if not len(broken):
            return twin
        order = np.lexsort((-np.asarray(away), cell))  # by cell, the farthest first
        farthest = order[np.unique(np.asarray(cell)[order], return_index=True)[1]][broken]
        more = np.union1d(chosen, farthest)
        if len(more) == len(chosen):  # every broken cell is a single vertex: a fold of the surface itself
            return twin if not len(found.broken) else surface
        chosen = more


def _folded(mesh: TriMesh) -> Ints:
    """The vertices of the faces that are folded against a neighbour."""
    faces = mesh.edge_faces[np.degrees(np.abs(bend_radians(mesh))) > MOST_BEND_DEGREES]
    return np.unique(mesh.faces[faces.ravel()])
