"""The paper's table, row by row, beside what the pressure solver reaches here.

For each row the same number of faces and classes on the nearest real shape of the open data. The solver is asked for
the paper's own T, and stops where it reaches it. Prints one table and writes results/paper_table.json.

    python benchmarks/paper_table.py [--rows M4,M9] [--iterations 20000]
"""

import argparse
import json
import time
import tomllib
from pathlib import Path

from real_shapes import LABELS, require_data

from drkid.congruence import decompose
from drkid.kit import Decomposition, Distance
from drkid.metrics import surface_distances
from drkid.pipeline import read_surface
from drkid.remesh import simplify
from drkid.spec import KitSpec

HERE = Path(__file__).parent
PAPER_TABLE = HERE.parent / "src" / "drkid" / "report" / "paper_table.toml"
HEAD = (
    f"{'model':<22}{'':<7}{'F':>5}{'k':>4}{'T %':>8}{'mean %':>8}  "
    f"{'dH(Mi,Ms)':<11}  {'dH(Ms,Mf)':<11}  {'dH(Mi,Mf)':<11}{'s':>7}{'iter.':>8}"
)


def our_row(row: dict, folder: Path, iterations: int) -> dict:
    """The pressure solver on the row's shape; T is the largest error that was reached."""
    spec = KitSpec(
        method="pressure",
        faces=row["faces_simplified"],
        classes=row["classes"],
        tolerance_percent=row["tolerance_percent"],
        label=LABELS.get(row["shape"]),
        max_iterations=iterations,
    )
    surface = read_surface(folder / row["shape"], spec)
    simplified = simplify(surface, spec).mesh
    start = time.perf_counter()
    found = decompose(simplified, spec)
    seconds = time.perf_counter() - start
    distances = surface_distances(surface.mesh, simplified, found.mesh)
    return figures(found, distances, seconds) | {"shape": row["shape"]}


def figures(found: Decomposition, distances: tuple[Distance, ...], seconds: float) -> dict:
    """The columns of the paper's table."""
    percent = 100 / found.mesh.mean_edge
    pairs = [[d.mean_percent, d.max_percent] for d in distances]
    return {
        "faces_final": len(found.mesh.faces),
        "classes": len(found.class_lengths),
        "tolerance_percent": float(found.face_errors.max()) * percent,
        "error_mean_percent": float(found.face_errors.mean()) * percent,
        "surface_simplified_percent": pairs[0],
        "simplified_assembled_percent": pairs[1],
        "surface_assembled_percent": pairs[2],
        "seconds": seconds,
        "iterations": found.iterations,
        "outcome": found.outcome.status,
    }


def line(model: str, who: str, row: dict) -> str:
    """One printed row."""
    pairs = (
        row[name]
        for name in ("surface_simplified_percent", "simplified_assembled_percent", "surface_assembled_percent")
    )
    distances = "  ".join(f"{mean:.2f}/{most:<6.2f}" for mean, most in pairs)
    return (
        f"{model:<22}{who:<7}{row['faces_final']:>5}{row['classes']:>4}{row['tolerance_percent']:>8.2f}"
        f"{row['error_mean_percent']:>8.3f}  {distances}{row['seconds']:>7.1f}{row['iterations']:>8}"
    )


def main() -> None:
    """Run the rows that were asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", help="names of rows, comma-separated; all when not given")
    parser.add_argument("--iterations", type=int, default=20000, help="most iterations of the solver")
    options = parser.parse_args()
    folder = require_data()
    rows = tomllib.loads(PAPER_TABLE.read_text())["row"]
    chosen = set(options.rows.split(",")) if options.rows else {row["model"] for row in rows}
    small = simplify(read_surface(None, KitSpec()), KitSpec(faces=40)).mesh
    decompose(small, KitSpec(method="pressure", max_iterations=10))  # compiles
    print(HEAD)
    results = []
    for row in rows:
        if row["model"] not in chosen:
            continue
        ours = our_row(row, folder, options.iterations)
        print(line(row["model"], "paper", row))
        print(line(f"  {row['shape'].split('.')[0][:20]}", "drkid", ours), flush=True)
        results.append({"paper": row, "drkid": ours})
    (HERE / "results").mkdir(exist_ok=True)
    (HERE / "results" / "paper_table.json").write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
