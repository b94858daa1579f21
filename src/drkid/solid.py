"""Solid: the only door to the CSG kernel (manifold3d)."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Self

import manifold3d
import numpy as np
from numpy.typing import ArrayLike

from drkid.mesh import Floats, Ints, TriMesh, coinciding_joined

CIRCLE_SEGMENTS = 48  # facets of a round shape: less than 0.01 mm off the circle at hinge radii

CIRCLE_MM = 0.01
NEEDLE = 5e-5  # some forty steps of single precision at a part's size
MOST_FLIPS = 100  # of the sides of a part's flattest faces
SLIVER = 1e-3  # corners of outlines that stand out by less are dropped: they are rounding, and make needles of faces


def circle_outside(radius: float) -> Floats:
    """(CIRCLE_SEGMENTS, 2): the regular polygon whose sides, four of them along the axes, touch a circle outside."""
    angle = (np.arange(CIRCLE_SEGMENTS) + 0.5) * 2 * np.pi / CIRCLE_SEGMENTS
    return radius / np.cos(np.pi / CIRCLE_SEGMENTS) * np.stack([np.cos(angle), np.sin(angle)], axis=1)


@dataclass(frozen=True, eq=False)
class Solid:
    """A closed solid of guaranteed manifoldness. Operations return new solids."""

    body: manifold3d.Manifold

    # ---- made from

    @classmethod
    def box(cls, low: ArrayLike, high: ArrayLike) -> Self:
        """The axis-aligned box between two corners (3,)."""
        low, high = np.asarray(low, float), np.asarray(high, float)
        return cls(manifold3d.Manifold.cube(tuple(high - low)).translate(tuple(low)))

    @classmethod
    def cylinder_along_x(cls, radius: float, low: float, high: float) -> Self:
        """A cylinder about the x axis from x = `low` to x = `high`, its facets tangent to the circle's outside."""
        return cls.prism_along_x(circle_outside(radius), low, high)

    @classmethod
    def prism_along_x(cls, profile: ArrayLike, low: float, high: float) -> Self:
        """The prism from x = `low` to x = `high` over the convex hull of points (n, 2) in (y, z)."""
        points = np.asarray(profile, np.float64)
        ends = [np.column_stack([np.full(len(points), x), points]) for x in (low, high)]
        return cls.hull(np.vstack(ends))

    @classmethod
    def prism_along_z(cls, outlines: Iterable[ArrayLike], low: float, high: float) -> Self:
        """The prism from z = `low` to z = `high` over the union of the convex hulls of point sets (n, 2) in (x, y)."""
        hulls = [manifold3d.CrossSection.hull_points(np.asarray(o, np.float64)) for o in outlines]
        union = manifold3d.CrossSection.batch_boolean(hulls, manifold3d.OpType.Add).simplify(SLIVER)
        return cls(manifold3d.Manifold.extrude(union, high - low).translate((0.0, 0.0, low)))

    @classmethod
    def hull(cls, points: ArrayLike) -> Self:
        """The convex hull of (n, 3) points."""
        return cls(manifold3d.Manifold.hull_points(np.asarray(points, np.float64)))

    @classmethod
    def of(cls, mesh: TriMesh) -> Self:
        """The solid that a closed mesh encloses.

        Raises:
            ValueError: the kernel does not accept the mesh as a manifold.
        """
        body = manifold3d.Manifold(
            manifold3d.Mesh64(np.array(mesh.vertices, order="C"), np.array(mesh.faces, np.uint64, order="C"))
        )
        if body.status() != manifold3d.Error.NoError or body.is_empty():
            message = f"not a manifold solid: {body.status().name}"
            raise ValueError(message)
        return cls(body)

    @classmethod
    def union(cls, solids: Iterable["Solid"]) -> Self:
        """The union of solids; nothing where there are none."""
        return cls(manifold3d.Manifold.batch_boolean([one.body for one in solids], manifold3d.OpType.Add))

    # ---- combined

    def __add__(self, other: "Solid") -> "Solid":
        """Union."""
        return Solid(self.body + other.body)

    def __sub__(self, other: "Solid") -> "Solid":
        """Difference."""
        return Solid(self.body - other.body)

    def __and__(self, other: "Solid") -> "Solid":
        """Intersection."""
        return Solid(self.body ^ other.body)

    def minus_all(self, others: Iterable["Solid"]) -> "Solid":
        """Difference with every one of `others`, in one operation."""
        bodies = [self.body, *(o.body for o in others)]
        return Solid(manifold3d.Manifold.batch_boolean(bodies, manifold3d.OpType.Subtract))

    def components(self) -> "list[Solid]":
        """Its parts that do not hang together."""
        return [Solid(body) for body in self.body.decompose()]

    def moved(self, matrix: Floats) -> "Solid":
        """Carried by a 4×4 matrix, column-vector convention."""
        return Solid(self.body.transform(np.ascontiguousarray(matrix[:3, :4])))

    def mirrored(self) -> "Solid":
        """Its mirror image across the plane x = 0."""
        return Solid(self.body.mirror((1.0, 0.0, 0.0)))

    def beyond(self, normal: Floats, level: float) -> "Solid":
        """What lies on the side of the plane normal·p = level to which the normal (3,) points."""
        length = float(np.linalg.norm(normal))
        return Solid(self.body.trim_by_plane(tuple((normal / length).tolist()), level / length))

    def without_needles(self) -> "Solid":
        """With corners nearer than `NEEDLE` made one, which single precision may take past each other in part files.

        Nor do faces with a corner so near to the side opposite stay, which it may take across: that side is flipped.
        As it is where there are none, or where the surface would be closed no more.
        """
        mesh = self.mesh()
        short = mesh.edges[mesh.edge_lengths < NEEDLE]
        stands = np.arange(len(mesh.vertices))
        for a, b in short.tolist():
            stands[stands == stands[b]] = stands[a]
        joined = coinciding_joined(mesh.vertices[stands], mesh.faces) if len(short) else mesh
        whole = _caps_flipped(joined) if joined.is_closed_manifold else joined
        return Solid.of(whole) if whole is not mesh and whole.is_closed_manifold else self

    # ---- measured

    @property
    def volume(self) -> float:
        """Enclosed volume."""
        return float(self.body.volume())

    @property
    def bounds(self) -> Floats:
        """(2, 3): lowest and highest corner of the bounding box."""
        return np.reshape(self.body.bounding_box(), (2, 3)).astype(np.float64)

    @property
    def is_empty(self) -> bool:
        """True where nothing is left."""
        return bool(self.body.is_empty())

    def mesh(self) -> TriMesh:
        """The solid's surface."""
        out = self.body.to_mesh64()
        return TriMesh(np.asarray(out.vert_properties)[:, :3], np.asarray(out.tri_verts).astype(np.int64))

    def gap(self, other: "Solid", reach: float) -> float:
        """Least distance to another solid; `reach` where it is more."""
        return float(self.body.min_gap(other.body, reach))

    def cross_section(self, z: float) -> Sequence[Floats]:
        """The polygons, each (n, 2), in which the plane at height z cuts the solid."""
        return [np.asarray(p, np.float64) for p in self.body.slice(z).to_polygons()]


