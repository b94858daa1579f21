"""The palette solver beside the pressure solver on the same simplified meshes of real shapes, in one run.

For each shape, number of faces, palette and seed: exact or T, distances and dihedral angles beside those of M_s, the
time to the first exact mesh, peak memory. The pressure solver runs until it stalls on the same M_s with the same number
of classes; `ratio` is the time in which the palette solver was as exact, in that of the pressure solver. Each row is a
process of its own, so that its peak memory is its own. Prints tables and writes results/congruence.json.

    python benchmarks/congruence.py            the standard table, about 40 minutes on two cores
    python benchmarks/congruence.py --full     every shape at every size
    python benchmarks/congruence.py --resume   goes on with the rows that are not in the results yet
    python benchmarks/congruence.py --faces 172 --palettes 2,universal --seeds 0 --shapes golgi_vesicle.mrc
"""

import argparse
import json
import multiprocessing
import resource
import time
import tomllib
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import numpy as np
from real_shapes import LABELS, require_data

from drkid.congruence import decompose
from drkid.congruence.palette_solver import PaletteSolver, default_seconds
from drkid.congruence.solver import Candidate
from drkid.intersection import self_intersections
from drkid.measure import Dihedral, dihedral
from drkid.mesh import TriMesh
from drkid.metrics import surface_distances
from drkid.pipeline import read_surface
from drkid.remesh import simplify
from drkid.spec import UNIVERSAL, KitSpec

HERE = Path(__file__).parent
PAPER_TABLE = HERE.parent / "src" / "drkid" / "report" / "paper_table.toml"
SHAPES = (
    "urocell_mito_bean.nii.gz",
    "urocell_mito_elongated.nii.gz",
    "wtc11_nucleus.ome.tif",
    "cells3d_nuclei_labels.ome.tif",
    "golgi_vesicle.mrc",
    "emdb_soft_mask.map",
    "celegans_embryo_cell.ply",
    "asteroid_itokawa.obj",
    "spot_uv_seams.obj",
)
FEW = ("urocell_mito_bean.nii.gz", "golgi_vesicle.mrc", "asteroid_itokawa.obj")
SECONDS = {250: 20.0, 500: 60.0, 2000: 60.0, 5000: 150.0}  # else 10; universal 20, one class 30
STALLS_BELOW_PERCENT = 1e-6  # the tolerance at which the pressure solver goes on until it stalls


@dataclass(frozen=True)
class Run:
    """One row: `palette` is a number of classes, or 0 for the universal pair of lengths."""

    shape: str
    faces: int
    palette: int
    seed: int
    seconds: float

    @property
    def spec(self) -> KitSpec:
        """Its parameters."""
        kind = {"classes": self.palette} if self.palette else {"palette": UNIVERSAL}
        common = {"faces": self.faces, "seed": self.seed, "seconds": self.seconds, "label": LABELS.get(self.shape)}
        return KitSpec.parse(common | kind)


def seconds_for(faces: int, palette: int) -> float:
    """The time that the goals give such a row."""
    if faces <= 172:
        return {0: 20.0, 1: 30.0}.get(palette, 10.0)
    return SECONDS.get(faces, default_seconds(faces))


def standard(full: bool) -> list[Run]:
    """The rows of the standard table, or of the full one."""

    def rows(shapes: tuple[str, ...], faces: int, palettes: tuple[int, ...], seeds: int = 1) -> list[Run]:
        return [
            Run(shape, faces, k, seed, seconds_for(faces, k))
            for shape in shapes
            for k in palettes
            for seed in range(seeds)
        ]

    few = SHAPES if full else FEW
    runs = rows(SHAPES, 172, (2, 4, 10, 0), 2)
    runs += rows(SHAPES if full else FEW[:1], 116, (1, 2), 2)
    for faces in (250, 500):
        runs += rows(few, faces, (2, 3, 4, 10))
    for faces in (2000, 5000):
        runs += rows(few if full else FEW[:1], faces, (4, 10))
    return sorted(runs, key=lambda run: run.faces == 500 and run.shape != FEW[0])  # the longest last


