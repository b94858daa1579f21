"""Draw the figures of the documentation from the bundled nucleus.

    python docs/figures/make_figures.py [NAME ...]

Needs the extra `figures` (matplotlib, playwright); `report` and `guide` need Chromium too.
The nucleus is BSD-3-Clause, see src/drkid/data/README.md.
"""

import io
import json
import shutil
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
from matplotlib.figure import Figure
from PIL import Image
from playwright.sync_api import Page, sync_playwright

from drkid import Kit, KitSpec, make_kit
from drkid.assembly import assemble
from drkid.class_triangle import laid_down
from drkid.congruence.annealing import Schedule, anneal
from drkid.congruence.framework import Framework
from drkid.congruence.hop import START_DAMPING, START_HEAT, START_ITERATIONS, START_STEPS_PER_FACE, START_WEIGHTS
from drkid.congruence.labelling import nearest_labels
from drkid.congruence.levenberg_marquardt import solve
from drkid.congruence.palette import Palette, palette_of_classes
from drkid.congruence.quadratic_model import connectivity, quadratic_model
from drkid.congruence.target import Target
from drkid.errors import FitError
from drkid.export.colour import CONNECTOR_COLOUR, class_colour
from drkid.export.plates import plates as build_plates
from drkid.kit import Dimensions, Part
from drkid.mesh import Bools, Floats, TriMesh
from drkid.parts import make_parts
from drkid.parts.detent import bump
from drkid.parts.dimensions import proposed
from drkid.parts.hinge import hinge_half
from drkid.parts.marks import marked
from drkid.parts.pocket import pocket, side_frames
from drkid.parts.prismoid import bevelled
from drkid.parts.snap import snap_half
from drkid.patches import make_patches
from drkid.report.colouring import channels as colour
from drkid.report.net import net_of
from drkid.report.picture import Body, camera, render
from drkid.solid import Solid

HERE = Path(__file__).parent
RESULTS = HERE.parents[1] / "benchmarks" / "results"
RULES = ("bisector", "flippable", "mean_normal", "perpendicular")
ROUNDS = 80  # what ten seconds hold on two cores: the same kit on any machine
SPECK_MM3 = 0.01  # overlaps below this are rounding
VIEW = camera(-62, 34)
STEEL = np.array([0.78, 0.79, 0.82])
RED = np.array([0.86, 0.13, 0.13])
SHAPE_NAMES = {
    "urocell_mito_bean.nii.gz": "mitochondrion",
    "cells3d_nuclei_labels.ome.tif": "nucleus",
    "asteroid_itokawa.obj": "Itokawa",
}
ROD_SIDES = 8  # of an edge that is drawn as a rod
SAME_WEIGHT = 0.1  # of the shape, at which labels are compared
TIMED_FACES = 172
PALETTES = {2: "k = 2", 4: "k = 4", 10: "k = 10", "universal": "universal pair"}
SURFACE_COLOUR = np.array([0.80, 0.80, 0.83])


@cache
def nucleus_kit() -> Kit:
    """The kit that `drkid make --rounds 80` makes."""
    return make_kit(spec=KitSpec(rounds=ROUNDS))


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


def report() -> None:
    """The report in a browser: moved apart, coloured by distance, one piece asked about."""

    def act(page: Page) -> None:
        page.fill("#explode", "35")
        page.select_option("#colour", "distance")
        box = page.locator("#view").bounding_box()
        page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])

    browsed("report.png", "report.html", (1100, 800), act)


def guide() -> None:
    """A group of steps of the guide."""

    def act(page: Page) -> None:
        page.locator("section").nth(6).scroll_into_view_if_needed()
        page.evaluate("document.querySelectorAll('section')[6].scrollIntoView()")

    browsed("guide.png", "guide.html", (900, 900), act)


def browsed(name: str, document: str, size: tuple[int, int], act: Callable[[Page], None]) -> None:
    """Save what headless Chromium shows of a document of the nucleus's kit after `act`."""
    made = nucleus_kit()
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        path = made.write(Path(folder) / "kit") / document
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": size[0], "height": size[1]})
        page.goto(path.as_uri())
        act(page)
        page.wait_for_timeout(1500)
        shot = page.screenshot()
        browser.close()
    saved(name, np.asarray(Image.open(io.BytesIO(shot)).convert("RGB")) / 255)


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
    """The pressure solver's errors and energy over its iterations."""
    made = make_kit(spec=KitSpec(method="pressure"))
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


