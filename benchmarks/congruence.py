"""The palette solver and the pressure solver on the same simplified meshes of real shapes, in one run.

For each shape, number of classes and seed: exact or T, distances, dihedral angles beside those of M_s, seconds. The
pressure solver runs with k = 7 and the paper's T, beside it. Prints one table and writes results/congruence.json.

    python benchmarks/congruence.py [--faces 172] [--classes 2,4,10] [--seeds 0,1] [--seconds 10] [--shapes NAME,...]
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np
from real_shapes import LABELS, require_data

from drkid.congruence import decompose
from drkid.intersection import self_intersections
from drkid.kit import Surface
from drkid.measure import dihedral
from drkid.mesh import TriMesh
from drkid.metrics import surface_distances
from drkid.pipeline import read_surface
from drkid.remesh import simplify
from drkid.spec import KitSpec

HERE = Path(__file__).parent
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
HEAD = (
    f"{'shape':<24}{'solver':<10}{'F':>5}{'k':>4}{'seed':>5}{'exact':>6}{'T %':>9}  "
    f"{'dH(Ms,Mf)':<10} {'dH(Mi,Mf)':<10} {'p95 (M_s)':<12}{'concave':<12}{'cuts':>4}{'s':>7}"
)


def row(surface: Surface, simplified: TriMesh, spec: KitSpec) -> dict:
    """One run and what came of it."""
    start = time.perf_counter()
    found = decompose(simplified, spec, surface=surface.mesh)
    seconds = time.perf_counter() - start
    _, near, far = surface_distances(surface.mesh, simplified, found.mesh)
    angles, own = dihedral(found.mesh), dihedral(simplified)
    return {
        "method": spec.method,
        "faces": len(found.mesh.faces),
        "classes": len(found.class_lengths),
        "seed": spec.seed,
        "exact": "exact:" in found.outcome.message and "not exact" not in found.outcome.message,
        "error_max_percent": 100 * float(found.face_errors.max()) / found.mesh.mean_edge,
        "simplified_assembled_percent": [near.mean_percent, near.max_percent],
        "surface_assembled_percent": [far.mean_percent, far.max_percent],
        "dihedral_p95_degrees": [angles.p95_degrees, own.p95_degrees],
        "concave_percent": [angles.concave_percent, own.concave_percent],
        "self_intersections": len(self_intersections(found.mesh)),
        "seconds": seconds,
    }


def line(shape: str, r: dict) -> str:
    """One printed row."""
    near, far = ("{:.2f}/{:.2f}".format(*r[n]) for n in ("simplified_assembled_percent", "surface_assembled_percent"))
    bend, concave = ("{:.0f} ({:.0f})".format(*r[n]) for n in ("dihedral_p95_degrees", "concave_percent"))
    return (
        f"{shape.split('.', maxsplit=1)[0][:23]:<24}{r['method']:<10}{r['faces']:>5}{r['classes']:>4}{r['seed']:>5}"
        f"{'yes' if r['exact'] else 'no':>6}{r['error_max_percent']:>9.1e}  "
        f"{near:<10} {far:<10} {bend:<12}{concave:<12}{r['self_intersections']:>4}{r['seconds']:>7.1f}"
    )


def numbers(text: str) -> list[int]:
    """Whole numbers between commas."""
    return [int(part) for part in text.split(",")]


def main() -> None:
    """Run what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--faces", type=int, default=172)
    parser.add_argument("--classes", type=numbers, default=[2, 4, 10])
    parser.add_argument("--seeds", type=numbers, default=[0, 1])
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--shapes", type=lambda text: text.split(","), default=list(SHAPES))
    options = parser.parse_args()
    folder = require_data()
    warm = simplify(read_surface(None, KitSpec()), KitSpec(faces=60)).mesh
    for method in ("palette", "pressure"):  # compiles
        decompose(warm, KitSpec(method=method, classes=2, rounds=1, max_iterations=10))
    print(HEAD)
    rows = []
    for shape in options.shapes:
        spec = KitSpec(faces=options.faces, label=LABELS.get(shape), seconds=options.seconds)
        surface = read_surface(folder / shape, spec)
        simplified = simplify(surface, spec).mesh
        runs = [{"method": "palette", "classes": k, "seed": s} for k in options.classes for s in options.seeds]
        runs.append({"method": "pressure", "classes": 7, "seed": options.seeds[0]})
        for run in runs:
            result = row(surface, simplified, spec.model_copy(update=run)) | {"shape": shape}
            print(line(shape, result), flush=True)
            rows.append(result)
    palette = [r for r in rows if r["method"] == "palette"]
    for k in options.classes:
        chosen = [r for r in palette if r["classes"] == k]
        if chosen:
            near = np.median([r["simplified_assembled_percent"] for r in chosen], axis=0)
            exact = sum(r["exact"] for r in chosen)
            print(f"k = {k}: exact {exact} of {len(chosen)}, median d_H(Ms,Mf) {near[0]:.2f}/{near[1]:.2f} %")
    (HERE / "results").mkdir(exist_ok=True)
    (HERE / "results" / "congruence.json").write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