def measured(run: Run, *, beside: bool) -> dict:
    """One row; `beside` runs the pressure solver too."""
    warm = simplify(read_surface(None, KitSpec()), KitSpec(faces=60)).mesh
    for method in ("palette", "pressure"):  # loads what is compiled
        decompose(warm, KitSpec(method=method, classes=2, rounds=1, max_iterations=10))
    spec = run.spec
    surface = read_surface(require_data() / run.shape, spec)
    remeshed = simplify(surface, spec)
    simplified = remeshed.mesh
    found, curve = searched(PaletteSolver(spec, remeshed.target), simplified)
    row = {
        "shape": run.shape,
        "palette": run.palette or "universal",
        "seed": run.seed,
        "asked_faces": run.faces,
        "peak_memory_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        "curve": curve,
        **figures(surface.mesh, simplified, found),
    }
    row |= {
        "exact": curve[-1]["exact"],
        "seconds": curve[-1]["seconds"],
        "first_exact_seconds": next((at["seconds"] for at in curve if at["exact"]), None),
        "simplified_dihedral": angles(dihedral(simplified)),
    }
    if beside and run.palette:
        row["pressure"] = pressed(surface.mesh, simplified, run, curve)
    return row


def searched(solver: PaletteSolver, simplified: TriMesh) -> tuple[Candidate, list[dict]]:
    """The best mesh, and what was known when."""
    began = time.perf_counter()
    state = solver.init(simplified)
    curve = []
    while True:
        quality = state.found.quality
        now = {
            "seconds": round(time.perf_counter() - began, 3),
            "exact": state.found.exact,
            "error_max_percent": state.best.percent,
            "distance_percent": [round(quality.mean_percent, 4), round(quality.max_percent, 4)],
            "dihedral_p95_degrees": round(quality.p95_degrees, 2),
        }
        if not curve or any(now[name] != curve[-1][name] for name in now if name != "seconds"):
            curve.append(now)
        if solver.finished(state) is not None:
            break
        state = solver.step(state)
    curve.append(now)
    return state.best, curve


def figures(surface: TriMesh, simplified: TriMesh, found: Candidate) -> dict:
    """What stands in a row of either solver."""
    _, near, far = surface_distances(surface, simplified, found.mesh)
    return {
        "faces": len(found.mesh.faces),
        "error_max_percent": found.percent,
        "simplified_assembled_percent": [near.mean_percent, near.max_percent],
        "surface_assembled_percent": [far.mean_percent, far.max_percent],
        "dihedral": angles(dihedral(found.mesh)),
        "self_intersections": len(self_intersections(found.mesh)),
    }


def angles(found: Dihedral) -> list[float]:
    """Mean and 95th percentile in degrees, concave edges in percent."""
    return [found.mean_degrees, found.p95_degrees, found.concave_percent]


def pressed(surface: TriMesh, simplified: TriMesh, run: Run, curve: list[dict]) -> dict:
    """The pressure solver until it stalls, and in what part of its time the palette solver was as exact."""
    spec = KitSpec(method="pressure", classes=run.palette, seed=run.seed, tolerance_percent=STALLS_BELOW_PERCENT)
    began = time.perf_counter()
    found = decompose(simplified, spec, surface=surface)
    seconds = time.perf_counter() - began
    error = 100 * float(found.face_errors.max()) / found.mesh.mean_edge
    candidate = Candidate(found.mesh, found.face_class, found.class_lengths, float(found.face_errors.max()))
    as_exact = next((at["seconds"] for at in curve if at["error_max_percent"] <= error), None)
    return figures(surface, simplified, candidate) | {
        "seconds": seconds,
        "ratio": None if as_exact is None else as_exact / seconds,
    }


def line(r: dict) -> str:
    """One printed row."""
    near, far = ("{:.2f}/{:.2f}".format(*r[n]) for n in ("simplified_assembled_percent", "surface_assembled_percent"))
    mean, p95, concave = (
        f"{own:.0f} ({before:.0f})" for own, before in zip(r["dihedral"], r["simplified_dihedral"], strict=True)
    )
    first = "-" if r["first_exact_seconds"] is None else f"{r['first_exact_seconds']:.1f}"
    beside = r.get("pressure")
    ratio = "" if beside is None else f"T {beside['error_max_percent']:.2g} in {beside['seconds']:.1f} s"
    if beside is not None and beside["ratio"] is not None:
        ratio += f", ratio 1/{1 / beside['ratio']:.1f}"
    return (
        f"{r['shape'].split('.', maxsplit=1)[0][:22]:<23}{r['faces']:>5}{r['palette']:>10}{r['seed']:>5}"
        f"{'exact' if r['exact'] else format(r['error_max_percent'], '.2g'):>8}  {near:<10} {far:<10} {mean:<8}{p95:<9}"
        f"{concave:<8}{r['self_intersections']:>4}{first:>7}{r['seconds']:>7.1f}{r['peak_memory_mb']:>6.0f}  {ratio}"
    )