def plates() -> None:
    """A full plate of pieces and the first one of hinge halves, as they lie on the bed."""
    made = build_plates(nucleus_kit())
    pictures = []
    for plate in (made[0], next(p for p in made if p.objects[0].colour == CONNECTOR_COLOUR)):
        bodies = [
            Body(carried(one.mesh, np.asarray(transform)), colour(one.colour))
            for one in plate.objects
            for transform in one.transforms
        ]
        pictures.append(render(bodies, camera(-80, 60), 620))
    row("plates.png", pictures, ("pieces of one class", "hinge halves"))


def coupon() -> None:
    """The fit coupon as it lies on the bed."""
    body = nucleus_kit().part_set.coupon
    assert body is not None
    bodies = [Body(body.mesh(), colour(CONNECTOR_COLOUR))]
    pictures = [render(bodies, view, 620) for view in (camera(-90, 89), camera(-70, 45))]
    row("coupon.png", pictures, ("from above", "as it is printed"))


def net() -> None:
    """The first page of the net, as the PDF has it."""
    made = net_of(nucleus_kit())
    figure, axis = plt.subplots(figsize=(6, 6 * made.size_mm[1] / made.size_mm[0]))
    page, dashes = made.pages[0], {"mountain": "--", "valley": "-.", "flat": ":", "cut": "-"}
    for tab in page.tabs:
        axis.fill(*tab.T, fill=False, ec="#888888", lw=0.5)
    for face in page.faces:
        axis.fill(*face.outline.T, color=class_colour(face.class_index), alpha=0.45, lw=0)
    for line in page.lines:
        axis.plot(*np.stack([line.start, line.end]).T, dashes[line.kind], c="k", lw=0.8)
    for label in page.labels:
        axis.text(*label.at, label.text, size=1.9 * label.height, ha="center", va="center")
    axis.set(xlim=(0, made.size_mm[0]), ylim=(0, made.size_mm[1]), aspect="equal", xticks=[], yticks=[])
    written(figure, "net.png")


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


BEND = 24.0  # of the joint that is drawn in section, degrees
SIDES_MM = (34.0, 34.0, 38.0)  # of the piece that is drawn


def joint() -> None:
    """A marked piece, both halves, and a joint in section with its clearances, by the default process."""
    spec = KitSpec()
    d = proposed(spec, BEND + spec.swing_degrees)
    half = hinge_half(d).solid
    block = joint_piece(d)
    figure, axes = plt.subplots(2, 3, figsize=(10, 5.6), layout="constrained")
    snap = snap_half(proposed(KitSpec(connector="snap"), BEND)).solid
    below, close = camera(-100, -62), camera(-70, 35)
    tint, grey = colour(class_colour(0)), colour(CONNECTOR_COLOUR)
    for axis, body, view, title in (
        (axes[0, 0], Body(drawn_piece(d).solid.mesh(), tint), below, "a piece from inside"),
        (axes[0, 1], Body(half.mesh(), grey), close, "a hinge half, its bump at either end"),
        (axes[0, 2], Body(snap.mesh(), grey), close, "a snap half: clip and pin"),
    ):
        axis.imshow(render([body], view, 460))
        axis.set_title(title, fontsize=9)
        axis.axis("off")
    across(axes[1, 0], d, block, half)
    along(axes[1, 1], d, block, half)
    table(axes[1, 2], d)
    figure.savefig(HERE / "joint.png", dpi=120)


def drawn_piece(d: Dimensions) -> Part:
    """A piece with pockets and marks."""
    triangle = laid_down(np.array(SIDES_MM))
    inset = d.thickness_mm / 2 * np.tan(np.radians(BEND / 2)) * np.array([[1.0] * 3, [-0.3] * 3])
    frames = side_frames(triangle)
    solid = bevelled(triangle, inset, d.thickness_mm).solid.minus_all([pocket(d).moved(f) for f in frames])
    part = Part(0, "any", np.column_stack([triangle, np.zeros(3)]), frames, solid)
    preset = KitSpec().preset
    return marked(part, d, preset.engrave_width_mm, preset.mark_depth_mm)[0]


