"""Prismoid: a triangle with thickness, its sides bevelled."""

from dataclasses import dataclass

import numpy as np

from drkid.class_triangle import inward_normals
from drkid.mesh import Floats, read_only
from drkid.solid import Solid


@dataclass(frozen=True, eq=False)
class Prismoid:
    """The convex hull of two triangles: `faces` (2, 3, 2) at z = −thickness_mm/2 and +thickness_mm/2."""

    faces: Floats
    thickness_mm: float

    @property
    def heights_mm(self) -> tuple[float, float]:
        """The heights of the two faces."""
        return -self.thickness_mm / 2, self.thickness_mm / 2

    @property
    def solid(self) -> Solid:
        """The piece without pockets."""
        points = [np.column_stack([f, np.full(3, z)]) for f, z in zip(self.faces, self.heights_mm, strict=True)]
        return Solid.hull(np.vstack(points))

    def outline(self, height_mm: float) -> Floats:
        """(3, 2): corners of the section at a height (a twisted side bulges over it, never stays behind)."""
        share = height_mm / self.thickness_mm + 0.5
        return (1 - share) * self.faces[0] + share * self.faces[1]

    def insets(self, triangle: Floats) -> Floats:
        """(2, 3): how far each side of either face stands inside the class triangle's (3, 2), at the nearer end."""
        return np.stack([side_insets(triangle, face) for face in self.faces])


def side_insets(triangle: Floats, outline: Floats) -> Floats:
    """(3,): how far each side of an outline (3, 2) stands inside a triangle's (3, 2), at the nearer end."""
    offset = np.stack([outline, np.roll(outline, -1, axis=0)]) - triangle
    return np.einsum("esk,sk->es", offset, inward_normals(triangle)).min(axis=0)


def bevelled(triangle: Floats, insets_mm: Floats, thickness_mm: float) -> Prismoid:
    """The prismoid whose faces' sides stand `insets_mm` (2, 3) inside those of the class triangle (3, 2)."""
    normal = inward_normals(triangle)
    level = np.einsum("sk,sk->s", normal, triangle) + insets_mm
    systems = np.stack([np.roll(normal, 1, axis=0), normal], axis=1)  # corner i: sides i − 1 and i meet
    levels = np.stack([np.roll(level, 1, axis=1), level], axis=-1)
    faces = np.linalg.solve(systems[None], levels[..., None])[..., 0]
    return Prismoid(read_only(faces.astype(np.float64)), thickness_mm)
