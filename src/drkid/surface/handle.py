"""Handles of a voxel object: found, measured, and the smallest of them closed.

A front that keeps its topology (Bischoff and Kobbelt, "Isosurface reconstruction with topology control", 2002; Bazin
and Pham, "Topology correction of segmented medical images using a fast marching algorithm", 2007) runs twice: a full
block shrinks onto the object and leaves a sheet across every tunnel, a seed grows into the object and leaves a gap
across every handle. Each sheet and each gap is one way to close a handle; the ways of fewest voxels are taken.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy.ndimage as ndi

from drkid.errors import InputError
from drkid.mesh import Bools, Floats
from drkid.surface.marching_cubes import JOINED, UNBIASED, grid_surface, marched, marching
from drkid.surface.simple_point import deform, even_out, order_of

Way = Literal["filled", "cut"]
TOUCHING = np.ones((3, 3, 3))  # 26 neighbours
MOST_AT_ONCE = 8  # voxels of a patch that is taken together with others; larger ones are looked for anew
MARGIN = 2  # voxels around a patch beyond which the surface does not change
MOST_TOLD = 12  # closings that are told one by one
WAYS: tuple[Way, Way] = ("filled", "cut")


@dataclass(frozen=True, eq=False)
class Closing:
    """A patch of voxels that closed `handles` of them: which way, how many voxels, their mean index and extent.

    `across` is the patch's longest side along an axis, in the unit of the voxel size.
    """

    way: Way
    voxels: int
    handles: int
    centre: Floats
    across: float


@dataclass(frozen=True, eq=False)
class _Patch:
    """Voxels that could change sides, by their indices `places` (count, 3)."""

    way: Way
    places: Floats
    count: int

    @property
    def rank(self) -> tuple[int, int, tuple[float, ...]]:
        """Fewest voxels first, filling before cutting, then the place."""
        return self.count, WAYS.index(self.way), tuple(self.places.mean(axis=0))


def handles_kept(genus: int) -> str:
    """What a user should know of handles that nobody asked to close."""
    return (
        f"the surface has {genus} handle{'s' * (genus > 1)}; where they are noise, --max-genus closes the smallest ones"
    )


def without_handles(mask: Bools, most: int, spacing: Floats) -> tuple[Bools, tuple[Closing, ...]]:
    """The object with its smallest handles closed until its surface has at most `most`, and what was closed.

    Args:
        mask: (x, y, z), one 26-connected object without cavities, with background on every side.
        most: the genus that is wanted of `grid_surface`.
        spacing: (3,) voxel size.

    Raises:
        InputError: so few handles are not to be had.
    """
    mask = mask.copy()
    closed: list[Closing] = []
    start = genus = grid_surface(mask)[0].genus
    while genus > most:
        found = _closed_once(mask, genus - most, spacing, _ties(mask))
        found = found or _closed_once(mask, genus - most, spacing, _patches(mask, spacing))
        if not found:
            raise InputError(
                f"{genus - most} of {start} handles cannot be closed",
                wanted=f"a surface of genus {most} at most (--max-genus)",
                found=f"genus {genus} after {len(closed)} closings",
                remedy=f"--max-genus {genus}, or close them in the segmentation",
            )
        closed += found
        genus = grid_surface(mask)[0].genus
    return mask, tuple(closed)


def _closed_once(mask: Bools, surplus: int, spacing: Floats, patches: list[_Patch]) -> list[Closing]:
    """Close up to `surplus` handles of the mask, in place, with the patches that it has now, the smallest first.

    A patch that closes more handles than asked is taken only where no other is left.
    """
    closed: list[Closing] = []
    background = UNBIASED if marched(mask, UNBIASED).is_closed_manifold else JOINED
    patches = sorted(patches, key=lambda patch: patch.rank)
    for strict in (True, False):
        for patch in patches:
            if surplus <= 0 or (closed and (not strict or patch.count > MOST_AT_ONCE)):
                return closed
            handles = _gain(mask, patch, background)
            if handles > 0 and (handles <= surplus or not strict) and _stays_whole(mask, patch):
                _apply(mask, patch, background)
                surplus -= handles
                extent = (np.ptp(patch.places, axis=0) + 1) * spacing
                centre = patch.places.mean(axis=0)
                closed.append(Closing(patch.way, patch.count, handles, centre, float(extent.max())))
    return closed


def _patches(mask: Bools, spacing: Floats) -> list[_Patch]:
    """The sheets that a shrinking block leaves across tunnels, and the gaps that a growing seed leaves in handles.

    Each for a 26-connected object and for a 6-connected one: a surface can take voxels that touch in an edge or a
    corner either way.
    """
    target = mask.astype(np.uint8)
    outside = ndi.distance_transform_edt(~mask, sampling=spacing)
    depth = ndi.distance_transform_edt(mask, sampling=spacing)
    block = np.zeros_like(target)
    block[1:-1, 1:-1, 1:-1] = 1
    seed = np.zeros_like(target)
    seed[np.unravel_index(int(depth.argmax()), depth.shape)] = 1
    patches: list[_Patch] = []
    for swapped in (np.uint8(0), np.uint8(1)):  # of the background the topology is the other one
        shrunk, grown = block ^ swapped, seed ^ swapped
        deform(shrunk, target ^ swapped, order_of(outside))
        deform(grown, target ^ swapped, order_of(depth))
        patches += _connected((shrunk != swapped) & ~mask, "filled")
        patches += _connected((grown == swapped) & mask, "cut")
    return patches


def _ties(mask: Bools) -> list[_Patch]:
    """Single voxels, and groups of them, where marching cubes have a handle that the voxels do not have.

    Where voxels touch in an edge alone both readings of the cubes around are as good; Lewiner's tests take now this
    one, now that one, and a handle can come of it.
    """
    ambiguous = np.zeros_like(mask)
    for one, two in ((0, 1), (0, 2), (1, 2)):
        views = {}
        for at in ((0, 0), (0, 1), (1, 0), (1, 1)):
            cut = [slice(None)] * 3
            cut[one], cut[two] = (slice(1, None) if step else slice(None, -1) for step in at)
            views[at] = tuple(cut)
        a, b, c, d = (mask[views[at]] for at in views)
        crossed = (a == d) & (b == c) & (a != b)
        for view in views.values():
            ambiguous[view] |= crossed
    patches: list[_Patch] = []
    for group in _connected(ambiguous, "filled"):
        window = mask[_window(mask, group, MARGIN)]
        if _euler(window, UNBIASED) == _euler(window, JOINED):
            continue
        outside = group.places[~mask[tuple(group.places.astype(np.int64).T)]]
        patches += [_Patch("filled", place[None], 1) for place in outside]
        patches.append(_Patch("filled", outside, len(outside)))
    return patches


def _connected(voxels: Bools, way: Way) -> list[_Patch]:
    numbered, count = ndi.label(voxels, TOUCHING)
    boxes = ndi.find_objects(numbered)
    patches: list[_Patch] = []
    for number in range(count):
        box = boxes[number]
        places = np.argwhere(numbered[box] == number + 1) + [side.start for side in box]
        patches.append(_Patch(way, places.astype(np.float64), len(places)))
    return patches


def _window(mask: Bools, patch: _Patch, margin: int) -> tuple[slice, ...]:
    """The patch's bounding box with a margin, within the mask."""
    places = patch.places.astype(np.int64)
    low = np.maximum(places.min(axis=0) - margin, 0)
    high = np.minimum(places.max(axis=0) + margin + 1, mask.shape)
    return tuple(slice(a, b) for a, b in zip(low, high, strict=True))