HEAD = (
    f"{'shape':<23}{'F':>5}{'palette':>10}{'seed':>5}{'T %':>8}  {'dH(Ms,Mf)':<10} {'dH(Mi,Mf)':<10} {'dihedral':<8}"
    f"{'p95':<9}{'concave':<8}{'cuts':>4}{'first':>7}{'s':>7}{'MB':>6}  pressure solver"
)


def summary(rows: list[dict]) -> None:
    """Medians by faces and palette."""
    for faces, palette in sorted({(r["faces"], str(r["palette"])) for r in rows}):
        some = [r for r in rows if (r["faces"], str(r["palette"])) == (faces, palette)]
        near = np.median([r["simplified_assembled_percent"] for r in some], axis=0)
        excess = median(r["dihedral"][1] - r["simplified_dihedral"][1] for r in some)
        first = [r["first_exact_seconds"] for r in some if r["first_exact_seconds"] is not None]
        print(
            f"F {faces:<5} palette {palette:<10} exact {len(first)} of {len(some)}"
            f"  first {f'{median(first):.1f} s' if first else '-':<8}"
            f" T {median(r['error_max_percent'] for r in some):.2g} % (largest "
            f"{max(r['error_max_percent'] for r in some):.2g})  d_H(Ms,Mf) {near[0]:.2f}/{near[1]:.2f}"
            f"  p95 {excess:+.1f}°  cuts {sum(r['self_intersections'] for r in some)}"
            f"  s {median(r['seconds'] for r in some):.1f}"
        )


def paper() -> None:
    """The paper's own rows, for comparison."""
    for row in tomllib.loads(PAPER_TABLE.read_text())["row"]:
        near = "{:.2f}/{:.2f}".format(*row["simplified_assembled_percent"])
        size = f"F {row['faces_final']:<5} k {row['classes']:<3} T {row['tolerance_percent']:.2f} %"
        print(f"paper {row['model']:<4} {size}  d_H(Ms,Mf) {near}  {row['seconds']:.0f} s")


def names(text: str) -> list[int]:
    """Numbers of classes between commas; 0 for universal."""
    return [0 if part == "universal" else int(part) for part in text.split(",")]


def main() -> None:
    """Run what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--full", action="store_true")
    parser.add_argument("--faces", type=names)
    parser.add_argument("--palettes", type=names, default=[2])
    parser.add_argument("--seeds", type=names, default=[0])
    parser.add_argument("--seconds", type=float)
    parser.add_argument("--shapes", type=lambda text: text.split(","), default=list(SHAPES))
    parser.add_argument("--resume", action="store_true")
    parser.add_argument("--out", type=Path, default=HERE / "results" / "congruence.json")
    options = parser.parse_args()
    require_data()
    runs = standard(options.full)
    if options.faces:
        runs = [
            Run(shape, faces, k, seed, options.seconds or seconds_for(faces, k))
            for shape in options.shapes
            for faces in options.faces
            for k in options.palettes
            for seed in options.seeds
        ]
    options.out.parent.mkdir(exist_ok=True)
    rows = json.loads(options.out.read_text()) if options.resume and options.out.exists() else []
    done = {(r["shape"], r["asked_faces"], r["palette"], r["seed"]) for r in rows}
    print(HEAD)
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=spawn, max_tasks_per_child=1) as pool:
        for run in runs:
            if (run.shape, run.faces, run.palette or "universal", run.seed) in done:
                continue
            rows.append(pool.submit(measured, run, beside=run.seed == 0).result())
            print(line(rows[-1]), flush=True)
            options.out.write_text(json.dumps(rows, indent=1) + "\n")
    summary(rows)
    paper()


if __name__ == "__main__":
    main()
