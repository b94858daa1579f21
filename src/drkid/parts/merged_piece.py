"""Merged piece: several triangles as one bent solid, its outline bevelled and pocketed side by side."""

from itertools import pairwise

import numpy as np

from drkid.kit import MergedClass, MergedPiece
from drkid.measure import bend_radians
from drkid.mesh import Bools, Floats, Ints, TriMesh, read_only
from drkid.parts.bevel import SHARPEST_JOINT_DEGREES
from drkid.parts.pocket import leaning_turn
from drkid.parts.prismoid import FROM_AXIS, RIDGED
from drkid.rigid_fit import rigid_fit
from drkid.solid import Solid

SKIRT_MM = 1.0  # beyond what stands out of the outline; the bevels cut it away
OVERLAP_MM = 1e-3  # beyond its folds: how far the bevels of a triangle cut, so that no film is left between two cuts
OUTWARD = 0.2  # cosine of the angle to a side's way outwards: a line flatter than that runs along the side
MITRE = 1e-3  # singular values below this share are left out: triangles in one plane have one normal


def outline_frames(shape: MergedClass, lean_degrees: float = 0.0) -> Floats:
    """(n, 4, 4): connector to part coordinates at every side of the outline: z is the normal of the triangle there.

    y leans inwards, as in `pocket.side_frames`.
    """
    following = np.roll(shape.corners, -1, axis=0)
    x = following - shape.corners
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    z = _face_normals(shape)[shape.side_face]
    frames = np.zeros((len(x), 4, 4))
    frames[:, :3, 0], frames[:, :3, 1], frames[:, :3, 2] = x, np.cross(z, x), z
    frames[:, :3, 3] = (shape.corners + following) / 2
    frames[:, 3, 3] = 1.0
    return read_only(frames @ leaning_turn(lean_degrees))


def outline_bends(mesh: TriMesh, piece: MergedPiece) -> tuple[Floats, Ints]:
    """Bend (n,) of the mesh at each side of a piece's outline, in radians, and the edge (n,) that it is."""
    number = {tuple(edge): i for i, edge in enumerate(mesh.edges.tolist())}
    around = [*piece.vertices, piece.vertices[0]]
    edges = [number[min(a, b), max(a, b)] for a, b in pairwise(around)]
    return bend_radians(mesh)[edges], np.array(edges, np.int64)


def demanded(
    mesh_mm: TriMesh, shape: MergedClass, piece: MergedPiece, thickness_mm: float, swing_degrees: float
) -> Floats:
    """(2, n): least inset of each side at the inner and outer face for one member, as `bevel.demanded` of triangles."""
    swing, most = np.radians(swing_degrees), np.radians(SHARPEST_JOINT_DEGREES)
    bend, _ = outline_bends(mesh_mm, piece)
    low, high = (np.tan(np.clip(bend + s, -most, most) / 2) for s in (-swing, swing))
    return far_inside(mesh_mm, shape, piece) + thickness_mm / 2 * np.stack([high, -low])


def far_inside(mesh_mm: TriMesh, shape: MergedClass, piece: MergedPiece) -> Floats:
    """(n,): how far the mesh's edge lies inside each side of the shape, at its farther end; 0 where it lies outside.

    Hinges turn about the shape's side and not about the edge: an edge outside leaves the bevels no less to do.
    """
    corners = mesh_mm.vertices[list(piece.vertices)]
    motion = rigid_fit(corners, shape.corners)
    corners = corners @ motion[:3, :3].T + motion[:3, 3]
    inward = outline_frames(shape)[:, :3, 1]
    ends = np.stack([corners - shape.corners, np.roll(corners - shape.corners, -1, axis=0)])
    return np.einsum("esk,sk->es", ends, inward).max(axis=0, initial=0.0)


def shared(lengths: list[Floats], shape: MergedClass) -> Floats:
    """(…, n): the largest of all members' lengths, the same on sides that are mirror images."""
    most = np.max(lengths, axis=0)
    if shape.mirror:
        n = len(shape.mirror)
        image = [shape.mirror[(i + 1) % n] for i in range(n)]  # side i runs backwards to the image of its end
        most = np.maximum(most, most[..., image])
    return most