def joint_piece(d: Dimensions) -> Solid:
    """The side of a piece at a joint, in connector coordinates."""
    t, lean = d.thickness_mm / 2, np.tan(np.radians((BEND + KitSpec().swing_degrees) / 2))
    profile = np.array([(t * lean, -t), (-t * lean, t), (11.0, t), (11.0, -t)])
    return Solid.prism_along_x(profile, -8.0, 8.0) - pocket(d)


def across(axis: Axes, d: Dimensions, block: Solid, half: Solid) -> None:
    """The cut across the axis, through a knuckle."""
    look = np.array([[0, 1.0, 0, 0], [0, 0, 1.0, 0], [1.0, 0, 0, d.pocket_width_mm / 4], [0, 0, 0, 1]])
    round_ = np.diag([-1.0, -1.0, 1.0, 1.0])
    turned = lambda degrees: about_x(degrees) @ round_  # noqa: E731 — the other side of the joint
    for motion, tint in ((about_x(-BEND / 2), class_colour(0)), (turned(BEND / 2), class_colour(1))):
        cut(axis, block.moved(look @ motion), colour(tint))
    for motion in (about_x(-BEND / 2), turned(BEND / 2)):
        cut(axis, half.moved(look @ motion), colour(CONNECTOR_COLOUR))
    cut(axis, Solid.cylinder_along_x(d.rod_diameter_mm / 2, -9, 9).moved(look), STEEL)
    axis.set_title("a joint cut across its axis, outside up", fontsize=9)
    axis.set(aspect="equal", xlim=(-10, 10), ylim=(-6.5, 5.5))
    axis.axis("off")


def along(axis: Axes, d: Dimensions, block: Solid, half: Solid) -> None:
    """The cut across a half's grip, through both bumps, seen along the piece."""
    ridge = bump(d)
    assert ridge is not None
    y = (ridge.start + ridge.end) / 2
    look = np.array([[1.0, 0, 0, 0], [0, 0, 1.0, 0], [0, -1.0, 0, y], [0, 0, 0, 1]])
    cut(axis, block.moved(look), colour(class_colour(0)))
    cut(axis, half.moved(look), colour(CONNECTOR_COLOUR))
    width = d.pocket_width_mm / 2
    note = {"fontsize": 8, "arrowprops": {"arrowstyle": "-", "lw": 0.6}}
    axis.annotate(f"{d.clearance_mm:g}", (width - d.clearance_mm / 2, 0.8), (5.4, 4.2), **note)
    axis.annotate(f"bump {d.detent_mm:g}", (width, ridge.z), (4.6, -5.2), **note)
    axis.annotate(f"{d.clearance_mm:g}", (-1.0, d.pocket_height_mm / 2 - d.clearance_mm / 2), (-3, 4.2), **note)
    axis.annotate("pressed in from here", (0, -d.barrel_diameter_mm / 2), (-6, -5.2), **note)
    axis.set_title("a half in its pocket, cut across the grip", fontsize=9)
    axis.set(aspect="equal", xlim=(-8.5, 8.5), ylim=(-6.5, 5.5))
    axis.axis("off")


def table(axis: Axes, d: Dimensions) -> None:
    """The lengths of the joint, mm."""
    rows = {
        "thickness": d.thickness_mm,
        "rod": d.rod_diameter_mm,
        "gap around the rod": d.rod_clearance_mm,
        "knuckle wall": d.knuckle_wall_mm,
        "barrel": d.barrel_diameter_mm,
        "gap in the pocket": d.clearance_mm,
        "gap between knuckles": d.knuckle_gap_mm,
        "pocket, wide": d.pocket_width_mm,
        "pocket, deep": d.pocket_depth_mm,
        "pocket, high": d.pocket_height_mm,
        "bump": d.detent_mm,
        "thinnest wall": d.min_wall_mm,
    }
    for i, (name, length) in enumerate(rows.items()):
        axis.text(0.08, 0.95 - i / len(rows), name, fontsize=8)
        axis.text(0.8, 0.95 - i / len(rows), f"{length:.2f}", fontsize=8, ha="right")
    axis.set_title("mm, fdm", fontsize=9)
    axis.axis("off")


def about_x(degrees: float) -> Floats:
    """(4, 4): a turn about the x axis."""
    angle, motion = np.radians(degrees), np.eye(4)
    motion[1:3, 1:3] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return motion


