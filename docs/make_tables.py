"""Fill the tables of the documentation, which stand between `<!-- table NAME -->` and `<!-- end -->`.

    python docs/make_tables.py [NAME ...]

`paper`, `choices`, `congruence`, `remesh` and `fabrication` come from benchmarks/results; the others are made anew,
from the bundled nucleus, by the examples and the command line.
"""

import contextlib
import importlib.util
import io
import json
import os
import re
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Callable
from pathlib import Path
from statistics import mean, median
from typing import Any

import drkid

DOCS = Path(__file__).parent
REPOSITORY = DOCS.parent
RESULTS = REPOSITORY / "benchmarks" / "results"
EXACT_PERCENT = 1e-6  # of the mean edge: what is left is rounding
PAIRS = ("surface_simplified_percent", "simplified_assembled_percent", "surface_assembled_percent")
PAPER = REPOSITORY / "src" / "drkid" / "report" / "paper_table.toml"
PAPER_MODELS, NEAR_FACES = ("M4", "M1"), 10  # beside which numbers of faces they stand
SHAPE_FACES, SHAPE_PALETTES = 172, (2, "universal")
EXACTNESS = ("exact", "first s", "T %", "d_H(M_s, M_f)", "d_H(M_i, M_f)")
VERDICTS = ("closes", "closes with strain", "does not close")
SHAPES = {
    "urocell_mito_bean.nii.gz": "mitochondrion",
    "cells3d_nuclei_labels.ome.tif": "nucleus",
    "asteroid_itokawa.obj": "Itokawa",
}


