"""What makes one exact mesh better than another: closeness to M_s at its worst and on average, and smoothness.

An exact search meets tens to hundreds of exact meshes; this small score chooses among them by what people see.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from drkid.closest_point import TriangleTree, closest_points, triangle_tree
from drkid.measure import Dihedral, bend_radians, dihedral, sample
from drkid.mesh import Floats, TriMesh
from drkid.spec import KitSpec

SAMPLES = 1500  # on M_s; of the other mesh its vertices, edge middles and face centres
# Each term is 1 at what a research trial reached at 172 faces: only then do the weights compare like with like.
UNIT_MEAN_PERCENT, UNIT_MAX_PERCENT, UNIT_DEGREES, UNIT_CONCAVE_PERCENT = 0.5, 2.5, 4.0, 5.0

UNIT_BEYOND_DEGREES = 1.0  # pieces of a fixed bevel do not go together at such a joint: nearly any other mesh is better
REFUSED = 5.0  # what a mesh with a joint beyond the bevels adds: whatever else it is like, no kit is made of it


@dataclass(frozen=True)
class Quality:
    """d_H(M_s, M_f) in percent of the bounding-box diagonal, and dihedrals beyond those of M_s.

    `farthest` is the place of the largest distance; `beyond_degrees` is by how much joints bend beyond
    `spec.bevel_degrees`, added up, and 0 where those are not given.
    """

    mean_percent: float
    max_percent: float
    p95_degrees: float
    excess_p95_degrees: float
    excess_concave_percent: float
    farthest: tuple[float, float, float]
    beyond_degrees: float = 0.0


@dataclass(frozen=True, eq=False)
class Yardstick:
    """Measures meshes against M_s, quickly enough to be asked for each that is met."""

    reference: TriMesh
    spec: KitSpec

    @cached_property
    def _tree(self) -> TriangleTree:
        return triangle_tree(self.reference)

    @cached_property
    def _points(self) -> Floats:
        points = sample(self.reference, SAMPLES, np.random.default_rng(0))
        return np.concatenate([points, self.reference.vertices])

    @cached_property
    def _angles(self) -> Dihedral:
        return dihedral(self.reference)

    def quality(self, mesh: TriMesh) -> Quality:
        """Of a closed mesh."""
        middles = mesh.vertices[mesh.edges].mean(axis=1)
        own = np.concatenate([mesh.vertices, middles, mesh.corners.mean(axis=1)])
        there = closest_points(self._tree, own)[0]
        back = closest_points(triangle_tree(mesh), self._points)[0]
        there, back = np.sqrt(there), np.sqrt(back)
        places, distances = np.concatenate([own, self._points]), np.concatenate([there, back])
        x, y, z = places[distances.argmax()].tolist()
        percent, angles = 100 / self.reference.diagonal, dihedral(mesh)
        return Quality(
            float(there.mean() + back.mean()) / 2 * percent,
            float(distances.max()) * percent,
            angles.p95_degrees,
            max(0.0, angles.p95_degrees - self._angles.p95_degrees),
            max(0.0, angles.concave_percent - self._angles.concave_percent),
            (x, y, z),
            self._beyond_degrees(mesh),
        )

    def _beyond_degrees(self, mesh: TriMesh) -> float:
        if self.spec.bevel_degrees is None:
            return 0.0
        concave, convex = self.spec.bevel_degrees
        bend = np.degrees(bend_radians(mesh))
        return float(np.maximum(np.maximum(bend - convex, -concave - bend), 0.0).sum())

    def score(self, quality: Quality) -> float:
        """The weighted sum, less being better."""
        return (
            self.spec.weight_mean * quality.mean_percent / UNIT_MEAN_PERCENT
            + self.spec.weight_max * quality.max_percent / UNIT_MAX_PERCENT
            + self.spec.weight_dihedral * quality.excess_p95_degrees / UNIT_DEGREES
            + self.spec.weight_concave * quality.excess_concave_percent / UNIT_CONCAVE_PERCENT
            + (REFUSED + quality.beyond_degrees / UNIT_BEYOND_DEGREES if quality.beyond_degrees else 0.0)
        )