def cut(axis: Axes, solid: Solid, tint: Floats) -> None:
    """The section of a solid at z = 0, its holes left white."""
    for polygon in sorted(solid.cross_section(0.0), key=lambda p: -abs(signed_area(p))):
        face = tint if signed_area(polygon) > 0 else "white"
        axis.fill(*polygon.T, facecolor=face, edgecolor="0.15", lw=0.5)


def signed_area(polygon: Floats) -> float:
    """Positive where the corners run counter-clockwise."""
    x, y = polygon.T
    return float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2)


def read_stl(path: Path) -> TriMesh:
    """An STL file, its corners welded."""
    mesh = trimesh.load_mesh(path)
    return TriMesh(np.asarray(mesh.vertices), np.asarray(mesh.faces))


def thickening() -> None:
    """Cuts through the same kit without connectors, thickened by the four rules; red where pieces overlap."""
    figure, axes = plt.subplots(2, 2, figsize=(8, 8.2), layout="constrained")
    for axis, rule in zip(axes.ravel(), RULES, strict=True):
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
    document = json.loads((RESULTS / "pressure_choices.json").read_text())
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


# ---- the palette solver


def edged(mesh: TriMesh, edge_colours: Floats, radius: float = 0.035) -> Body:
    """A mesh with a rod along each edge, coloured (E, 3), its radius in mean edges."""
    ends = mesh.vertices[mesh.edges]
    along = ends[:, 1] - ends[:, 0]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    across = np.cross(along, np.eye(3)[np.abs(along).argmin(axis=1)])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    turns = np.arange(ROD_SIDES) * 2 * np.pi / ROD_SIDES
    ring = np.cos(turns)[:, None] * across[:, None] + np.sin(turns)[:, None] * np.cross(along, across)[:, None]
    rods = (ends[:, :, None] + radius * mesh.mean_edge * ring[:, None]).reshape(-1, 3)
    a = np.arange(ROD_SIDES)
    b = (a + 1) % ROD_SIDES
    sides = np.concatenate([np.stack([a, b, b + ROD_SIDES], 1), np.stack([a, b + ROD_SIDES, a + ROD_SIDES], 1)])
    corners = mesh.corners.reshape(-1, 3)  # faces of their own: shaded flat
    first = len(corners) + 2 * ROD_SIDES * np.arange(len(ends))
    faces = np.concatenate([np.arange(len(corners)).reshape(-1, 3), (first[:, None, None] + sides).reshape(-1, 3)])
    colours = np.repeat(edge_colours, len(sides), axis=0)
    plain = np.tile(SURFACE_COLOUR, (len(mesh.faces), 1))
    return Body(TriMesh(np.concatenate([corners, rods]), faces), np.concatenate([plain, colours]), smooth=True)


def shown(axis: Axes, picture: Floats, title: str) -> None:
    """A rendered picture in a figure."""
    axis.imshow(picture, interpolation="lanczos")
    axis.set_title(title, fontsize=9)
    axis.axis("off")


def written(figure: Figure, name: str) -> None:
    """Save a figure in few colours: rendered pictures are large otherwise."""
    figure.savefig(HERE / name, dpi=130, bbox_inches="tight")
    plt.close(figure)
    with Image.open(HERE / name) as image:
        small = image.convert("RGB").quantize(256, dither=Image.Dither.NONE)
    small.save(HERE / name, optimize=True)


def rigid() -> None:
    """As many edges as freedoms: M_s with its many lengths, M_f with two."""
    made = nucleus_kit()
    meshes = (made.simplified, made.decomposition.mesh)
    lengths = [mesh.edge_lengths / mesh.mean_edge for mesh in meshes]
    low, high = min(map(np.min, lengths)), max(map(np.max, lengths))
    count = [len(np.unique(own.round(6))) for own in lengths]

    def share(length: Floats) -> Floats:
        return np.clip((length - low) / (high - low), 0, 1)

    figure, axes = plt.subplots(2, 2, figsize=(9, 5.6), height_ratios=(2.3, 1), layout="constrained")
    for i, (name, mesh, own) in enumerate(zip(("$M_s$", "$M_f$"), meshes, lengths, strict=True)):
        tints = mpl.colormaps["viridis"](0.95 * share(own))[:, :3]
        corners, edges = len(mesh.vertices), len(mesh.edges)
        caption = f"{name}: $E$ = {edges} = 3 · {corners} − 6 edges of {count[i]} lengths"
        shown(axes[0, i], render([edged(mesh, tints)], VIEW, 560), caption)
        heights, bounds = np.histogram(own, np.linspace(low - 0.01, high + 0.01, 60))
        middles = (bounds[1:] + bounds[:-1]) / 2
        axes[1, i].bar(middles, heights, np.diff(bounds), color=mpl.colormaps["viridis"](0.95 * share(middles)))
        axes[1, i].set(xlabel="length, mean edges", ylabel="edges")
    written(figure, "rigid.png")


