"""drkid's remeshing beside other remeshers on real shapes, in one run: evenness, valences, closeness, time, memory.

Peers run where they can be imported, in an interpreter that may be another one, and those left out are named. Distances
and volumes are measured against the same surface for all. A peer that takes an edge length and no number is given the
length that yields about as many vertices. Prints one table and what share of the rows drkid is best in, or within 5 %
of the best; writes results/remesh.json. `--speed` measures the time on a large surface instead, the bundled nucleus
subdivided to 250 000 triangles or more, and writes results/remesh_speed.json.

    python benchmarks/remesh.py --peers-python /path/to/python
    python benchmarks/remesh.py --peers-python /path/to/python --speed
    python benchmarks/remesh.py --vertices 116,250 --shapes golgi_vesicle.mrc
"""

import argparse
import json
import multiprocessing
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from congruence import SHAPES
from real_shapes import LABELS, require_data

from drkid.kit import Source, Surface
from drkid.measure import edge_spread, hausdorff, smallest_angle_degrees
from drkid.mesh import TriMesh
from drkid.pipeline import read_surface
from drkid.remesh import simplify
from drkid.remesh.midpoint_subdivision import subdivided
from drkid.spec import KitSpec

HERE = Path(__file__).parent
VERTICES = (116, 250, 500, 2500)
PEERS, CVT = ("pyacvd", "pymeshlab", "gpytoolbox"), ("pyacvd",)
LEFT_OUT = {"geogram": "its Python package has no Voronoi cells on a surface"}
SPEED_TRIANGLES, SPEED_VERTICES = 250_000, (250, 2500)
SAMPLES, WITHIN = 20_000, 1.05
NEAR = 0.05  # of the number of vertices: a peer with other numbers is not compared
LESS = ("spread_percent", "irregular_percent", "outside_567_percent", "mean_percent", "max_percent", "volume_percent")
COLUMNS = (*LESS, "smallest_angle_degrees")


def figures(surface: TriMesh, vertices: np.ndarray, faces: np.ndarray, count: int) -> dict:
    """The quality of a mesh of the surface."""
    whole = TriMesh(vertices, faces)
    mesh = whole.submesh(np.arange(len(faces)))
    found = {"vertices": len(mesh.vertices), "exact": len(mesh.vertices) == count}
    found["right"] = mesh.is_closed_manifold and mesh.component_count == 1 and mesh.genus == surface.genus
    distance = hausdorff(surface, mesh, np.random.default_rng(0), SAMPLES)
    percent = 100 / surface.diagonal
    valences, numbers = np.unique(mesh.valence, return_counts=True)
    found["valences"] = {str(v): int(n) for v, n in zip(valences, numbers, strict=True)}
    return found | {
        "spread_percent": 100 * edge_spread(mesh),
        "smallest_angle_degrees": smallest_angle_degrees(mesh),
        "irregular_percent": 100 * float((mesh.valence != 6).mean()),
        "outside_567_percent": 100 * float((~np.isin(mesh.valence, (5, 6, 7))).mean()),
        "mean_percent": distance.mean * percent,
        "max_percent": distance.max * percent,
        "volume_percent": 100 * (mesh.volume / surface.volume - 1),
    }


def ours(surface: TriMesh, count: int) -> dict:
    """The row of drkid, in a process of its own."""
    fork = multiprocessing.get_context("fork")
    here, there = fork.Pipe(duplex=False)
    process = fork.Process(target=_work, args=(surface, count, there))
    process.start()
    there.close()
    vertices, faces, taken = here.recv()
    process.join()
    return taken | figures(surface, vertices, faces, count)


def _work(surface: TriMesh, count: int, answer: object) -> None:
    given = Surface(surface, Source("", ""))
    simplify(given, KitSpec(vertices=60, lloyd_iterations=1, newton_iterations=1))  # loads what is compiled
    surface = surface.moved(surface.vertices)  # without what the first call has derived
    began, cpu = time.perf_counter(), time.process_time()
    mesh = simplify(Surface(surface, Source("", "")), KitSpec(vertices=count)).mesh
    seconds, cpu = time.perf_counter() - began, time.process_time() - cpu
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    answer.send((mesh.vertices, mesh.faces, {"seconds": seconds, "cpu_seconds": cpu, "peak_memory_mb": memory}))