def _caps_flipped(mesh: TriMesh) -> TriMesh:
    """The surface with the longest side of every face that is flatter than `NEEDLE` flipped, where that mends it."""
    faces = mesh.faces.copy()
    for _ in range(MOST_FLIPS):
        tried = TriMesh(mesh.vertices, faces)
        flat = np.flatnonzero(2 * tried.areas < NEEDLE * tried.side_lengths.max(axis=1))
        flips = (_flipped(tried, face, int(tried.side_lengths[face].argmax())) for face in flat.tolist())
        best = next((found for found in flips if found is not None), None)
        if best is None:
            return tried if (faces != mesh.faces).any() else mesh
        faces = best
    return TriMesh(mesh.vertices, faces)


def _flipped(mesh: TriMesh, face: int, side: int) -> Ints | None:
    """The faces with a side of one flipped; None where its new edge is there already or would bound flatter faces."""
    a, b, c = np.roll(mesh.faces[face], -side).tolist()
    pair = mesh.edge_faces[mesh.face_edges[face, side]]
    other = int(pair[pair != face][0])
    d = next(v for v in mesh.faces[other].tolist() if v not in (a, b))
    faces = mesh.faces.copy()
    faces[face], faces[other] = (a, d, c), (d, b, c)
    new = TriMesh(mesh.vertices, faces[[face, other]])
    flattest = float((new.areas / new.side_lengths.max(axis=1)).min())
    there = (mesh.edges == (min(c, d), max(c, d))).all(axis=1).any()
    was = float(mesh.areas[face] / mesh.side_lengths[face].max())
    return None if there or flattest <= was else faces


def widest_circle_mm(polygons: Floats) -> float:
    """Diameter of the largest circle in the union of counter-clockwise polygons (m, n, 2), within `CIRCLE_MM`."""
    plan = manifold3d.CrossSection([np.asarray(p, np.float64) for p in polygons], manifold3d.FillRule.NonZero)
    low, high = 0.0, float(np.ptp(polygons.reshape(-1, 2), axis=0).min()) / 2
    while high - low > CIRCLE_MM / 2:
        middle = (low + high) / 2
        left = plan.offset(-middle, manifold3d.JoinType.Round, circular_segments=CIRCLE_SEGMENTS)
        low, high = (low, middle) if left.is_empty() else (middle, high)
    return low + high


def triangulated(outline: Floats) -> Ints:
    """(m, 3): corners of triangles, counter-clockwise, that cover a simple counter-clockwise polygon (n, 2)."""
    return np.asarray(manifold3d.triangulate([np.asarray(outline, np.float64)]), np.int64)