def diffusion() -> None:
    """Edges rounded to the nearest of two lengths, and labels annealed so that misfits cancel at a distance."""
    mesh = nucleus_kit().simplified
    unit = mesh.scaled(1 / mesh.mean_edge)
    target = Target(nucleus_kit().surface.scaled(1 / mesh.mean_edge))
    palette = palette_of_classes(4)  # every triangle of two lengths is allowed: no label needs repair
    ratios = np.array(palette.ratios)
    nearest = nearest_labels(unit, ratios / ratios.mean())
    rounded = Framework(unit, nearest, palette.lengths(1.0, nearest))
    diffused = relabelled(rounded, target, palette)
    figure, axes = plt.subplots(2, 3, figsize=(11, 5.3), width_ratios=(1.1, 1.1, 1), layout="constrained")
    reaches, words = (0.12, 0.02), ("before anything moves", "what is left when solved")
    for column, (name, labels) in enumerate((("nearest length", nearest), ("annealed labels", diffused.labels))):
        before = Framework(unit, labels, palette.lengths(1.0, labels))
        after, _ = solve(before, target, SAME_WEIGHT, "scale", 40)
        for line, frame, reach, when in zip(axes, (before, after), reaches, words, strict=True):
            misfit, offsets = frame.residual, target.offsets(frame.mesh.vertices)[0]
            caption = f"{name}: {when}\nsum of squares {(misfit**2).sum():#.2g}"
            caption += f", {np.sqrt((offsets**2).mean()):.2f} edges off the surface" if frame is after else ""
            tints = mpl.colormaps["coolwarm"]((1 + np.clip(misfit / reach, -1, 1)) / 2)[:, :3]
            shown(line[column], render([edged(frame.mesh, tints, 0.05)], VIEW, 480), caption)
            bins, label = np.linspace(-200 * reach, 200 * reach, 41), f"{name}, up to {100 * abs(misfit).max():.1f} %"
            line[2].hist(100 * misfit, bins, color=class_colour((6, 2)[column]), histtype="step", lw=1.4, label=label)
    for axis in axes[:, 2]:
        axis.set(xlabel="misfit, % of the mean edge", ylabel="edges")
        axis.legend(frameon=False, fontsize=8, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    written(figure, "diffusion.png")


def relabelled(frame: Framework, target: Target, palette: Palette) -> Framework:
    """A start as `drkid.congruence.hop.start` makes it, but without flips: M_s keeps its edges."""
    rng = np.random.default_rng(0)
    every = np.ones(len(frame.labels), np.bool_)
    for weight in START_WEIGHTS:
        model, net = quadratic_model(frame, target, weight, START_DAMPING), connectivity(frame.mesh)
        labels, (short, long) = frame.labels.copy(), frame.lengths
        heat = START_HEAT * float((1 - np.diag(model.coupling)).mean() * (long - short) ** 2)
        schedule = Schedule(heat, START_STEPS_PER_FACE * len(net.faces), 0.0, np.flatnonzero(every), every)
        anneal(net, model, labels, frame.lengths, palette.allowed.copy(), rng, schedule)
        frame = Framework(frame.mesh.moved(frame.mesh.vertices + model.shift.reshape(-1, 3)), labels, frame.lengths)
        frame, _ = solve(frame, target, weight, "scale", START_ITERATIONS)
    return frame


def fold() -> None:
    """Two meshes have given lengths, or none: the curve of a shallow pyramid, and its states."""
    height = 0.3
    figure = plt.figure(figsize=(10, 3.9), layout="constrained")
    left, right = figure.subfigures(1, 2, width_ratios=(1.6, 1))
    draw_curve(left.subplots(), height)
    states = (("up", height), ("the fold, flat", 0.0), ("down", -height))
    for axis, (name, tip) in zip(right.subplots(3, 1), states, strict=True):
        shown(axis, render([pyramid(tip)], camera(-75, 24), 520), f"{name}: legs of {np.hypot(1, tip):.3f}")
    written(figure, "fold.png")


def draw_curve(axis: Axes, height: float) -> None:
    """The lengths of a pyramid's six legs as its tip goes down: to second order, and as they are.

    With the tip alone moving along its axis the tension y is the same in all legs, so that J v = √6 · height / leg, and
    one leg's bending is 1 / (2 leg³).
    """
    leg = float(np.hypot(1, height))
    value, curvature = np.sqrt(6) * height / leg, np.sqrt(6) / (2 * leg**3)
    lowest, t = -(value**2) / (4 * curvature), np.linspace(-0.85, 0.25, 200)
    axis.axhspan(lowest, 0.25, color=class_colour(2), alpha=0.16, lw=0)
    axis.axhspan(-0.25, lowest, color=RED, alpha=0.12, lw=0)
    axis.plot(t, value * t + curvature * t**2, color="0.1", label="$c = σ t + S t^2$")
    exact = np.sqrt(6) * (np.hypot(1, height + t) - leg)
    axis.plot(t, exact, color="0.1", ls=":", label="the pyramid's legs as they are")
    for wanted, said in ((0.1, "this $c$: two meshes"), (-0.17, "this $c$: no mesh")):
        axis.axhline(wanted, color="0.45", lw=0.8, ls="--")
        axis.text(-0.33, wanted, said, ha="center", va="bottom", fontsize=9)
    for name, at, place in (("up", 0, (6, -11)), ("the fold", 0.5, (8, -11)), ("down", 1, (-36, -11))):
        point = -value / curvature * at, lowest * 4 * at * (1 - at)
        axis.plot(*point, "o", color="0.1", ms=5)
        axis.annotate(name, point, place, textcoords="offset points", fontsize=9)
    axis.text(-0.33, 0.2, "solvable: $σ^2 + 4 S c ≥ 0$", fontsize=9, ha="center")
    axis.text(-0.33, -0.23, "not solvable but by other labels", fontsize=9, ha="center")
    axis.set(
        xlabel="$t$: movement along the flex", ylabel="$c$: change of lengths", xlim=t[[0, -1]], ylim=(-0.25, 0.25)
    )
    axis.legend(frameon=False, fontsize=8, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)


def pyramid(tip: float) -> Body:
    """On a hexagon of radius 1, open below."""
    turns = np.arange(6) * np.pi / 3
    rim = np.stack([np.cos(turns), np.sin(turns), np.zeros(6)], axis=1)
    faces = np.array([[i, (i + 1) % 6, 6] for i in range(6)])
    return Body(TriMesh(np.vstack([rim, [0, 0, tip]]), faces), colour(class_colour(1)), edges=True)


def time_to_quality(results: Path = RESULTS / "congruence.json") -> None:
    """How near the best mesh is, and what share of the searches is exact, over the seconds."""
    rows = [r for r in json.loads(results.read_text()) if r["faces"] == TIMED_FACES]
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.5), width_ratios=(1.3, 1), layout="constrained")
    for number, (palette, name) in enumerate(PALETTES.items()):
        curves = [r["curve"] for r in rows if r["palette"] == palette]
        if not curves:
            continue
        tint = class_colour((0, 2, 6, 4)[number])
        seconds = np.linspace(0, max(curve[-1]["seconds"] for curve in curves), 600)
        distances, exact = (np.array(both) for both in zip(*(known(c, seconds) for c in curves), strict=True))
        begun = np.isfinite(distances).all(axis=0)
        low, middle, high = np.quantile(distances[:, begun], (0.25, 0.5, 0.75), axis=0)
        done = exact[:, begun].mean(axis=0) >= 0.5
        left.fill_between(seconds[begun], low, high, color=tint, alpha=0.15, lw=0)
        left.plot(seconds[begun], np.where(done, np.nan, middle), color=tint, ls=":", lw=1.4)
        left.plot(seconds[begun], np.where(done, middle, np.nan), color=tint, label=name)
        right.step(seconds, 100 * exact.mean(axis=0), color=tint, where="post", label=f"{name}, n = {len(curves)}")
    left.set(xlabel="s", ylabel="mean $d_H(M_s, M_f)$, % of the diagonal", ylim=(0, None))
    right.set(xlabel="s", ylabel="exact, % of the runs", ylim=(0, 103))
    for axis, place in ((left, "lower right"), (right, "lower right")):
        axis.set_xlim(0, None)
        axis.legend(frameon=False, fontsize=8, loc=place)
    figure.savefig(HERE / "time-to-quality.png", dpi=130)


