"""Labels, mask or density: what the numbers of a volume are."""

import numpy as np

from drkid.kit import VolumeKind
from drkid.voxels import LARGEST_TABLE, Voxels, label_counts, slabs

FEW_LABELS = 3  # up to here the values of an integer volume are taken as labels without a look at neighbours
SAMPLE_VOXELS = 1 << 22
LARGEST_EXACT = 1 << 24  # float32 holds integers exactly up to here


def classified(values: Voxels) -> tuple[Voxels, VolumeKind]:
    """The values, with labels and masks as integers, and what they are.

    Booleans and integers with one positive value are a mask. More positive values are labels where most of them are
    label-like: most face-neighbours (within planes of a sample) of their voxels that are positive have exactly the
    same value. The grey values of a micrograph do not, however few bits they have: they are a density. Floats that
    are all integral are judged like integers, other floats are a density.
    """
    if values.dtype.kind == "f":
        if not _integral(values):
            return values, "density"
        values = values.astype(np.int32)
    if values.dtype.kind == "b":
        return values.astype(np.uint8), "mask"
    counts = label_counts(values)
    if len(counts) <= 1:
        return values, "mask"
    return values, "labels" if len(counts) <= FEW_LABELS or _label_like(values) else "density"


def _integral(values: Voxels) -> bool:
    for slab in slabs(values):
        numbers = np.asarray(slab, np.float64)
        if np.abs(numbers).max() > LARGEST_EXACT or (numbers != np.rint(numbers)).any():
            return False
    return True


def _label_like(values: Voxels) -> bool:
    """At least half of the positive values have mostly neighbours of the same value (none at all does not count)."""
    step = max(1, values.size // SAMPLE_VOXELS)
    sample = values[:, :, ::step] if step < values.shape[2] else values[:, :, values.shape[2] // 2, None]
    here, same = [], []
    for axis in (0, 1):
        one, two = sample.take(range(sample.shape[axis] - 1), axis), sample.take(range(1, sample.shape[axis]), axis)
        both = (one > 0) & (two > 0)
        one, two = one[both], two[both]
        here += [one, two]
        same += [one == two] * 2
    labels = np.concatenate(here)
    if labels.size and labels.max() > LARGEST_TABLE:
        labels = np.unique(labels, return_inverse=True)[1]
    pairs = np.bincount(labels.astype(np.int32))
    equal = np.bincount(labels[np.concatenate(same)].astype(np.int32), minlength=len(pairs))
    return bool((equal > 0.5 * pairs)[pairs > 0].mean() >= 0.5) if len(labels) else True
