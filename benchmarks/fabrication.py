"""Kits of real shapes for every process: are they whole, do they go together, and how long do parts and proofs take.

Each of the good shapes with 172 pieces × palette solver with two and with four classes, pressure solver with seven ×
fdm, sla and injection, at the smallest size that fits. Each kit is written, read back and checked by `drkid check`'s
own verification, and by another program where one is given. Prints one table and writes results/fabrication.json,
where rows of other kits stay as they are.

    python benchmarks/fabrication.py                               all 81 kits
    python benchmarks/fabrication.py --shapes golgi_vesicle.mrc --processes sla
    python benchmarks/fabrication.py --checker "python /path/of/a/checker"   also run on every kit folder; 0 is a pass
"""

import argparse
import json
import shlex
import subprocess
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from itertools import product, repeat
from pathlib import Path

from congruence import SHAPES
from real_shapes import LABELS, require_data

import drkid
from drkid.errors import DrkidError
from drkid.verification import verify_kit

HERE = Path(__file__).parent
SOLVERS = {
    "palette 2": {"classes": 2, "rounds": 20},
    "palette 4": {"classes": 4, "rounds": 20},
    "pressure 7": {"method": "pressure", "classes": 7},
}
PROCESSES = ("fdm", "sla", "injection")
LAST_LINES = 12  # of what another checker prints that are kept where it does not pass


def measured(shape: str, solver: str, process: str, checker: str | None, folder: Path) -> dict:
    """One kit: figures, what does not pass, seconds."""
    spec = drkid.KitSpec.parse(
        {"faces": 172, "process": process, "fit": True, "label": LABELS.get(shape), **SOLVERS[solver]}
    )
    row = {"shape": shape, "solver": solver, "process": process}
    try:
        kit = drkid.make_kit(require_data() / shape, spec)
    except DrkidError as error:
        return row | {"refused": str(error)}
    began = time.perf_counter()
    kit.write(folder)
    written = time.perf_counter() - began
    metrics, seconds = kit.metrics, kit.metrics.seconds
    row |= {
        "size_mm": round(float(kit.decomposition.mesh.extents.max()), 1),
        "mean_edge_mm": round(metrics.mean_edge, 1),
        "moulds": metrics.unique_piece_parts,
        "groove_mm": [round(metrics.groove_mean_mm, 2), round(metrics.groove_max_mm, 2)],
        "error_max_percent": metrics.error_max_percent,
        "verdict": metrics.assembly.closure.verdict,
        "unmet": sorted({f"{f.subject}: {f.what}" for f in kit.part_set.findings if not f.is_met}),
        "seconds": {"parts": seconds["parts"], "assembly": seconds["assembly"], "documents": written},
        "failed": [f"{c.name}: {c.detail}" for c in verify_kit(folder).checks if not c.passed],
    }
    if checker:
        done = subprocess.run([*shlex.split(checker), str(folder)], capture_output=True, text=True, check=False)
        row["checker"] = [] if done.returncode == 0 else done.stdout.splitlines()[-LAST_LINES:]
    return row


def in_a_folder(kit: tuple[str, str, str], checker: str | None) -> dict:
    """The same in a folder that is removed afterwards."""
    with tempfile.TemporaryDirectory() as folder:
        return measured(*kit, checker, Path(folder) / "kit")


def key(row: dict) -> tuple[str, str, str]:
    """Which kit a row is of."""
    return row["shape"], row["solver"], row["process"]


def ordered(stored: dict[tuple[str, str, str], dict]) -> list[tuple[str, str, str]]:
    """The kits in the order in which all of them run; others, of shapes that are no longer there, last."""
    places = {kit: place for place, kit in enumerate(product(SHAPES, SOLVERS, PROCESSES))}
    return sorted(stored, key=lambda kit: places.get(kit, len(places)))


def line(row: dict) -> str:
    """One printed row."""
    head = f"{row['shape'].split('.')[0][:22]:<23}{row['solver']:<11}{row['process']:<10}"
    if "refused" in row:
        return f"{head}refused: {row['refused']}"
    bad = row["failed"] + row.get("checker", [])
    seconds = row["seconds"]
    return (
        f"{head}{row['size_mm']:>6.0f}{row['mean_edge_mm']:>6.1f}{row['moulds']:>4}"
        f"{row['groove_mm'][0]:>6.1f}/{row['groove_mm'][1]:<5.1f}{row['verdict']:<20}"
        f"{seconds['parts']:>5.1f}{seconds['assembly']:>5.1f}{seconds['documents']:>5.1f}  {bad or 'ok'}"
    )


def main() -> None:
    """Run what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--shapes", type=lambda text: text.split(","), default=list(SHAPES))
    parser.add_argument("--solvers", type=lambda text: text.split(","), default=list(SOLVERS))
    parser.add_argument("--processes", type=lambda text: text.split(","), default=list(PROCESSES))
    parser.add_argument("--checker")
    parser.add_argument("--jobs", type=int, default=1, help="kits at a time; with more than one seconds mean little")
    parser.add_argument("--out", type=Path, default=HERE / "results" / "fabrication.json")
    options = parser.parse_args()
    print(
        f"{'shape':<23}{'solver':<11}{'process':<10}{'mm':>6}{'edge':>6}{'m':>4}{'groove':>9}   {'assembly':<20}"
        "parts asm docs"
    )
    rows = []
    stored = {key(row): row for row in json.loads(options.out.read_text())} if options.out.exists() else {}
    kits = list(product(options.shapes, options.solvers, options.processes))
    with ProcessPoolExecutor(options.jobs) as pool:
        for row in pool.map(in_a_folder, kits, repeat(options.checker)):
            rows.append(row)
            print(line(row), flush=True)
            stored[key(row)] = row
            options.out.write_text(json.dumps([stored[one] for one in ordered(stored)], indent=1) + "\n")
    passed = sum(not (r.get("refused") or r["failed"] or r.get("checker")) for r in rows)
    print(f"{passed} of {len(rows)} kits pass everything")


if __name__ == "__main__":
    main()