def merged_solid(shape: MergedClass, insets_mm: Floats, thickness_mm: float, cutting: Bools | None = None) -> Solid:
    """The piece before its pockets are cut: its triangles thick and mitred at their folds, cut by its sides' bevels.

    `insets_mm` (m, n) are those of the sides at even steps from the inner to the outer face. The planes of a side's
    bevel cut those triangles that `cutting` (f, n) says, all of them if it is not given: that is what a convex outline
    allows.
    """
    skirt = max(-float(insets_mm.min()), 0.0) + SKIRT_MM
    solid = Solid.of(slab_mesh(shape, skirt, thickness_mm))
    normals, levels, sides = bevel_planes(shape, insets_mm, thickness_mm)
    cutting = np.ones((len(shape.faces), len(shape.corners)), np.bool_) if cutting is None else cutting
    whole: Bools = np.all(cutting, axis=0)
    for k in np.flatnonzero(whole[sides]).tolist():
        solid = solid.beyond(normals[k], float(levels[k]))
    low, high = solid.bounds + np.array([[-SKIRT_MM], [SKIRT_MM]])  # no face of a cut lies in one of the piece
    cut: list[Solid] = []
    for face in range(len(shape.faces)) if not whole.all() else ():
        zone = Solid.box(low, high)
        for normal, level in _mitre_planes(shape, face):
            zone = zone.beyond(normal, level - OVERLAP_MM)
        own = np.flatnonzero((cutting[face] & ~whole)[sides]).tolist()
        cut += [zone.beyond(-normals[k], -float(levels[k])) for k in own]
    return solid.minus_all(cut)


def cutting_sides(
    shape: MergedClass, insets_mm: Floats, thickness_mm: float, pocket_of_side: Solid | None, wall_mm: float
) -> Bools:
    """(f, n): which sides' bevels cut which triangles.

    All do, except where the planes of one side, which run aslant in a triangle that is bent against its own, would
    leave less than a wall before the pockets there. `pocket_of_side` is the pocket in connector coordinates.
    """
    count = len(shape.corners)
    cutting = np.ones((len(shape.faces), count), np.bool_)
    if pocket_of_side is None:
        return cutting
    skirt = max(-float(insets_mm.min()), 0.0) + SKIRT_MM
    slab, frames = Solid.of(slab_mesh(shape, skirt, thickness_mm)), outline_frames(shape)
    normals, levels, sides = bevel_planes(shape, insets_mm, thickness_mm)
    for side, face in enumerate(shape.side_face.tolist()):
        own = np.isin(sides, np.array([side]))
        space = slab & pocket_of_side.moved(frames[side])
        for normal, level in zip(normals[own], levels[own], strict=True):
            space = space.beyond(normal, float(level))
        behind = (space.mesh().vertices @ normals.T - levels).min(axis=0)
        cutting[face, (shape.side_face != face) & np.isin(np.arange(count), sides[behind < wall_mm])] = False
    return cutting


def _mitre_planes(shape: MergedClass, face: int) -> list[tuple[Floats, float]]:
    """Normals and levels of the planes that halve the angles at a triangle's folds, the triangle on their far side."""
    points, normals = np.vstack([shape.corners, shape.inner]), _face_normals(shape)
    corners, found = shape.faces[face].tolist(), list[tuple[Floats, float]]()
    for a, b in zip(corners, [*corners[1:], corners[0]], strict=True):
        other = next((g for g, row in enumerate(shape.faces.tolist()) if g != face and a in row and b in row), None)
        if other is None:
            continue
        along = points[b] - points[a]
        inward = np.cross(normals[face] + normals[other], along)
        inward /= np.linalg.norm(inward)
        found.append((inward, float(inward @ points[a])))
    return found


