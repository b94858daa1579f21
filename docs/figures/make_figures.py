"""Draw the figures of the documentation from the bundled nucleus.

    python docs/figures/make_figures.py [NAME ...]

Needs the extra `figures` (matplotlib). The nucleus is BSD-3-Clause, see src/drkid/data/README.md.
"""

import json
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import trimesh
from matplotlib.axes import Axes
from PIL import Image
from render import Body, camera, colour, render

from drkid import Kit, make_kit
from drkid.assembly import assemble
from drkid.export.colour import CONNECTOR_COLOUR, class_colour
from drkid.mesh import Floats, TriMesh
from drkid.parts import make_parts
from drkid.solid import Solid

HERE = Path(__file__).parent
RULES = ("bisector", "mean_normal", "perpendicular")
SPECK_MM3 = 0.01  # overlaps below this are rounding
VIEW = camera(-62, 34)
STEEL = np.array([0.78, 0.79, 0.82])
RED = np.array([0.86, 0.13, 0.13])
SHAPE_NAMES = {
    "urocell_mito_bean.nii.gz": "mitochondrion",
    "cells3d_nuclei_labels.ome.tif": "nucleus",
    "asteroid_itokawa.obj": "Itokawa",
}
SURFACE_COLOUR = np.array([0.80, 0.80, 0.83])


@cache
def nucleus_kit() -> Kit:
    """The kit that `drkid make` makes."""
    return make_kit()


def placed(kit: Kit, spread: Callable[[Floats], float] = lambda _: 0.0) -> list[Body]:
    """Every piece at its place, moved away from the middle by `spread` of its distance."""
    meshes = [part.solid.mesh() for part in kit.part_set.parts]
    middle = kit.decomposition.mesh.vertices.mean(axis=0)
    bodies = []
    for piece in kit.assembly.pieces:
        mesh, part = meshes[piece.part], kit.part_set.parts[piece.part]
        vertices = mesh.vertices @ piece.transform[:3, :3].T + piece.transform[:3, 3]
        away = piece.transform[:3, 3] - middle
        bodies.append(Body(mesh.moved(vertices + spread(away) * away), colour(class_colour(part.class_index))))
    return bodies


def by_class(kit: Kit) -> Body:
    """M_f, its faces coloured by class."""
    colours = np.array([colour(class_colour(index)) for index in kit.decomposition.face_class])
    return Body(kit.decomposition.mesh, colours, edges=True)


def saved(name: str, picture: Floats) -> None:
    """Write a rendered picture as it is."""
    image = Image.fromarray((255 * picture).round().astype(np.uint8))
    image.quantize(256, dither=Image.Dither.NONE).save(HERE / name, optimize=True)


# ---- the figures


def kit() -> None:
    """The kit of the README: whole on the left, coming apart to the right."""
    made = nucleus_kit()
    along = made.decomposition.mesh.extents.max() / 2

    def spread(away: Floats) -> float:
        share = np.clip((VIEW[0] @ away / along + 0.35) / 1.2, 0, 1)
        return float(0.01 + 0.42 * share**1.5)

    saved("kit.png", render(placed(made, spread), VIEW, 1100))


def walk() -> None:
    """M_i, M_s and M_f side by side."""
    made = nucleus_kit()
    bodies = (
        Body(made.surface, SURFACE_COLOUR, smooth=True),
        Body(made.simplified, SURFACE_COLOUR, edges=True),
        by_class(made),
    )
    names = (
        f"$M_i$: the surface, {len(made.surface.faces)} triangles",
        f"$M_s$: simplified, {len(made.simplified.faces)} triangles, all different",
        f"$M_f$: {made.metrics.pieces} triangles in {made.metrics.classes} classes",
    )
    row("walk.png", [render([body], VIEW, 620) for body in bodies], names)


def convergence() -> None:
    """The solver's errors and energy over its iterations."""
    made = nucleus_kit()
    records = made.decomposition.convergence
    iterations = [record.iteration for record in records]
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.2), layout="constrained")
    left.semilogy(iterations, [r.error_max_percent for r in records], color=class_colour(6), lw=0.9, label="largest")
    left.semilogy(iterations, [r.error_mean_percent for r in records], color=class_colour(2), lw=0.9, label="mean")
    left.axhline(made.spec.tolerance_percent, color="0.4", lw=0.8, ls="--")
    left.annotate("tolerance", (0.75 * iterations[-1], made.spec.tolerance_percent), ha="center", va="top", color="0.4")
    left.set(xlabel="iteration", ylabel="error, % of the mean edge")
    left.legend(frameon=False)
    right.semilogy(iterations, [record.energy for record in records], color=class_colour(0), lw=0.9)
    right.set(xlabel="iteration", ylabel="energy $F_d$, µm²")
    figure.savefig(HERE / "convergence.png", dpi=130)


