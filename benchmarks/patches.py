"""Curved and merged pieces of real shapes: planar, curved as the paper has it, canonical; triangles merged.

One decomposition a shape (172 faces, two classes) as a kit has it, from it every kind of piece. T is the paper's
measure in (w, x, y, z), moulds are printed shapes, mirror images apart, normals is the mean angle to the surface of the
scan, d_H the mean distance to it in percent of its box. Prints two tables and writes results/patches.json.

    python benchmarks/patches.py               about fifteen minutes
    python benchmarks/patches.py --shapes golgi_vesicle.mrc
"""

import argparse
import json
from pathlib import Path
from typing import cast

import numpy as np
from real_shapes import LABELS, require_data

from drkid.congruence import decompose
from drkid.curved_patch import barycentric_grid
from drkid.kit import WALL, Decomposition, Surface
from drkid.measure import bend_radians, hausdorff, project
from drkid.mesh import TriMesh
from drkid.metrics import SAMPLING_SEED
from drkid.parts import make_parts
from drkid.patches import flattened_patches, make_patches
from drkid.patches.canonical_fit import FIT_LEVELS, heights
from drkid.patches.laid_faces import laid_faces
from drkid.pipeline import read_surface
from drkid.remesh import simplify
from drkid.spec import KitSpec

SHAPES = ("urocell_mito_bean.nii.gz", "golgi_vesicle.mrc", "asteroid_itokawa.obj")
NAMES = dict(zip(SHAPES, ("mitochondrion", "Golgi vesicle", "Itokawa"), strict=True))
ROUNDS = 5  # of the palette solver
CURVED: tuple[tuple[str, dict[str, object]], ...] = (
    ("planar", {}),
    ("published", {"patch": "curved", "curved": "published", "curved_classes": 6}),
    ("published", {"patch": "curved", "curved": "published", "curved_classes": 10}),
    ("canonical", {"patch": "curved", "curved_classes": 2}),
    ("canonical", {"patch": "curved", "curved_classes": 4}),
    ("canonical", {"patch": "curved", "curved_classes": 6}),
    ("canonical", {"patch": "curved", "curved_classes": 8}),
    ("canonical", {"patch": "curved", "curved_classes": 16}),
)
MERGES = (2, 5, 6, 7)
SHIFTS_AND_TOLERANCES = ((0.0, 0.02), (0.0, 0.2), (0.0, 1.0), (5.0, 0.02))  # percent of the edge, mm
FINE = 10_000  # places at least at which normals are compared
WALLS_MM = 0.02  # tolerance up to which pieces are made, and their walls measured
Row = dict[str, float | int | str]


def curved_row(surface: Surface, decomposition: Decomposition, kind: str, options: dict[str, object]) -> Row:
    """One row of the first table."""
    spec = KitSpec.parse(options)
    patches = make_patches(decomposition, surface.mesh, spec)
    parts = make_parts(decomposition if patches is None else patches.decomposition, spec, patches=patches)
    patches = None if patches is None else flattened_patches(patches, parts.patch_share, spec.subdivision_levels)
    figures = None if patches is None else patches.figures
    bend = np.abs(np.degrees(bend_radians(decomposition.mesh)))
    assembled = decomposition.mesh if figures is None else figures.surface
    apart = hausdorff(surface.mesh, assembled, np.random.default_rng(SAMPLING_SEED))
    scale, percent = parts.scale_mm_per_unit, 100 / surface.mesh.diagonal
    errors = 100 * decomposition.face_errors.max() / decomposition.mesh.mean_edge
    return {
        "kind": kind,
        "k": len(decomposition.class_lengths) if patches is None else len(patches.curved),
        "t_percent": float(errors) if figures is None else figures.threshold_percent,
        "moulds": len(parts.parts),
        "gap_p95_mm": 0.0 if figures is None else float(np.percentile(figures.gap, 95)) * scale,
        "clearance_mm": parts.dimensions.clearance_mm,
        "break_mean_degrees": float(bend.mean()) if figures is None else figures.break_mean,
        "break_p95_degrees": float(np.percentile(bend, 95)) if figures is None else figures.break_p95,
        "distance_mean_percent": apart.mean * percent,
        "distance_max_percent": apart.max * percent,
        "normals_mean_degrees": _normals_apart(surface.mesh, assembled),
        "least_distance_percent": _least(surface, decomposition),
        "patch_share": parts.patch_share,
        "size_mm": decomposition.mesh.extents.max() * scale,
        "mean_edge_mm": decomposition.mesh.mean_edge * scale,
    }


