"""Identity of merged pieces: which of them are one shape, judged on the merged piece and not on its triangles.

The measure is the least residual over cyclic relabellings of the outline that keep its triangles, after a proper
rigid fit (Kabsch): the distance of the farthest corner. Mirror images are told apart.
"""

from collections import defaultdict

import numpy as np

from drkid.mesh import Floats, Ints, TriMesh
from drkid.patches.outline import Outlined
from drkid.rigid_fit import rigid_fit


def relabellings(one: Outlined, other: Outlined) -> list[int]:
    """The turns of `other` after which its triangles are those of `one`; empty where the two are built otherwise."""
    if (len(one.vertices), len(one.inner)) != (len(other.vertices), len(other.inner)):
        return []
    return [by for by in range(len(other.vertices)) if other.turned(by).pattern == one.pattern]


def misfits(points: Floats, others: Floats) -> Floats:
    """(…,): distance of the farthest of points (…, n, 3) after the proper rigid motion that fits them to `others`."""
    motion = rigid_fit(points, others)
    moved = np.einsum("...ij,...nj->...ni", motion[..., :3, :3], points) + motion[..., None, :3, 3]
    return np.linalg.norm(moved - others, axis=-1).max(axis=-1)


def residuals(mesh: TriMesh, pieces: list[Outlined]) -> tuple[Floats, Ints]:
    """(P, P) residual of every piece j against piece i, and the turn of j at which it is least; infinite where none."""
    count = len(pieces)
    least, turn = np.full((count, count), np.inf), np.zeros((count, count), np.int64)
    for own in built_alike(pieces):
        first = pieces[own[0]]
        aligned = [pieces[p].turned(relabellings(first, pieces[p])[0]) for p in own]
        start = np.array([relabellings(first, pieces[p])[0] for p in own])
        points = np.stack([p.points(mesh) for p in aligned])
        for by in relabellings(first, first):
            turned = np.stack([p.turned(by).points(mesh) for p in aligned])
            found = misfits(turned[None], points[:, None])
            rows, columns = np.ix_(own, own)
            better = found < least[rows, columns] - 1e-12
            least[rows, columns] = np.where(better, found, least[rows, columns])
            relative = (start[None] + by - start[:, None]) % len(first.vertices)
            turn[rows, columns] = np.where(better, relative, turn[rows, columns])
    np.fill_diagonal(least, 0.0)
    np.fill_diagonal(turn, 0)
    return least, turn


def symmetrised(points: Floats, image: tuple[int, ...]) -> Floats:
    """The mean of a shape (n, 3) and its mirror image, in which corner `image[i]` is the image of corner i."""
    mirrored = points[[*image, *range(len(image), len(points))]] * np.array([-1.0, 1.0, 1.0])
    motion = rigid_fit(mirrored, points)
    return (points + mirrored @ motion[:3, :3].T + motion[:3, 3]) / 2


def built_alike(pieces: list[Outlined]) -> list[list[int]]:
    """Pieces grouped by the pattern of their triangles, whichever corner is first."""
    groups: dict[tuple[tuple[int, ...], ...], list[int]] = defaultdict(list)
    for i, piece in enumerate(pieces):
        turns = [tuple(sorted(piece.turned(by).pattern)) for by in range(len(piece.vertices))]
        groups[(len(piece.vertices), len(piece.inner)), *min(turns)].append(i)
    return list(groups.values())


def shapes(residual: Floats, tolerance: float) -> Ints:
    """(P,): the piece that stands for each piece, within the tolerance of it or itself; few, by greedy covering."""
    near = (residual <= tolerance) | np.eye(len(residual), dtype=bool)
    stands = np.full(len(residual), -1, np.int64)
    while (open_ := stands < 0).any():
        leader = int(np.argmax((near & open_[None]).sum(axis=1) * open_))
        stands[near[leader] & open_] = leader
    return stands


def mirror_corners(points: Floats, piece: Outlined, tolerance: float) -> tuple[int, ...]:
    """Which corner each corner is the mirror image of, where the shape is its own mirror image; empty where not."""
    n = len(piece.vertices)
    mirrored = points * np.array([-1.0, 1.0, 1.0])
    for by in range(n):
        image = [*((by - i) % n for i in range(n)), *range(n, len(points))]
        pattern = frozenset(tuple(sorted(image[v] for v in row)) for row in piece.triangles.tolist())
        if pattern == piece.pattern and misfits(mirrored[image], points) <= tolerance:
            return tuple(image[:n])
    return ()
