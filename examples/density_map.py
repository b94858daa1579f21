"""A density map instead of labels: the threshold decides what is inside.

The map is made here, three soft blobs in a box of 48³ voxels of 4 Å, so that nothing has to be downloaded.

    python examples/density_map.py
"""

import tempfile
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from drkid import KitSpec
from drkid.pipeline import read_surface

BLOBS = (((20, 22, 24), 8.0), ((29, 26, 24), 6.0), ((22, 31, 20), 5.0))  # middle and width in voxels


def main(thresholds: Iterable[float | None] = (None, 0.3, 0.5, 0.7)) -> list[float]:
    """Print extents and volume of the surface at each threshold; None is Otsu's."""
    grid = np.stack(np.meshgrid(*3 * [np.arange(48.0)], indexing="ij"), axis=-1)
    density = sum(np.exp(-((grid - middle) ** 2).sum(axis=-1) / (2 * width**2)) for middle, width in BLOBS)
    volumes: list[float] = []
    print(f"{'threshold':>10}{'extents in Å':>24}{'volume nm³':>12}")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "blobs.npy"
        np.save(path, density)
        for threshold in thresholds:
            surface = read_surface(path, KitSpec(threshold=threshold, spacing=(4, 4, 4), unit="angstrom"))
            extents = " × ".join(f"{x:.0f}" for x in surface.mesh.extents)
            volumes.append(surface.mesh.volume / 1000)
            print(f"{surface.source.threshold:>10.3f}{extents:>24}{volumes[-1]:>12.1f}")
    return volumes


if __name__ == "__main__":
    main()