def bevel_planes(shape: MergedClass, insets_mm: Floats, thickness_mm: float) -> tuple[Floats, Floats, Ints]:
    """Unit normals (p, 3), levels (p,) and sides (p,): the piece lies where normal·p is more than each level.

    A piece bends beyond the faces of the triangle at a side: where the bevel has a ridge, planes through the hinge axis
    keep what lies there within the swing.
    """
    frames, found = outline_frames(shape), list[tuple[Floats, Floats]]()
    half, axis = thickness_mm / 2, np.zeros(len(frames))
    steps = list(pairwise(zip(np.linspace(-half, half, len(insets_mm)).tolist(), insets_mm, strict=True)))
    if len(insets_mm) == RIDGED:
        near = (1 - FROM_AXIS) * insets_mm[1] + FROM_AXIS * insets_mm
        steps += [((-FROM_AXIS * half, near[0]), (0.0, axis)), ((0.0, axis), (FROM_AXIS * half, near[-1]))]
    for (low, below), (high, above) in steps:
        slope = (above - below) / (high - low)
        normals = frames[:, :3, 1] - slope[:, None] * frames[:, :3, 2]
        levels = np.einsum("sk,sk->s", normals, frames[:, :3, 3]) + below - slope * low
        length = np.linalg.norm(normals, axis=1)
        found.append((normals / length[:, None], levels / length))
    sides = np.tile(np.arange(len(frames)), len(found))
    return np.concatenate([n for n, _ in found]), np.concatenate([level for _, level in found]), sides


def slab_mesh(shape: MergedClass, skirt_mm: float, thickness_mm: float) -> TriMesh:
    """The triangles, carried on beyond the outline by a skirt in their own planes, at half the thickness either way.

    Every point moves along the mitre of its triangles' normals, so that no triangle is thinner than stated: it keeps
    its thickness where no more than three planes meet, and is a little thicker elsewhere, and where the skirt leaves
    them.
    """
    normals, n = _face_normals(shape), len(shape.corners)
    points = np.vstack([shape.corners, shape.inner])
    around = [np.flatnonzero((shape.faces == i).any(axis=1)) for i in range(len(points))]
    at_side = [np.unique([shape.side_face[i - 1], shape.side_face[i]]) for i in range(n)]
    mitre = np.stack([_mitre(normals[own]) for own in [*around, *at_side]])
    out = skirt_mm * _outward(shape)
    off = np.stack(
        [
            normals[own] @ way
            for own, way in zip(shape.side_face[np.stack([np.arange(n) - 1, np.arange(n)], axis=1)], out, strict=True)
        ]
    )
    below, above = (np.maximum(np.append(np.zeros(len(points)), x.max(axis=1)), 0.0) for x in (-off, off))
    points = np.vstack([points, shape.corners + out])
    count, a = len(points), np.arange(n)
    up, down = (mitre * (thickness_mm / 2 + more)[:, None] for more in (below, above))
    b, s = np.roll(a, -1), a + count - n
    t = np.roll(s, -1)
    upper = np.vstack([shape.faces, np.stack([b, a, s], axis=1), np.stack([b, s, t], axis=1)])
    walls = [np.stack([s, t, t + count], axis=1), np.stack([s, t + count, s + count], axis=1)]
    return TriMesh(np.vstack([points - down, points + up]), np.vstack([upper[:, ::-1], upper + count, *walls]))


def _outward(shape: MergedClass) -> Floats:
    """(n, 3): where a corner goes if both of its sides move outwards by 1 at least, each in the plane of its triangle.

    Along the line that the two planes share, which is the fold where one meets the corner; half-way between the sides
    where there is one plane, or that line does not lead outwards.
    """
    frames, n = outline_frames(shape), len(shape.corners)
    inward, normals = frames[:, :3, 1], _face_normals(shape)[shape.side_face]
    points = np.vstack([shape.corners, shape.inner])
    out = np.empty((n, 3))
    for i in range(n):
        own = shape.faces[(shape.faces == i).any(axis=1)]
        direction = -(inward[i - 1] + inward[i])
        if len(own) == 2:
            far = next(v for v in np.intersect1d(own[0], own[1]) if v != i)
            direction = points[i] - points[far]
        elif len(own) > 2:
            line = np.cross(normals[i - 1], normals[i])
            line *= 1.0 if line @ direction > 0 else -1.0
            steep = max(inward[i - 1] @ line, inward[i] @ line) < -OUTWARD * np.linalg.norm(line)
            direction = line if steep else direction
        out[i] = direction / -max(inward[i - 1] @ direction, inward[i] @ direction)
    return out


def _face_normals(shape: MergedClass) -> Floats:
    return TriMesh(np.vstack([shape.corners, shape.inner]), shape.faces).face_normals


def _mitre(normals: Floats) -> Floats:
    """(3,): the shift that moves every plane with one of these normals (m, 3) by 1, or little more where it cannot."""
    shift = np.linalg.pinv(normals, rcond=MITRE) @ np.ones(len(normals))
    return shift / (normals @ shift).min()
