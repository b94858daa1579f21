"""Sizing field: how long edges are to be at each place of a surface, shorter where it bends more.

An edge of length h leaves a surface of curvature κ by the sagitta κ h²/8; h ∝ κ^(−1/2) makes that the same everywhere.
Cohen-Steiner and Morvan, "Restricted Delaunay triangulations and normal cycle" (SoCG 2003), for the curvature tensor;
Persson, "Mesh size functions for implicit geometries and PDE-based gradient limiting" (2006), for the gradation; Du
and Wang, "Grid generation and optimization based on centroidal Voronoi tessellations" (2003), for the density.
"""

from dataclasses import dataclass

import igl
import numpy as np
from scipy.sparse import coo_array, csr_array, diags_array
from scipy.sparse.csgraph import dijkstra
from scipy.sparse.linalg import cg

from drkid.measure import bend_radians
from drkid.mesh import Floats, TriMesh, summed
from drkid.remesh.closest_point import ClosestPoint

SMOOTHING_EDGES = 0.5  # edges over which curvature is averaged: what is smaller than an edge no edge can follow
CONTRAST = 4.0  # curvature counts as at least 1/4 and at most 4 times its mean: edges as at most 1 to 4
GRADATION = 0.3  # of the wanted length over the surface: more than that between neighbours makes slivers
BALANCES = 4  # rounds of the gradation and of the total number, each of which disturbs the other
PRECISION = 1e-10  # of the averaged tensors: rounding then does not show in the mesh


@dataclass(frozen=True, eq=False)
class SizingField:
    """`length` (V,): how long an edge is to be at each vertex of a surface; between them it is linear."""

    closest: ClosestPoint
    length: Floats

    def __call__(self, points: Floats) -> Floats:
        """(P,): the length wanted at the point of the surface that is closest to each of `points` (P, 3)."""
        surface = self.closest.surface
        _, face, weights = self.closest.in_faces(points)
        return np.einsum("ij,ij->i", weights, self.length[surface.faces[face]]) / weights.sum(axis=1)

    def density(self, points: Floats) -> Floats:
        """(P,): of the tessellation whose cells have the wanted size, length^(−4) in two dimensions."""
        return (np.sqrt((self.length**2).mean()) / self(points)) ** 4


def goals(mesh: TriMesh, sizing: SizingField | None) -> Floats:
    """(V,): the length that edges at each vertex are to have, an edge the mean of its two ends'.

    The mean over the edges is that of the mesh; without a sizing field it is the length of all.
    """
    if sizing is None:
        return np.full(len(mesh.vertices), mesh.mean_edge)
    wanted = sizing(mesh.vertices)
    return wanted * (mesh.mean_edge / wanted[mesh.edges].mean())


def sizing_field(surface: TriMesh, count: int, adapt: float) -> SizingField:
    """For meshes of `count` vertices: lengths ∝ κ^(−adapt / 2), smooth, and such that so many vertices realise them.

    Args:
        surface: closed and manifold, with several vertices for each of the mesh.
        count: vertices of the mesh.
        adapt: 0 for lengths that are all the same, 1 for the same sagitta everywhere.
    """
    mass = np.bincount(surface.faces.ravel(), np.repeat(surface.areas / 3, 3), minlength=len(surface.vertices))
    even = np.sqrt(2 * mass.sum() / (np.sqrt(3) * count))  # the edge of equilateral triangles, two a vertex
    bend = curvature(surface, SMOOTHING_EDGES * even)
    mean = float((mass * bend).sum() / mass.sum())
    wanted = np.clip(bend / mean, 1 / CONTRAST, CONTRAST) ** (-adapt / 2)
    for _ in range(BALANCES):
        wanted = _limited(surface, wanted * (even * np.sqrt((mass / wanted**2).sum() / mass.sum())))
    return SizingField(ClosestPoint(surface), wanted)


def curvature(surface: TriMesh, radius: float) -> Floats:
    """(V,): √(κ₁² + κ₂²), of the curvature tensor averaged over about `radius` by heat diffusion.

    The tensor is that of the normal cycle: each edge bends by its dihedral angle, along itself and over its length.
    """
    ends = surface.vertices[surface.edges]
    along = (ends[:, 1] - ends[:, 0]) / surface.edge_lengths[:, None]
    bent = bend_radians(surface) * surface.edge_lengths / 2
    rows, columns = np.triu_indices(3)
    of_edge = bent[:, None] * along[:, rows] * along[:, columns]
    tensor = summed(surface.edges.T.ravel(), np.tile(of_edge, (2, 1)), len(surface.vertices))
    mass = np.bincount(surface.faces.ravel(), np.repeat(surface.areas / 3, 3), minlength=len(surface.vertices))
    per_area = 2 / radius**2
    system = csr_array(diags_array(mass * per_area) - igl.cotmatrix(surface.vertices, surface.faces))
    jacobi = diags_array(1 / system.diagonal())
    smooth = np.column_stack([cg(system, per_area * tensor[:, k], rtol=PRECISION, M=jacobi)[0] for k in range(6)])
    return np.sqrt((smooth**2 * np.where(rows == columns, 1, 2)).sum(axis=1))


def _limited(surface: TriMesh, wanted: Floats) -> Floats:
    """The largest lengths that are nowhere above the wanted ones and grow by `GRADATION` at most, along edges."""
    count = len(wanted)
    a, b = surface.edges.T
    source = np.full(count, count)
    graph = coo_array(
        (
            np.concatenate([surface.edge_lengths, surface.edge_lengths, wanted / GRADATION]),
            (np.concatenate([a, b, source]), np.concatenate([b, a, np.arange(count)])),
        ),
        shape=(count + 1, count + 1),
    )
    return GRADATION * np.asarray(dijkstra(graph.tocsr(), indices=[count]), np.float64)[0, :count]