def table(head: list[str], rows: list[list[str]]) -> str:
    """A Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def fenced(text: str) -> str:
    """Text as it was printed."""
    lines = "\n".join(line.rstrip() for line in text.splitlines())
    return f"```\n{lines}\n```"


# ---- from benchmarks/results


def paper() -> str:
    """The paper's table, each row followed by drkid's."""
    results = json.loads((RESULTS / "paper_table.json").read_text())
    rows, reached = [], 0
    for result in results:
        theirs, ours = result["paper"], result["drkid"]
        reached += ours["tolerance_percent"] <= theirs["tolerance_percent"]
        rows.append([theirs["model"], *_figures(theirs)])
        rows.append([f"– drkid: {ours['shape'].split('.')[0].replace('_', ' ')}", *_figures(ours)])
    head = [
        "model",
        "faces",
        "k",
        "T %",
        "mean %",
        "d_H(M_i, M_s)",
        "d_H(M_s, M_f)",
        "d_H(M_i, M_f)",
        "s",
        "iterations",
    ]
    return f"{table(head, rows)}\n\ndrkid reaches the paper's T in {reached} of {len(results)} rows."


def _figures(row: dict) -> list[str]:
    distances = [f"{row[name][0]:.2f} / {row[name][1]:.2f}" for name in PAIRS]
    error = f"{row['error_mean_percent']:.3f}"
    faces, classes = str(row["faces_final"]), str(row["classes"])
    return [
        faces,
        classes,
        f"{row['tolerance_percent']:.2f}",
        error,
        *distances,
        f"{row['seconds']:.1f}",
        f"{row['iterations']}",
    ]


def congruence() -> str:
    """The palette solver by faces and palette, beside the pressure solver and the paper; and shape by shape."""
    rows = json.loads((RESULTS / "congruence.json").read_text())
    return f"{_by_palette(rows)}\n\nShape by shape at {SHAPE_FACES} faces, medians over seeds:\n\n{_by_shape(rows)}"


def _by_palette(rows: list[dict]) -> str:
    printed = []
    papers = [row for row in tomllib.loads(PAPER.read_text())["row"] if row["model"] in PAPER_MODELS]
    for faces in sorted({r["faces"] for r in rows}):
        for palette in sorted(
            {r["palette"] for r in rows if r["faces"] == faces}, key=lambda p: (isinstance(p, str), p)
        ):
            some = [r for r in rows if (r["faces"], r["palette"]) == (faces, palette)]
            beside = [r["pressure"] for r in some if "pressure" in r]
            excess = median(r["dihedral"][1] - r["simplified_dihedral"][1] for r in some)
            printed.append(
                [
                    str(faces),
                    str(palette),
                    *_exactness(some),
                    f"{excess:+.0f}",
                    _median([r["seconds"] for r in some], ".0f"),
                    _median([r["peak_memory_mb"] for r in some], ".0f"),
                    _median([r["error_max_percent"] for r in beside], ".2g"),
                    _median([r["seconds"] for r in beside], ".1f"),
                    _median([r["ratio"] for r in beside], ".2g"),
                ]
            )
        for paper in [row for row in papers if abs(row["faces_final"] - faces) <= NEAR_FACES]:
            distances = [f"{paper[name][0]:.2f} / {paper[name][1]:.2f}" for name in PAIRS[1:]]
            own = [str(paper["faces_final"]), f"{paper['classes']}, paper's {paper['model']}"]
            printed.append(
                [*own, "–", "–", f"{paper['tolerance_percent']}", *distances, "–", f"{paper['seconds']}", *"––––"]
            )
    head = ["faces", "k", *EXACTNESS, "p95 °", "s", "MB", "pressure: T %", "s", "ratio"]
    return table(head, printed)


def _by_shape(rows: list[dict]) -> str:
    small = [r for r in rows if r["faces"] == SHAPE_FACES and r["palette"] in SHAPE_PALETTES]
    printed = []
    for shape in dict.fromkeys(r["shape"] for r in small):
        for palette in SHAPE_PALETTES:
            some = [r for r in small if (r["shape"], r["palette"]) == (shape, palette)]
            if some:
                angles = [
                    f"{median(r['dihedral'][i] for r in some):.0f} ({some[0]['simplified_dihedral'][i]:.0f})"
                    for i in (1, 2)
                ]
                printed.append([shape.split(".")[0].replace("_", " "), str(palette), *_exactness(some), *angles])
    return table(["shape", "k", *EXACTNESS, "p95 °", "concave %"], printed)


def fabrication() -> str:
    """Kits of real shapes by solver and process: whether they go together, how large and with which grooves."""
    rows = json.loads((RESULTS / "fabrication.json").read_text())
    printed = []
    for solver, process in dict.fromkeys((r["solver"], r["process"]) for r in rows):
        some = [r for r in rows if (r["solver"], r["process"]) == (solver, process)]
        made = [r for r in some if "refused" not in r]
        verdicts = [r["verdict"] for r in made]
        grooves = [r["groove_mm"] for r in made]
        printed.append(
            [
                solver,
                process,
                str(len(some)),
                str(sum(not r["failed"] for r in made)),
                *(str(verdicts.count(one)) for one in VERDICTS),
                f"{median(r['mean_edge_mm'] for r in made):.1f}",
                f"{median(mean for mean, _ in grooves):.1f} / {max(most for _, most in grooves):.1f}",
            ]
        )
    head = ["solver, classes", "process", "kits", "pass `drkid check`", *VERDICTS, "edge mm", "groove mm, mean / max"]
    return table(head, printed)


def _exactness(rows: list[dict]) -> list[str]:
    """How many are exact and when, T, and the two distances: the columns `EXACTNESS`."""
    errors = [r["error_max_percent"] for r in rows]
    exact, middle = sum(r["exact"] for r in rows), median(errors)
    tolerance = "exact" if middle < EXACT_PERCENT and 2 * exact >= len(rows) else f"{middle:.2g}"
    if exact < len(rows) > 1:
        tolerance += f" ({max(errors):.2g})"
    distances = ["{:.2f} / {:.2f}".format(*(median(r[name][i] for r in rows) for i in (0, 1))) for name in PAIRS[1:]]
    first = _median([r["first_exact_seconds"] for r in rows], ".1f")
    return [f"{exact} of {len(rows)}", first, tolerance, *distances]


def _median(values: list[float | None], form: str) -> str:
    """Of those that there are."""
    there = [value for value in values if value is not None]
    return format(median(there), form) if there else "–"


def remesh() -> str:
    """Remeshers beside one another, medians by number of vertices, and in how many rows drkid is best or nearly."""
    rows = json.loads((RESULTS / "remesh.json").read_text())
    wins = [_benchmark("remesh").best_in(row) for row in rows]
    columns = _benchmark("remesh").COLUMNS
    every = sum(all(won[name] for name in columns) for won in wins)
    printed = []
    for count in sorted({r["count"] for r in rows}):
        some = [r for r in rows if r["count"] == count]
        for tool in ("drkid", *some[0]["peers"]):
            found = [r["drkid"] if tool == "drkid" else r["peers"][tool] for r in some]
            right = [f for f in found if f.get("right")]
            forms = {"spread_percent": ".1f", "smallest_angle_degrees": ".0f", "irregular_percent": ".0f"}
            forms |= {"outside_567_percent": ".1f", "mean_percent": ".3f", "max_percent": ".2f"}
            forms |= {"volume_percent": "+.2f", "seconds": ".1f", "peak_memory_mb": ".0f"}
            figures = [_median([f[name] for f in right], form) for name, form in forms.items()]
            printed.append([str(count), tool, f"{sum(f.get('exact', False) for f in found)} of {len(some)}", *figures])
    head = ["V", "remesher", "exact V", "edges: std/mean %", "smallest angle °", "valence ≠ 6 %", "not 5, 6, 7 %"]
    printed_table = table([*head, "mean distance %", "largest %", "volume %", "s", "MB"], printed)
    lowest = min(columns, key=lambda name: sum(won[name] for won in wins))
    return (
        f"{printed_table}\n\ndrkid is best or within 5 % of the best in every quality column of {every} of the "
        f"{len(rows)} rows; the column that fails most is `{lowest}`, best or nearly in "
        f"{sum(won[lowest] for won in wins)}."
    )


def _benchmark(name: str) -> Any:
    """A benchmark as a module: what it counts as best is written there alone."""
    folder = REPOSITORY / "benchmarks"
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))
    return importlib.import_module(name)


def choices() -> str:
    """What the open choices do."""
    rows = []
    for row in json.loads((RESULTS / "pressure_choices.json").read_text())["rows"]:
        runs = row["runs"]
        reached = [run["tolerance_percent"] for run in runs]
        pair = [mean(run["simplified_assembled_percent"][i] for run in runs) for i in (0, 1)]
        rows.append(
            [
                f"{SHAPES[row['shape']]}, {row['faces_simplified']}",
                row["choice"],
                f"{median(reached):.2f} ({min(reached):.2f} – {max(reached):.2f})",
                f"{mean(run['error_mean_percent'] for run in runs):.2f}",
                f"{pair[0]:.2f} / {pair[1]:.2f}",
                f"{mean(run['seconds'] for run in runs):.1f}",
            ]
        )
    return table(["shape, faces", "choice", "T %", "mean error %", "d_H(M_s, M_f)", "s"], rows)


# ---- made anew


def faces() -> str:
    """The nucleus with more and more faces, solved as by default."""
    rows = []
    for count in (80, 120, 172, 260, 400, 600):
        kit = drkid.make_kit(spec=drkid.KitSpec(faces=count))
        m = kit.metrics
        exact = m.error_max_percent < EXACT_PERCENT
        rows.append(
            [
                str(m.pieces),
                "exact" if exact else f"{m.error_max_percent:.2g} ({kit.decomposition.outcome.status})",
                f"{m.surface_assembled.mean_percent:.2f} / {m.surface_assembled.max_percent:.2f}",
                f"{kit.spec.size_mm:.0f}",
                f"{m.mean_edge:.1f}",
                f"{m.groove_mean_mm:.1f}",
            ]
        )
    head = [
        "faces",
        "largest error %",
        "distance to M_i, mean / max %",
        "smallest size mm",
        "mean edge mm",
        "groove mm",
    ]
    return table(head, rows)


def classes() -> str:
    """What examples/classes_and_error.py prints."""
    return _printed_by("classes_and_error")


def processes() -> str:
    """What examples/processes.py prints."""
    return _printed_by("processes")


def density() -> str:
    """What examples/density_map.py prints."""
    return _printed_by("density_map")


def _printed_by(name: str) -> str:
    spec = importlib.util.spec_from_file_location(name, REPOSITORY / "examples" / f"{name}.py")
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    with contextlib.redirect_stdout(io.StringIO()) as said:
        example.main()
    return fenced(said.getvalue())


def make() -> str:
    """What `drkid make` says on standard output."""
    with tempfile.TemporaryDirectory() as folder:
        return _said("make", "--out", "nucleus-kit", folder=folder)


def inspect() -> str:
    """What `drkid inspect` says on standard output."""
    return _said("inspect", folder=".")


def _said(*arguments: str, folder: str) -> str:
    command = [sys.executable, "-m", "drkid", *arguments]
    environment = os.environ | {"COLUMNS": "110", "NO_COLOR": "1"}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    if done.returncode not in (0, 3):
        raise RuntimeError(done.stderr)
    return fenced(done.stdout.replace(f"{Path(folder).resolve()}{os.sep}", ""))


def thickening() -> str:
    """How many joints overlap under each rule, and by how much; and the grooves."""
    sys.path.insert(0, str(DOCS / "figures"))
    import make_figures  # noqa: PLC0415 — needs the extra `figures`, which no other table does

    rows = []
    for rule in make_figures.RULES:
        found = make_figures.thickened(rule)
        count, volume = found.overlaps()
        rows.append(
            [
                f"`{rule}`",
                f"{count} of {len(found.joints)}",
                f"{volume / 1000:.1f}",
                f"{found.groove_mm.mean():.1f} / {found.groove_mm.max():.1f}",
            ]
        )
    return table(["thickening", "joints that overlap", "overlap cm³", "groove mm, mean / max"], rows)


TABLES = {
    made.__name__: made
    for made in (
        paper,
        choices,
        congruence,
        remesh,
        fabrication,
        faces,
        classes,
        processes,
        density,
        make,
        inspect,
        thickening,
    )
}


def filled(page: str, name: str, content: Callable[[], str]) -> str:
    """The page with the table of this name made anew, if it has one."""
    start = f"<!-- table {name} -->"
    if start not in page:
        return page
    block = f"{start}\n\n{content()}\n\n<!-- end -->"
    return re.sub(rf"{re.escape(start)}.*?<!-- end -->", lambda _: block, page, count=1, flags=re.DOTALL)


def main() -> None:
    """Fill the named tables, or all."""
    for name in sys.argv[1:] or TABLES:
        for path in sorted(DOCS.rglob("*.md")):
            path.write_text(filled(path.read_text(), name, TABLES[name]))
        print(name, flush=True)


if __name__ == "__main__":
    main()