def known(curve: Sequence[dict], seconds: Floats) -> tuple[Floats, Bools]:
    """The mean distance of the best mesh at these times, NaN before there is one, and whether it is exact."""
    last = np.searchsorted([at["seconds"] for at in curve], seconds, side="right") - 1
    distances = np.array([at["distance_percent"][0] for at in curve])[last]
    exact = np.array([at["exact"] for at in curve])[last]
    return np.where(last < 0, np.nan, distances), exact & (last >= 0)


# ---- curved and merged pieces


def patches() -> None:
    """The nucleus of flat, curved and merged pieces, from one decomposition."""
    made = nucleus_kit()
    kinds = (
        ("flat", {}),
        ("curved, as published", {"patch": "curved", "curved": "published"}),
        ("curved, canonical", {"patch": "curved"}),
        ("pairs", {"merge": 2}),
        ("hexagons and parts", {"merge": 6}),
    )
    pictures, captions = [], []
    for name, options in kinds:
        spec = KitSpec(size_mm=float(made.decomposition.mesh.extents.max()), **options)
        try:
            bodies, count, moulds = pieces_of(made, spec)
        except FitError:  # the paper's corners are shrunk by subdivision, and need a larger print
            bodies, count, moulds = pieces_of(made, spec.model_copy(update={"size_mm": None}))
        pictures.append(render(bodies, VIEW, 520))
        captions.append(f"{name}\n{count} pieces, {moulds} moulds")
    row("patches.png", pictures, captions, drop=0.36)


