"""What the choices that the paper's text leaves open do to its solver's result.

One choice at a time is changed from the defaults, on three real shapes at 172 faces and one at 496, k = 7, three seeds
each (a seed chooses the simplified mesh too). The tolerance is out of reach, so that every run does all its iterations
and T is the smallest largest error that it meets on the way. Prints one table and writes results/pressure_choices.json.

    python benchmarks/pressure_choices.py [--iterations 10000] [--seeds 3]
"""

import argparse
import json
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from statistics import mean, median

from real_shapes import LABELS, require_data

from drkid.congruence.kmeans import cluster
from drkid.congruence.local_operators import flip_towards_valence_six
from drkid.congruence.pressure import PressureSolver, PressureState
from drkid.congruence.solver import Candidate, Solution, run
from drkid.congruence.triangle_space import ascending_lengths, clustering_error
from drkid.kit import Surface
from drkid.mesh import TriMesh
from drkid.metrics import surface_distances
from drkid.pipeline import read_surface
from drkid.progress import silent
from drkid.remesh import simplify
from drkid.spec import KitSpec

HERE = Path(__file__).parent
OUT_OF_REACH_PERCENT = 1e-6
SHAPES = (
    ("urocell_mito_bean.nii.gz", 172),
    ("cells3d_nuclei_labels.ome.tif", 172),
    ("asteroid_itokawa.obj", 172),
    ("urocell_mito_bean.nii.gz", 496),
)
NEVER = 10**9
HEAD = (
    f"{'shape':<22}{'F':>5}  {'choice':<34}{'T %: median (least - most)':<28}{'mean %':>7}  {'dH(Ms,Mf)':<11}{'s':>6}"
)


@dataclass(frozen=True)
class WithoutLocalOperators(PressureSolver):
    """The pressure solver without the first iteration's collapses and flips towards the classes."""

    def init(self, mesh: TriMesh) -> PressureState:
        """Valences only, then clustering."""
        reference = mesh
        mesh, _ = flip_towards_valence_six(mesh)
        means, labels = cluster(ascending_lengths(mesh), self.spec.classes, self._rng(0), self.spec.kmeans_restarts)
        error = clustering_error(ascending_lengths(mesh), labels, means).maximum
        return PressureState(mesh, reference, Candidate(mesh, labels, means, error), 0, 0, ())


@dataclass(frozen=True)
class Choice:
    """A name, what it changes of the defaults, and the solver that it is made with."""

    name: str
    changes: dict[str, float]
    solver: type[PressureSolver] = PressureSolver


CHOICES = (
    Choice("defaults", {}),
    Choice("limit 0.5 mean edges", {"limit": 0.5}),
    Choice("clustering every 20 iterations", {"iterations_per_clustering": 20}),
    Choice("clustering every 500 iterations", {"iterations_per_clustering": 500}),
    Choice("clustering once, warm after that", {"iterations_per_clustering": NEVER}),
    Choice("one start of the first k-means", {"kmeans_restarts": 1}),
    Choice("no collapses and flips at first", {}, WithoutLocalOperators),
)


def one_run(surface: Surface, choice: Choice, faces: int, seed: int, iterations: int) -> dict:
    """The figures of one run, simplification not timed."""
    spec = KitSpec(
        method="pressure",
        faces=faces,
        classes=7,
        seed=seed,
        tolerance_percent=OUT_OF_REACH_PERCENT,
        max_iterations=iterations,
    ).model_copy(update=choice.changes)
    simplified = simplify(surface, spec).mesh
    start = time.perf_counter()
    found = run(choice.solver(spec), simplified, silent)
    seconds = time.perf_counter() - start
    distance = surface_distances(surface.mesh, simplified, found.best.mesh)[1]
    return {"choice": choice.name, "seed": seed, "seconds": seconds, **errors(found)} | {
        "simplified_assembled_percent": [distance.mean_percent, distance.max_percent]
    }


def errors(found: Solution) -> dict:
    """The result's largest and mean error, its faces, and the least T of any iteration, refused ones included."""
    best = found.best
    error = clustering_error(ascending_lengths(best.mesh), best.face_class, best.class_lengths)
    percent = 100 / best.mesh.mean_edge
    return {
        "faces_final": len(best.mesh.faces),
        "tolerance_percent": error.maximum * percent,
        "error_mean_percent": error.mean * percent,
        "least_of_any_iteration_percent": min(record.error_max_percent for record in found.convergence),
    }


def rows(folder: Path, iterations: int, seeds: int) -> Iterator[dict]:
    """One row for each shape and choice, its runs inside."""
    for shape, faces in SHAPES:
        surface = read_surface(folder / shape, KitSpec(label=LABELS.get(shape)))
        for choice in CHOICES:
            runs = [one_run(surface, choice, faces, seed, iterations) for seed in range(seeds)]
            yield {"shape": shape, "faces_simplified": faces, "choice": choice.name, "runs": runs}


def line(row: dict) -> str:
    """One printed row: over the seeds the median and range of T, and the means of the rest."""
    runs = row["runs"]
    reached = [run["tolerance_percent"] for run in runs]
    pair = [mean(run["simplified_assembled_percent"][i] for run in runs) for i in (0, 1)]
    spread = f"{median(reached):6.2f} ({min(reached):.2f} - {max(reached):.2f})"
    return (
        f"{row['shape'].split('.')[0][:20]:<22}{row['faces_simplified']:>5}  {row['choice']:<34}{spread:<28}"
        f"{mean(run['error_mean_percent'] for run in runs):>7.3f}  {pair[0]:.2f}/{pair[1]:<6.2f}"
        f"{mean(run['seconds'] for run in runs):>6.1f}"
    )


def main() -> None:
    """Run every choice on every shape."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--iterations", type=int, default=10000, help="iterations of every run")
    parser.add_argument("--seeds", type=int, default=3, help="seeds 0, 1, … of every choice")
    options = parser.parse_args()
    print(HEAD)
    found = []
    for row in rows(require_data(), options.iterations, options.seeds):
        print(line(row), flush=True)
        found.append(row)
    (HERE / "results").mkdir(exist_ok=True)
    document = {"iterations": options.iterations, "classes": 7, "rows": found}
    (HERE / "results" / "pressure_choices.json").write_text(json.dumps(document, indent=1) + "\n")


if __name__ == "__main__":
    main()