def parts() -> None:
    """A piece from both sides, the hinge half, and two pieces joined, from the STL files."""
    made = nucleus_kit()
    with tempfile.TemporaryDirectory() as folder:
        written = made.write(Path(folder) / "kit")
        files = {path.stem: read_stl(path) for path in sorted((written / "parts").iterdir())}
    half = files.pop("connector_half")
    name, piece = max(files.items(), key=lambda item: item[1].volume)
    tint = colour(class_colour(ord(name[0]) - ord("A")))
    above, below, close = camera(-70, 42), camera(-70, -38), camera(-50, 32)
    pictures = (
        render([Body(piece, tint)], above, 420),
        render([Body(piece, tint)], below, 420),
        render([Body(half, colour(CONNECTOR_COLOUR))], close, 420),
        render(*joined(made, half), 420),
    )
    row("parts.png", pictures, ("a piece from outside", "from inside: three pockets", "a hinge half", "a joint"))


def joined(made: Kit, half: TriMesh) -> tuple[list[Body], Floats]:
    """Two neighbouring pieces with their hinge and rod, and a view of them from inside, the edge upright."""
    joint = min(made.assembly.joints, key=lambda j: abs(j.dihedral_degrees - 160))
    bodies, frames = [], []
    for face in joint.faces:
        piece = made.assembly.pieces[face]
        part = made.part_set.parts[piece.part]
        side = next(i for i in range(3) if {piece.vertices[i], piece.vertices[(i + 1) % 3]} == set(joint.edge))
        frames.append(piece.transform @ part.side_frames[side])
        bodies += [
            Body(carried(part.solid.mesh(), piece.transform), colour(class_colour(part.class_index))),
            Body(carried(half, frames[-1]), colour(CONNECTOR_COLOUR)),
        ]
    size = made.part_set.dimensions
    rod = Solid.cylinder_along_x(size.rod_diameter_mm / 2, -size.rod_length_mm / 2, size.rod_length_mm / 2).mesh()
    bodies.append(Body(carried(rod, frames[0]), STEEL))
    along, inward = frames[0][:3, 0], -(frames[0] + frames[1])[:3, 2]
    eye = inward / np.linalg.norm(inward) + 0.55 * along
    eye /= np.linalg.norm(eye)
    right = np.cross(along, eye)
    right /= np.linalg.norm(right)
    return bodies, np.stack([right, np.cross(eye, right), eye])


def carried(mesh: TriMesh, matrix: Floats) -> TriMesh:
    """The mesh carried by a 4×4 matrix."""
    return mesh.moved(mesh.vertices @ matrix[:3, :3].T + matrix[:3, 3])


def read_stl(path: Path) -> TriMesh:
    """An STL file, its corners welded."""
    mesh = trimesh.load_mesh(path)
    return TriMesh(np.asarray(mesh.vertices), np.asarray(mesh.faces))


def thickening() -> None:
    """Cuts through the same kit without connectors, thickened by the three rules; red where pieces overlap."""
    figure, axes = plt.subplots(1, 3, figsize=(10, 3.7), layout="constrained")
    for axis, rule in zip(axes, RULES, strict=True):
        found = thickened(rule)
        for solid, tint in zip(found.solids, found.colours, strict=True):
            fill(axis, solid, tint)
        for a, b in found.joints:
            fill(axis, found.solids[a] & found.solids[b], RED)
        count, volume = found.overlaps()
        axis.set_title(f"{rule}\n{count} of {len(found.joints)} joints overlap, {volume / 1000:.1f} cm³", fontsize=9)
        axis.set(aspect="equal", xlim=(-112, 2), ylim=(-58, 62))
        axis.axis("off")
    figure.savefig(HERE / "thickening.png", dpi=130, bbox_inches="tight", pad_inches=0.1)