class Peers:
    """The other remeshers, in their interpreter."""

    def __init__(self, python: str) -> None:
        """Start it and ask what it has."""
        self.process = subprocess.Popen(
            [python, str(HERE / "remesh_peers.py")],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        self.there = json.loads(self.process.stdout.readline() or "[]")

    def row(self, tool: str, surface: TriMesh, count: int) -> dict:
        """A peer's row; `error` where it failed."""
        with tempfile.TemporaryDirectory() as folder:
            given, made = Path(folder) / "in.npz", Path(folder) / "out.npz"
            np.savez(given, vertices=surface.vertices, faces=surface.faces)
            job = {"tool": tool, "input": str(given), "output": str(made), "count": count}
            self.process.stdin.write(json.dumps(job) + "\n")
            self.process.stdin.flush()
            answer = json.loads(self.process.stdout.readline())
            if "error" in answer:
                return answer
            mesh = np.load(made)
            return answer | figures(surface, mesh["vertices"], mesh["faces"], count)


def best_in(row: dict) -> dict[str, bool]:
    """In which columns drkid is best, or within 5 % of the best, of the right meshes of about this number."""
    others = [r for r in row["peers"].values() if r.get("right") and abs(r["vertices"] / row["count"] - 1) <= NEAR]
    own = row["drkid"]
    found = {name: all(abs(own[name]) <= WITHIN * abs(r[name]) for r in others) for name in LESS}
    widest = max((r["smallest_angle_degrees"] for r in others), default=0.0)
    found["smallest_angle_degrees"] = own["smallest_angle_degrees"] * WITHIN >= widest
    found["exact"] = own["exact"] and own["right"]
    fastest = min((row["peers"][t]["seconds"] for t in CVT if "seconds" in row["peers"].get(t, {})), default=np.inf)
    found["seconds"] = own["seconds"] <= 1.5 * fastest
    return found


HEAD = (
    f"{'shape':<22}{'V':>5} {'remesher':<11}{'got':>5}{'s':>7}{'MB':>6}{'edges %':>8}{'angle':>6}{'not 6 %':>8}"
    f"  {'4 or less/5/6/7/8 or more':<26}{'dH %':<14}{'volume %':>8}"
)


def line(row: dict, name: str, found: dict) -> str:
    """One printed row."""
    start = f"{row['shape'].split('.')[0][:21]:<22}{row['count']:>5} {name:<11}"
    if "error" in found:
        return f"{start} {found['error'][:90]}"
    few = sum(n for v, n in found["valences"].items() if int(v) <= 4)
    many = sum(n for v, n in found["valences"].items() if int(v) >= 8)
    valences = "/".join(str(n) for n in (few, *(found["valences"].get(v, 0) for v in "567"), many))
    distance = f"{found['mean_percent']:.3f}/{found['max_percent']:.2f}"
    return (
        f"{start}{found['vertices']:>5}{found['seconds']:>7.2f}{found['peak_memory_mb']:>6.0f}"
        f"{found['spread_percent']:>8.1f}{found['smallest_angle_degrees']:>6.1f}{found['irregular_percent']:>8.1f}"
        f"  {valences:<26}{distance:<14}{found['volume_percent']:>+8.2f}{'' if found['right'] else '  broken'}"
    )


def summary(rows: list[dict]) -> None:
    """The share of the rows in which drkid is best or nearly, by column."""
    wins = [best_in(row) for row in rows]
    for name in wins[0]:
        print(f"{name:<24} best or within 5 % in {sum(w[name] for w in wins)} of {len(rows)} rows")
    every = sum(all(w[name] for name in COLUMNS) for w in wins)
    print(f"every quality column     {every} of {len(rows)} rows")


def speed(peers: Peers) -> None:
    """Seconds on a large surface, beside the remeshers that make centroidal cells too."""
    surface = subdivided(_surface(None, None), SPEED_TRIANGLES // 2)
    rows = []
    for count in SPEED_VERTICES:
        row = {"shape": "nucleus", "triangles": len(surface.faces), "count": count, "drkid": ours(surface, count)}
        row["peers"] = {tool: peers.row(tool, surface, count) for tool in peers.there if tool in CVT}
        for name, found in (("drkid", row["drkid"]), *row["peers"].items()):
            print(line(row, name, found), flush=True)
        print(f"{len(surface.faces)} triangles: {row['drkid']['cpu_seconds']:.2f} s of processor time")
        rows.append(row)
    (HERE / "results" / "remesh_speed.json").write_text(json.dumps(rows, indent=1) + "\n")


def main() -> None:
    """Run what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--peers-python", default=sys.executable, help="interpreter that the peers are installed in")
    parser.add_argument("--vertices", type=lambda text: [int(word) for word in text.split(",")], default=VERTICES)
    parser.add_argument("--shapes", type=lambda text: text.split(","), default=list(SHAPES))
    parser.add_argument("--out", type=Path, default=HERE / "results" / "remesh.json")
    parser.add_argument("--speed", action="store_true", help="time on a large surface alone")
    options = parser.parse_args()
    peers = Peers(options.peers_python)
    for name in PEERS:
        if name not in peers.there:
            print(f"left out: {name}, not installed for {options.peers_python}")
    for name, why in LEFT_OUT.items():
        print(f"left out: {name}, {why}")
    print(HEAD)
    if options.speed:
        speed(peers)
        return
    data = require_data()
    surfaces = {shape: _surface(data / shape, LABELS.get(shape)) for shape in options.shapes}
    options.out.parent.mkdir(exist_ok=True)
    rows = []
    for count in options.vertices:
        for shape, surface in surfaces.items():
            row = {"shape": shape, "triangles": len(surface.faces), "count": count, "drkid": ours(surface, count)}
            row["peers"] = {tool: peers.row(tool, surface, count) for tool in peers.there}
            for name, found in (("drkid", row["drkid"]), *row["peers"].items()):
                print(line(row, name, found), flush=True)
            rows.append(row)
            options.out.write_text(json.dumps(rows, indent=1) + "\n")
    summary(rows)


def _surface(path: Path | None, label: int | None) -> TriMesh:
    """M_i, made in a process of its own: this one stays without threads, so that it may be forked."""
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.apply(_read, (path, label))


def _read(path: Path | None, label: int | None) -> TriMesh:
    return read_surface(path, KitSpec(label=label)).mesh


if __name__ == "__main__":
    main()
