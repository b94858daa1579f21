"""A labelled mesh with its palette: what the palette solver works on."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from drkid.congruence.target import smoothness
from drkid.mesh import Floats, Ints, TriMesh

BETA = 0.6  # of K: without its smoothness term the offsets spike, with more of it the mesh stays farther away


@dataclass(frozen=True, eq=False)
class Framework:
    """A closed mesh, a label (E,) for each of its edges in their order, and the palette's lengths (q,)."""

    mesh: TriMesh
    labels: Ints
    lengths: Floats

    @property
    def wanted(self) -> Floats:
        """(E,): the length that each edge is to have."""
        return self.lengths[self.labels]

    @cached_property
    def residual(self) -> Floats:
        """(E,): length minus wanted length."""
        return self.mesh.edge_lengths - self.wanted

    @property
    def worst(self) -> float:
        """Largest edge error, of the mean wanted length."""
        return float(np.abs(self.residual).max() / self.wanted.mean())

    @cached_property
    def stiffness(self) -> Floats:
        """K (V, V) of this connectivity."""
        return smoothness(self.mesh, BETA)

    def moved(self, vertices: Floats, lengths: Floats) -> "Framework":
        """Other positions and lengths; what depends on the connectivity alone is kept."""
        other = replace(self, mesh=self.mesh.moved(vertices), lengths=lengths)
        for name in ("_edges_and_sides", "edge_faces", "valence", "half_edges"):
            if name in self.mesh.__dict__:
                other.mesh.__dict__[name] = self.mesh.__dict__[name]
        if "stiffness" in self.__dict__:
            other.__dict__["stiffness"] = self.stiffness
        return other


def framework_of(vertices: Floats, faces: Ints, edges: Ints, labels: Ints, lengths: Floats) -> Framework:
    """A framework from connectivity whose edges (E, 2) stand in any order and direction."""
    ends = np.sort(edges, axis=1)
    order = np.lexsort((ends[:, 1], ends[:, 0]))  # the order in which TriMesh keeps its edges
    return Framework(TriMesh(vertices, faces), labels[order], lengths)