def _flip(mask: Bools, patch: _Patch) -> None:
    """Give the patch's voxels, all of them on one side, to the other one."""
    at = tuple(patch.places.astype(np.int64).T)
    mask[at] = ~mask[at]


def _euler(window: Bools, background: float) -> int:
    """Of the surface in a window; what its cut rim adds is the same while the window's outer voxels are."""
    if not window.any() or window.all():
        return 0
    vertices, faces = marching(window, background)
    ends = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges = np.unique(ends[:, 0].astype(np.int64) * len(vertices) + ends[:, 1])
    return len(vertices) - len(edges) + len(faces)


def _gain(mask: Bools, patch: _Patch, background: float) -> int:
    """How many handles the surface has less with the patch applied; 0 where its voxels have changed meanwhile."""
    if (mask[tuple(patch.places.astype(np.int64).T)] == (patch.way == "filled")).any():
        return 0
    window = _window(mask, patch, MARGIN)
    before = _euler(mask[window], background)
    _flip(mask, patch)
    after = _euler(mask[window], background)
    _flip(mask, patch)
    return (after - before) // 2


def _stays_whole(mask: Bools, patch: _Patch) -> bool:
    """Whether object and background are still in one piece each with the patch applied."""
    _flip(mask, patch)
    whole = ndi.label(mask, TOUCHING)[1] == 1 and ndi.label(~mask)[1] == 1
    _flip(mask, patch)
    return whole


def _apply(mask: Bools, patch: _Patch, background: float) -> None:
    """The patch, then its rim evened out around it, so that neither a thin sheet nor stubs stay behind."""
    _flip(mask, patch)
    reach = int(np.ceil(np.ptp(patch.places, axis=0).max() / 2)) + 1
    window = _window(mask, patch, reach + MARGIN)
    evened = mask[window].astype(np.uint8)
    inner = tuple(slice(MARGIN - 1, size - MARGIN + 1) for size in evened.shape)
    even_out(evened[inner], int(patch.way == "filled"), reach)
    if _euler(evened > 0, background) == _euler(mask[window], background):
        mask[window] = evened > 0