def pieces_of(made: Kit, spec: KitSpec) -> tuple[list[Body], int, int]:
    """Another kit of the same M_f: its pieces at their places, their number and that of their shapes."""
    found = make_patches(made.decomposition, made.surface, spec)
    decomposition = made.decomposition if found is None else found.decomposition
    part_set = make_parts(made.decomposition if spec.merge else decomposition, spec, patches=found)
    assembly = assemble(decomposition.mesh.scaled(part_set.scale_mm_per_unit), part_set)
    meshes = [part.solid.mesh() for part in part_set.parts]
    bodies = []
    for piece in assembly.pieces:
        mesh = carried(meshes[piece.part], piece.transform)
        bodies.append(Body(mesh, colour(class_colour(part_set.parts[piece.part].class_index))))
    return bodies, len(assembly.pieces), len(part_set.parts)


# ---- pictures side by side


def row(name: str, pictures: Sequence[Floats], captions: Sequence[str], drop: float = 0.12) -> None:
    """Rendered pictures side by side, their captions below."""
    height = max(len(picture) for picture in pictures)
    padded = [np.pad(p, _room(height - len(p)), constant_values=1.0) for p in pictures]
    figure, axes = plt.subplots(1, len(padded), figsize=(10, 11 / len(padded)), layout="constrained")
    for axis, picture, caption in zip(axes, padded, captions, strict=True):
        axis.imshow(picture, interpolation="lanczos")
        axis.set_title(caption, y=-drop, fontsize=10)
        axis.axis("off")
    figure.savefig(HERE / name, dpi=130, bbox_inches="tight")
    with Image.open(HERE / name) as image:
        small = image.convert("RGB").quantize(256, dither=Image.Dither.NONE)
    small.save(HERE / name, optimize=True)


def _room(missing: int) -> tuple[tuple[int, int], ...]:
    return (missing // 2, missing - missing // 2), (0, 0), (0, 0)


FUNCTIONS = (
    kit,
    walk,
    convergence,
    parts,
    joint,
    plates,
    coupon,
    net,
    thickening,
    choices,
    rigid,
    diffusion,
    fold,
    time_to_quality,
    report,
    guide,
    patches,
)
FIGURES = {figure.__name__: figure for figure in FUNCTIONS}


def main() -> None:
    """Draw the named figures, or all."""
    mpl.use("Agg")
    plt.rcParams.update({"font.size": 10, "axes.spines.top": False, "axes.spines.right": False})
    for name in sys.argv[1:] or FIGURES:
        FIGURES[name]()
        print(name)


if __name__ == "__main__":
    main()
