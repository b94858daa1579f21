"""Polish: valences, edges and distances made better in turn, at a constant number of vertices.

Flips let irregular vertices meet and vanish (`dislocation_glide`), least squares then place all vertices
(`surface_fit`); each makes room for the other. Flaws that are left then are mended by pairs of collapses and splits
(`collapse_and_split`); a mesh without any stays as it is. The highest peaks of the distance are lowered last
(`largest_distance`).
"""

import numpy as np

from drkid.mesh import TriMesh
from drkid.remesh.collapse_and_split import collapsed_and_split
from drkid.remesh.dislocation_glide import glide
from drkid.remesh.largest_distance import lowered
from drkid.remesh.surface_fit import SurfaceFit

ROUNDS = 4  # of both; later ones find few flips that are worth while
SWEEPS, HEAT = 4, 0.02  # of the flips in a round, and where their annealing starts; it cools from round to round
STEPS, LAST_STEPS = 2, 5  # of the placement in a round, and in the end: then it has converged


def polished(mesh: TriMesh, fit: SurfaceFit, rng: np.random.Generator) -> TriMesh:
    """Edges nearly equal, few vertices of other valence than six, faces on both sides of the surface in the mean.

    With a sizing field of the fit, edges are as long as that says. The mesh is closed and manifold, and stays so; its
    vertices keep their numbers.
    """
    for left in range(ROUNDS, 0, -1):
        mesh = glide(mesh, SWEEPS, HEAT * (left - 1) / ROUNDS, rng, fit.sizing)
        for _ in range(STEPS):
            mesh = fit.stepped(mesh)
    for _ in range(LAST_STEPS):
        mesh = fit.stepped(mesh)
    return lowered(collapsed_and_split(mesh, fit), fit)
