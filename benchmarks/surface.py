"""Time and memory of reading a large label volume and taking one object's surface, format by format.

A synthetic volume of 512³ voxels with 216 labels is written to a temporary folder. Every measurement is a process of
its own, so that its peak of memory is its own; the baseline, in the same run, is the plain way: the whole array read,
one mask of it, marching cubes of scikit-image on that mask.

    python benchmarks/surface.py
"""

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import mrcfile
import nibabel as nib
import nrrd
import numpy as np
import tifffile

FORMATS = ("labels.npy", "labels.mrc", "labels.nii", "labels.nii.gz", "labels.tif", "labels.nrrd")
RESULTS = Path(__file__).parent / "results" / "surface.json"
LABEL = 108  # the largest, at the end of the volume: its surface is closed there, the plain one is not


def labels(size: int) -> np.ndarray:
    """(z, y, x): six ellipsoids to an axis, the one of LABEL twice as large as the others."""
    values = np.zeros((size, size, size), np.uint16)
    rng = np.random.default_rng(0)
    step = size / 6
    cells = [(i, j, k) for i in range(6) for j in range(6) for k in range(6)]
    for label, cell in sorted(enumerate(cells, 1), key=lambda pair: pair[0] == LABEL):
        centre, radii = (np.array(cell) + 0.5) * step, rng.uniform(0.3, 0.45, 3) * step * (2 if label == LABEL else 1)
        low, high = np.maximum(centre - radii, 0).astype(int), np.minimum(centre + radii + 2, size).astype(int)
        z, y, x = np.ogrid[tuple(slice(a, b) for a, b in zip(low, high, strict=True))]
        inside = sum(((at - c) / r) ** 2 for at, c, r in zip((z, y, x), centre, radii, strict=True)) < 1
        values[low[0] : high[0], low[1] : high[1], low[2] : high[2]][inside] = label
    return values


def write(folder: Path, values: np.ndarray) -> None:
    """The volume in every format."""
    np.save(folder / "labels.npy", values)
    with mrcfile.new(folder / "labels.mrc") as file:
        file.set_data(values)
    image = nib.Nifti1Image(values.T, np.eye(4))
    nib.save(image, folder / "labels.nii")
    nib.save(image, folder / "labels.nii.gz")
    tifffile.imwrite(folder / "labels.tif", values)
    nrrd.write(str(folder / "labels.nrrd"), values.T, {"encoding": "raw"})


def drkid_way(path: Path) -> int:
    """Faces of the label's surface, cleaned."""
    from drkid.pipeline import read_surface  # noqa: PLC0415 — in the measured process alone
    from drkid.spec import KitSpec  # noqa: PLC0415

    return len(read_surface(path, KitSpec(label=LABEL)).mesh.faces)


def plain_way(path: Path) -> int:
    """Faces of marching cubes on the mask of the whole array, nothing cleaned."""
    from skimage.measure import marching_cubes  # noqa: PLC0415

    return len(marching_cubes((np.load(path) == LABEL).astype(float), 0.5)[1])


def measured(way: str, path: Path) -> dict[str, float]:
    """Seconds and peak memory of one way in a process of its own, imports and compilation left out of the time."""
    command = [sys.executable, __file__, "--way", way, "--file", str(path)]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def run_one(way: str, path: Path) -> None:
    """What a measuring process does."""
    if way == "drkid":
        small = path.parent / "small.npy"
        np.save(small, np.pad(np.full((9, 9, 9), LABEL, np.uint16), 4))
        drkid_way(small)  # imports
    start, cpu = time.perf_counter(), time.process_time()
    faces = drkid_way(path) if way == "drkid" else plain_way(path)
    seconds, cpu = time.perf_counter() - start, time.process_time() - cpu
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024**2
    print(
        json.dumps(
            {"seconds": round(seconds, 2), "cpu_seconds": round(cpu, 2), "peak_gb": round(peak, 2), "faces": faces}
        )
    )


def main() -> None:
    """Print the table and write the results."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", type=int, default=512)
    parser.add_argument("--way", choices=("drkid", "plain"))
    parser.add_argument("--file", type=Path)
    given = parser.parse_args()
    if given.way:
        run_one(given.way, given.file)
        return
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write(folder, labels(given.size))
        measured("drkid", folder / "labels.npy")  # fills the cache of compiled loops
        plain = measured("plain", folder / "labels.npy")
        rows = {"plain marching cubes, .npy": plain}
        rows |= {form.removeprefix("labels"): measured("drkid", folder / form) for form in FORMATS}
    print(f"{'way':<28} {'seconds':>8} {'of plain':>9} {'CPU s':>7} {'peak GB':>8} {'of plain':>9} {'faces':>8}")
    for way, row in rows.items():
        row["time_ratio"] = round(row["seconds"] / plain["seconds"], 3)
        row["memory_ratio"] = round(row["peak_gb"] / plain["peak_gb"], 3)
        print(
            f"{way:<28} {row['seconds']:>8.2f} {row['time_ratio']:>9.2f} {row['cpu_seconds']:>7.2f} "
            f"{row['peak_gb']:>8.2f} {row['memory_ratio']:>9.2f} {row['faces']:>8}"
        )
    RESULTS.write_text(json.dumps({"size": given.size, "label": LABEL, "rows": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main()