def _normals_apart(surface: TriMesh, assembled: TriMesh) -> float:
    """The mean angle between the assembled surface and the tangent plane of M_i nearest to it, by area."""
    count = len(assembled.faces)
    levels = max(0, int(np.ceil(np.log(FINE / count) / np.log(4))))
    at = barycentric_grid(levels)
    centres = at.points[at.faces].mean(axis=1)
    points = np.einsum("nk,fkc->fnc", centres, assembled.corners)
    face = project(surface, points.reshape(-1, 3))[1]
    normal = surface.vertex_normals[surface.faces[face]].mean(axis=1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    cosine = np.einsum("nc,nc->n", normal, np.repeat(assembled.face_normals, len(centres), axis=0))
    angle = np.degrees(np.arccos(np.clip(cosine, -1, 1))).reshape(count, -1).mean(axis=1)
    return float(np.average(angle, weights=assembled.areas))


def _least(surface: Surface, decomposition: Decomposition) -> float:
    """The mean distance, in percent of the box, that one height over each class's triangle would leave at least.

    Whatever its shape: at every place the median of the surface's heights over all members, sides not even meeting.
    """
    laid = laid_faces(decomposition)
    height = heights(laid, surface.mesh, barycentric_grid(FIT_LEVELS).points)
    medians = np.stack([np.median(height[laid.face_class == k], axis=0) for k in range(len(laid.class_lengths))])
    left = np.abs(height - medians[laid.face_class]).mean(axis=1)
    return 100 / surface.mesh.diagonal * float(np.average(left, weights=laid.mesh.areas))


def merged_row(decomposition: Decomposition, surface: Surface, size_mm: float, options: dict[str, object]) -> Row:
    """One row of the second table, at the size of the print of the unmerged triangles."""
    spec = KitSpec.parse({"size_mm": size_mm, **options})
    patches = make_patches(decomposition, surface.mesh, spec)
    assert patches is not None, "merge was asked for"
    assert patches.misfit is not None, "merged pieces have a misfit"
    found = make_parts(decomposition, spec, patches=patches).findings if spec.merge_tolerance_mm <= WALLS_MM else ()
    scale = size_mm / float(decomposition.mesh.extents.max())
    apart = hausdorff(surface.mesh, patches.decomposition.mesh, np.random.default_rng(SAMPLING_SEED))
    return {
        "merge": int(spec.merge or 0),
        "tolerance_mm": spec.merge_tolerance_mm,
        "shift_percent": spec.merge_shift_percent,
        "triangles": len(decomposition.mesh.faces),
        "triangle_moulds": len(decomposition.class_lengths),
        "pieces": len(patches.pieces),
        "moulds": len(patches.merged),
        "single_triangles": sum(len(piece.faces) == 1 for piece in patches.pieces),
        "thin_walls": sum(one.what == WALL and not one.is_met for one in found),
        "misfit_max_mm": float(patches.misfit.max()) * scale,
        "distance_mean_percent": apart.mean * 100 / surface.mesh.diagonal,
    }


def measured(path: Path, only: str) -> dict[str, object]:
    """Both tables of one shape, or one of them."""
    spec = KitSpec.parse({"rounds": ROUNDS, "label": LABELS.get(path.name)})
    surface = read_surface(path, spec)
    simplified = simplify(surface, spec)
    decomposition = decompose(simplified.mesh, spec, surface=simplified.target)
    curved = [curved_row(surface, decomposition, *row) for row in (CURVED[:1] if only == "merged" else CURVED)]
    size = float(curved[0]["mean_edge_mm"]) / decomposition.mesh.mean_edge * float(decomposition.mesh.extents.max())
    wanted = [] if only == "curved" else [(m, *row) for m in MERGES for row in SHIFTS_AND_TOLERANCES]
    merged = [
        merged_row(
            decomposition, surface, size, {"merge": m, "merge_shift_percent": shift, "merge_tolerance_mm": tolerance}
        )
        for m, shift, tolerance in wanted
    ]
    return {"shape": path.name, "faces": len(decomposition.mesh.faces), "curved": curved, "merged": merged}


def printed(rows: list[Row]) -> None:
    """A table, its columns named by the keys."""
    print("  " + " | ".join(rows[0]))
    for row in rows:
        print("  " + " | ".join(f"{x:.3g}" if isinstance(x, float) else str(x) for x in row.values()), flush=True)


def tables(found: list[dict[str, object]]) -> str:
    """Both tables as docs/curved-and-merged.md has them."""
    curved = [
        "| shape | pieces | k | T, % | moulds | gap p95, mm | break mean / p95, ° | normals, ° "
        "| d_H mean / max, % | d_H to flat |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    merged = [
        "| shape | merge | pieces | of them single | M_f as it is, 0.02 mm | 0.2 mm | 1 mm | made alike, 0.02 mm |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for one in found:
        name, rows = NAMES.get(str(one["shape"]), str(one["shape"])), cast("list[Row]", one["curved"])
        flat = float(rows[0]["distance_mean_percent"])
        for row in rows:
            change = "–" if row is rows[0] else f"{100 * (float(row['distance_mean_percent']) / flat - 1):+.0f} %"
            curved.append(
                f"| {name} | {row['kind']} | {row['k']} | {float(row['t_percent']):.2f} | {row['moulds']} "
                f"| {float(row['gap_p95_mm']):.2f} "
                f"| {float(row['break_mean_degrees']):.1f} / {float(row['break_p95_degrees']):.1f} "
                f"| {float(row['normals_mean_degrees']):.1f} "
                f"| {float(row['distance_mean_percent']):.2f} / {float(row['distance_max_percent']):.2f} | {change} |"
            )
        pieces = cast("list[Row]", one["merged"])
        for merge in dict.fromkeys(int(row["merge"]) for row in pieces):
            own = [row for row in pieces if row["merge"] == merge]
            alike = {(float(row["shift_percent"]) > 0, float(row["tolerance_mm"])): row for row in own}
            counts = " | ".join(
                str(alike[key]["moulds"]) for key in ((False, 0.02), (False, 0.2), (False, 1.0), (True, 0.02))
            )
            merged.append(f"| {name} | {merge} | {own[0]['pieces']} | {own[0]['single_triangles']} | {counts} |")
    return "\n".join([*curved, "", *merged])


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--shapes", default=",".join(SHAPES), help="files of the data folder")
    parser.add_argument("--only", choices=("curved", "merged", "both"), default="both", help="one of the tables")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "results" / "patches.json")
    arguments = parser.parse_args()
    data = require_data()
    found = []
    for name in arguments.shapes.split(","):
        result = measured(data / name, arguments.only)
        found.append(result)
        print(name, result["faces"], "faces")
        printed(result["curved"])  # type: ignore[arg-type]
        if result["merged"]:
            printed(result["merged"])  # type: ignore[arg-type]
    arguments.out.write_text(json.dumps(found, indent=1) + "\n")
    print(tables(found))


if __name__ == "__main__":
    main()
