"""Voxels: which of them are inside, and the connected components that they form.

Objects are 26-connected, so the background is 6-connected (Kong and Rosenfeld, "Digital topology", 1989).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import starmap
from typing import Any

import numpy as np
import scipy.ndimage as ndi
from numba import njit
from numpy.typing import NDArray
from skimage.filters import threshold_otsu

from drkid.errors import InputError, SpecError
from drkid.kit import LabelVolume
from drkid.mesh import Bools
from drkid.spec import KitSpec

Voxels = NDArray[Any]
Box = tuple[slice, slice, slice]

PADDING = 3  # voxels of background around an object: the reach of the smoothing
FEWEST_VOXELS = 27  # a cube of 3: below it there is no shape, only staircase
SLAB_VOXELS = 1 << 24
LARGEST_TABLE = 1 << 22  # labels up to here are counted in a table, larger ones by sorting


# ---- what a volume holds


def slabs(values: Voxels) -> Iterator[Voxels]:
    """Views that cover the volume one after the other, so that no temporary is as large as the volume."""
    axis = int(np.argmax(values.strides))
    depth = max(1, SLAB_VOXELS // max(1, values.size // values.shape[axis]))
    for start in range(0, values.shape[axis], depth):
        yield values[(slice(None),) * axis + (slice(start, start + depth),)]


def label_counts(values: Voxels) -> dict[int, int]:
    """Voxels of each positive label, in ascending order of the labels."""
    counts: dict[int, int] = {}
    for slab in slabs(values):
        table = np.zeros(LARGEST_TABLE + 1, np.int64)
        if _tabulated(_in_memory_order(slab), table):
            found = np.flatnonzero(table)
            voxels = table[found]
        else:
            found, voxels = np.unique(slab[slab > 0], return_counts=True)
        for label, count in zip(found.tolist(), voxels.tolist(), strict=True):
            counts[int(label)] = counts.get(int(label), 0) + count
    return dict(sorted(counts.items()))


def _in_memory_order(values: Voxels) -> Voxels:
    """The same voxels, the axis of the longest stride first: how a loop should walk through them."""
    plain = np.asarray(values).view(np.uint8) if values.dtype.kind == "b" else np.asarray(values)
    return plain.transpose(np.argsort([-abs(stride) for stride in plain.strides], kind="stable"))


@njit(cache=True)
def _tabulated(values: Voxels, table: NDArray[np.int64]) -> bool:
    """Add to the table the voxels of each positive label; False as soon as a label is beyond it."""
    for i in range(values.shape[0]):
        for j in range(values.shape[1]):
            for k in range(values.shape[2]):
                label = int(values[i, j, k])
                if label > 0:
                    if label >= table.size:
                        return False
                    table[label] += 1
    return True


def label_box(values: Voxels, label: int) -> Box:
    """The smallest box that holds every voxel of a label that is there; one pass, no mask of the whole volume."""
    order = np.argsort([-abs(stride) for stride in values.strides], kind="stable")
    ends = np.empty((3, 2), np.int64)
    _bounded(_in_memory_order(values), label, ends)
    sides = [slice(0)] * 3
    for axis, (low, high) in zip(order.tolist(), ends.tolist(), strict=True):
        sides[axis] = slice(low, high + 1)
    return sides[0], sides[1], sides[2]


def label_boxes(values: Voxels, labels: list[int]) -> list[Box]:
    """The box of each of the labels, ascending, in one pass where none is beyond the table."""
    if not labels or labels[-1] > LARGEST_TABLE:
        return [label_box(values, label) for label in labels]
    order = np.argsort([-abs(stride) for stride in values.strides], kind="stable")
    rank = np.full(labels[-1] + 1, -1, np.int32)
    rank[labels] = np.arange(len(labels))
    ends = np.empty((len(labels), 3, 2), np.int64)
    _all_bounded(_in_memory_order(values), rank, ends)
    back = np.argsort(order)
    boxes = [[slice(int(low), int(high) + 1) for low, high in one[back]] for one in ends]
    return [(x, y, z) for x, y, z in boxes]


@njit(cache=True)
def _all_bounded(values: Voxels, rank: NDArray[np.int32], ends: NDArray[np.int64]) -> None:
    """Write the first and last index of each ranked label along each axis."""
    ends[:, :, 0] = values.size
    ends[:, :, 1] = -1
    for at in np.ndindex(values.shape):
        label = int(values[at])
        if 0 < label < rank.size and rank[label] >= 0:
            one = ends[rank[label]]
            for axis in range(3):
                one[axis, 0] = min(one[axis, 0], at[axis])
                one[axis, 1] = max(one[axis, 1], at[axis])


@njit(cache=True)
def _bounded(values: Voxels, label: int, ends: NDArray[np.int64]) -> None:
    """Write the first and last index of the label along each axis."""
    ends[:, 0] = values.size
    ends[:, 1] = -1
    for i in range(values.shape[0]):
        for j in range(values.shape[1]):
            first, last = -1, -1
            for k in range(values.shape[2]):
                if values[i, j, k] == label:
                    first = k if first < 0 else first
                    last = k
            if first >= 0:
                ends[0, 0], ends[0, 1] = min(ends[0, 0], i), max(ends[0, 1], i)
                ends[1, 0], ends[1, 1] = min(ends[1, 0], j), max(ends[1, 1], j)
                ends[2, 0], ends[2, 1] = min(ends[2, 0], first), max(ends[2, 1], last)


def otsu_threshold(values: Voxels) -> float:
    """The density that best parts the histogram in two (Otsu, 1979).

    Raises:
        InputError: all voxels are the same.
    """
    low, high = float(values.min()), float(values.max())
    if low == high:
        raise InputError("all voxels of the volume have the same value", found=f"{low:g} everywhere")
    return float(threshold_otsu(np.asarray(values)))


def bounding_box(mask: Bools) -> Box | None:
    """The smallest box that holds every voxel inside; None where there is none."""
    ranges: list[slice] = []
    for axis in range(3):
        used = np.flatnonzero(mask.any(axis=tuple(other for other in range(3) if other != axis)))
        if not used.size:
            return None
        ranges.append(slice(int(used[0]), int(used[-1]) + 1))
    return ranges[0], ranges[1], ranges[2]


# ---- which voxels are inside


@dataclass(frozen=True, eq=False)
class Foreground:
    """The voxels that count as inside: `mask` is cropped to `box` of a volume of `shape`.

    `soft` says that the values around the threshold carry the surface to less than a voxel.
    """

    mask: Bools
    box: Box
    shape: tuple[int, ...]
    soft: bool = False
    label: int | None = None
    threshold: float | None = None
    notes: tuple[str, ...] = ()


def foreground(volume: LabelVolume, spec: KitSpec) -> Foreground:
    """The label's voxels, or those at and above the threshold.

    A given `spec.label` or `spec.threshold` decides how an integer volume is read, whatever its `kind`.

    Raises:
        SpecError: label and threshold contradict each other or the volume.
        InputError: no voxel is inside, or all of a density are.
    """
    if spec.label is not None and spec.threshold is not None:
        raise SpecError("label and threshold are both given", remedy="a label volume has labels, a density a threshold")
    integral = volume.values.dtype.kind in "iub"
    if spec.label is not None and not integral:
        raise SpecError(
            "label is for label volumes", found=f"a density, {volume.values.dtype}", remedy="--threshold, not --label"
        )
    if spec.label is not None or (volume.kind != "density" and spec.threshold is None):
        return _of_label(volume, spec)
    return _of_threshold(volume, spec)


def _of_label(volume: LabelVolume, spec: KitSpec) -> Foreground:
    counts = label_counts(volume.values)
    if not counts:
        raise InputError(
            f"{volume.name} holds no object",
            wanted="voxels above 0",
            found="none" if not volume.values.any() else "only 0 and negative values",
            remedy="check that the segmentation was saved, not an empty layer",
        )
    label = spec.label if spec.label is not None else max(counts, key=lambda known: counts[known])
    if label not in counts:
        raise InputError(
            f"{volume.name} has no label {label}", wanted="a label that is there", found=_abbreviated(counts)
        )
    notes: tuple[str, ...] = ()
    if len(counts) > 1 and spec.label is None:
        notes = (f"label {label} taken, the largest of {len(counts)} ({counts[label]} voxels)",)
    box = label_box(volume.values, label)
    return Foreground(np.asarray(volume.values[box] == label), box, volume.values.shape, label=label, notes=notes)


def _abbreviated(counts: dict[int, int], most: int = 12) -> str:
    shown = sorted(counts, key=lambda label: -counts[label])[:most]
    text = ", ".join(f"{label} ({counts[label]} voxels)" for label in shown)
    return text + (f" and {len(counts) - most} smaller ones" if len(counts) > most else "")


def _of_threshold(volume: LabelVolume, spec: KitSpec) -> Foreground:
    values: Voxels = volume.values
    low, high = float(values.min()), float(values.max())
    threshold, notes = spec.threshold, ()
    if threshold is None:
        threshold = otsu_threshold(values)
        notes = (f"threshold {threshold:.6g} chosen by Otsu's method (densities from {low:.6g} to {high:.6g})",)
    if not low < threshold <= high:
        raise InputError(
            f"threshold {threshold:g} leaves " + ("nothing inside" if threshold > high else "nothing outside"),
            wanted="a density between the lowest and the highest",
            found=f"{low:.6g} to {high:.6g}",
            remedy="--threshold, or leave it out for Otsu's",
        )
    soft = volume.kind != "mask"
    return _cropped(volume, values >= threshold, soft=soft, threshold=threshold, notes=notes)


def _cropped(
    volume: LabelVolume,
    mask: Bools,
    *,
    soft: bool = False,
    threshold: float | None = None,
    notes: tuple[str, ...] = (),
) -> Foreground:
    box = bounding_box(mask) or (slice(0), slice(0), slice(0))
    return Foreground(mask[box].copy(), box, volume.values.shape, soft, None, threshold, notes)


# ---- the components that they form


@dataclass(frozen=True, eq=False)
class Components:
    """Components by size, largest first: `number[i]` in `numbered` has `voxels[i]` voxels within `boxes[i]`."""

    numbered: NDArray[np.int32]
    number: tuple[int, ...]
    voxels: tuple[int, ...]
    boxes: tuple[Box, ...]


def components(mask: Bools) -> Components:
    """The 26-connected components of a mask; equal sizes in the order of the scan."""
    numbered = np.empty(mask.shape, np.int32)
    ndi.label(mask, np.ones((3, 3, 3)), output=numbered)
    sizes = np.bincount(numbered.ravel(order="K"))[1:]
    order = np.argsort(-sizes, kind="stable")
    boxes = ndi.find_objects(numbered)
    return Components(
        numbered,
        tuple((order + 1).tolist()),
        tuple(sizes[order].tolist()),
        tuple(boxes[index] for index in order),
    )


@dataclass(frozen=True, eq=False)
class VoxelObject:
    """One component, cavities filled, in a `mask` with PADDING voxels of background on every side.

    `origin` is the volume's index of the mask's first voxel (negative where the padding sticks out);
    `border` names the ends of the volume that the object touches; `voxels` counts without the cavities.
    """

    mask: Bools
    origin: tuple[int, int, int]
    voxels: int
    cavities: int
    border: tuple[str, ...]


def voxel_object(inside: Foreground, found: Components, rank: int) -> VoxelObject:
    """The component of a rank, 0 being the largest."""
    box = found.boxes[rank]
    mask = np.pad(found.numbered[box] == found.number[rank], PADDING)
    outside = np.empty(mask.shape, np.int32)
    cavities = int(ndi.label(~mask, output=outside)) - 1
    filled = outside != outside[0, 0, 0]
    start = [outer.start + inner.start for outer, inner in zip(inside.box, box, strict=True)]
    stop = [outer.start + inner.stop for outer, inner in zip(inside.box, box, strict=True)]
    border = [f"{axis} low" for axis, at in zip("xyz", start, strict=True) if at == 0]
    border += [f"{axis} high" for axis, at, size in zip("xyz", stop, inside.shape, strict=True) if at == size]
    origin = (start[0] - PADDING, start[1] - PADDING, start[2] - PADDING)
    return VoxelObject(filled, origin, found.voxels[rank], cavities, tuple(border))


def chosen_component(found: Components, spec: KitSpec) -> int:
    """The rank of the component to take.

    Raises:
        InputError: there are fewer components, or the component is a speck.
    """
    rank = (spec.component or 1) - 1
    if rank >= len(found.voxels):
        raise InputError(
            f"there is no component {rank + 1}",
            wanted=f"1 to {len(found.voxels)}",
            found=", ".join(starmap("{} ({} voxels)".format, enumerate(found.voxels[:12], 1))),
        )
    if found.voxels[rank] < FEWEST_VOXELS:
        raise InputError(
            f"component {rank + 1} is too small to have a shape",
            wanted=f"{FEWEST_VOXELS} voxels at least",
            found=f"{found.voxels[rank]} voxel{'s' * (found.voxels[rank] > 1)}",
            remedy="another --label, --threshold or --component, or a finer volume",
        )
    return rank