@dataclass(frozen=True, eq=False)
class Thickened:
    """Placed pieces without connectors, the cutting plane at z = 0; pairs that share an edge, and their grooves."""

    solids: list[Solid]
    colours: list[Floats]
    joints: list[tuple[int, int]]
    groove_mm: Floats

    def overlaps(self) -> tuple[int, float]:
        """How many joints' pieces overlap, and the total volume in mm³."""
        volumes = [(self.solids[a] & self.solids[b]).volume for a, b in self.joints]
        return sum(volume > SPECK_MM3 for volume in volumes), sum(volumes)


def thickened(rule: str) -> Thickened:
    """The kit's pieces by another thickening."""
    made = nucleus_kit()
    part_set = make_parts(made.decomposition, made.spec.model_copy(update={"thickening": rule, "connector": "none"}))
    found = assemble(made.decomposition.mesh, part_set)
    upright = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
    upright[:3, 3] = -upright[:3, :3] @ made.decomposition.mesh.vertices.mean(axis=0)
    return Thickened(
        [part_set.parts[piece.part].solid.moved(upright @ piece.transform) for piece in found.pieces],
        [colour(class_colour(part_set.parts[piece.part].class_index)) for piece in found.pieces],
        [joint.faces for joint in found.joints],
        part_set.groove_mm,
    )


def fill(axis: Axes, solid: Solid, tint: Floats) -> None:
    """The section of a solid at z = 0."""
    for polygon in solid.cross_section(0.0):
        axis.fill(*polygon.T, facecolor=tint, edgecolor="0.15", lw=0.4)


def choices() -> None:
    """What the open choices do to T, from benchmarks/results/pressure_choices.json."""
    document = json.loads((HERE.parents[1] / "benchmarks" / "results" / "pressure_choices.json").read_text())
    names = list(dict.fromkeys(r["choice"] for r in document["rows"]))
    shapes = list(dict.fromkeys((r["shape"], r["faces_simplified"]) for r in document["rows"]))
    figure, axis = plt.subplots(figsize=(8, 3.4), layout="constrained")
    for number, shape in enumerate(shapes):
        label = f"{SHAPE_NAMES[shape[0]]}, {shape[1]} faces"
        own = [r for r in document["rows"] if (r["shape"], r["faces_simplified"]) == shape]
        x = [run["tolerance_percent"] for r in own for run in r["runs"]]
        y = [names.index(r["choice"]) + 0.17 * (number - 1.5) for r in own for _ in r["runs"]]
        axis.semilogx(x, y, "o", ms=4.5, color=class_colour((0, 2, 6, 4)[number]), label=label)
    axis.set_yticks(range(len(names)), names)
    axis.set_xticks([0.1, 0.2, 0.5, 1, 2, 5, 10], ["0.1", "0.2", "0.5", "1", "2", "5", "10"])
    axis.invert_yaxis()
    axis.set_xlabel(f"T: largest error after {document['iterations']} iterations, % of the mean edge")
    axis.grid(axis="x", color="0.9")
    axis.legend(frameon=False, fontsize=8, loc="center left", bbox_to_anchor=(1, 0.5))
    figure.savefig(HERE / "choices.png", dpi=130)


def row(name: str, pictures: Sequence[Floats], captions: Sequence[str]) -> None:
    """Rendered pictures side by side, their captions below."""
    height = max(len(picture) for picture in pictures)
    padded = [np.pad(p, _room(height - len(p)), constant_values=1.0) for p in pictures]
    figure, axes = plt.subplots(1, len(padded), figsize=(10, 11 / len(padded)), layout="constrained")
    for axis, picture, caption in zip(axes, padded, captions, strict=True):
        axis.imshow(picture, interpolation="lanczos")
        axis.set_title(caption, y=-0.12, fontsize=10)
        axis.axis("off")
    figure.savefig(HERE / name, dpi=130, bbox_inches="tight")
    with Image.open(HERE / name) as image:
        small = image.convert("RGB").quantize(256, dither=Image.Dither.NONE)
    small.save(HERE / name, optimize=True)


def _room(missing: int) -> tuple[tuple[int, int], ...]:
    return (missing // 2, missing - missing // 2), (0, 0), (0, 0)


FIGURES = {figure.__name__: figure for figure in (kit, walk, convergence, parts, thickening, choices)}


def main() -> None:
    """Draw the named figures, or all."""
    mpl.use("Agg")
    plt.rcParams.update({"font.size": 10, "axes.spines.top": False, "axes.spines.right": False})
    for name in sys.argv[1:] or FIGURES:
        FIGURES[name]()
        print(name)


if __name__ == "__main__":
    main()
