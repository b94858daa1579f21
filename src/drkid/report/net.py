"""The net: a paper model to scale, its strips on pages, as SVG and PDF."""

import io
from collections.abc import Iterator
from dataclasses import dataclass
from html import escape

import numpy as np
from reportlab.lib.colors import HexColor
from reportlab.pdfgen.canvas import Canvas

from drkid.export.colour import class_colour
from drkid.export.layout import NET_PDF, NET_SVG
from drkid.export.packing import Shape, Sheet, hull_outline, pack, rotation
from drkid.kit import Kit
from drkid.mesh import Floats
from drkid.report.unfolding import Fold, Strip, flattened, overlapping, unfold, upright
from drkid.solid import triangulated
from drkid.spec import Paper

PAPERS: dict[Paper, tuple[float, float]] = {
    "a4": (210.0, 297.0), "a3": (297.0, 420.0), "a2": (420.0, 594.0), "a1": (594.0, 841.0), "a0": (841.0, 1189.0),
    "letter": (215.9, 279.4), "tabloid": (279.4, 431.8),
}  # fmt: skip
"""Width and height in mm."""

MARGIN_MM = 10.0  # what printers cannot print on
HEADING_MM = 6.0  # under the top margin: title, scale, page number and ruler
RULER_MM = 100.0  # to see that the printer has not scaled the page
MOST_TEXT = 0.55  # of a mean side: letters of a piece's number times their height, so that it keeps off cuts' numbers
TAB_MM = 6.0
TAB_SHARE = 0.22  # of the side, where that is less
GAP_MM = 2.0
STEP_MM = 4.0  # of the grid of places of strips
FLAT_DEGREES = 0.5  # a joint that bends less is drawn as neither mountain nor valley
TINT = 0.55  # of white in the faces' colour, so that numbers stay readable
SHRINK = 0.96
MM = 72 / 25.4  # points
DASHES = {"mountain": (3.0, 1.2), "valley": (3.0, 1.0, 0.6, 1.0), "flat": (0.6, 1.2), "cut": (), "tab": (), "page": ()}
WIDTHS = {"mountain": 0.25, "valley": 0.25, "flat": 0.2, "cut": 0.35, "tab": 0.2, "page": 0.15}


@dataclass(frozen=True, eq=False)
class Face:
    """A piece on paper: its outline (n, 2) in mm, y upwards, and what is known of it."""

    piece: int
    step: int
    class_index: int
    class_name: str
    outline: Floats


@dataclass(frozen=True, eq=False)
class Line:
    """From `start` to `end` (2,): a cut, a mountain or valley fold, or the outline of a tab."""

    kind: str
    start: Floats
    end: Floats


@dataclass(frozen=True, eq=False)
class Label:
    """Text centred at a point, `height` in mm."""

    text: str
    at: Floats
    height: float


@dataclass(frozen=True, eq=False)
class Page:
    """What is drawn on a sheet."""

    faces: tuple[Face, ...]
    tabs: tuple[Floats, ...]
    lines: tuple[Line, ...]
    labels: tuple[Label, ...]


@dataclass(frozen=True, eq=False)
class Net:
    """Pages of `size_mm`; `scale` is 1 for the kit's own size, `strips` how many connected parts there are."""

    size_mm: tuple[float, float]
    scale: float
    strips: int
    pages: tuple[Page, ...]


def net_files(kit: Kit) -> dict[str, bytes]:
    """net.svg and net.pdf."""
    net = net_of(kit)
    return {NET_SVG: net_svg(net), NET_PDF: net_pdf(net)}


# ---- made


def net_of(kit: Kit) -> Net:
    """The net as the spec asks: at a scale on as many pages as it takes, or shrunk onto one."""
    size = PAPERS[kit.spec.paper]
    room = np.array(size) - 2 * MARGIN_MM - np.array([0.0, HEADING_MM])
    outlines = [flattened(kit.part_set.parts[piece.part].corners) for piece in kit.assembly.pieces]
    joints = joints_of(kit)
    triangles = [triangulated(outline) for outline in outlines]
    if kit.spec.net_on_one_page:
        strips = unfold(outlines, triangles, joints, np.array([np.inf, np.inf]))
        return _on_one_page(kit, strips, joints, size, room)
    scale = printable_scale(outlines, kit.spec.net_scale, room - 2 * TAB_MM)
    strips = unfold([scale * o for o in outlines], triangles, joints, room - 2 * TAB_MM)
    pages = _laid_out(kit, [upright(s, room - 2 * TAB_MM) for s in strips], joints, size)
    return Net(size, scale, len(strips), pages)


def printable_scale(outlines: list[Floats], wanted: float, room: Floats) -> float:
    """The wanted scale, or the largest at which every outline (n, 2) lies within `room` (2,) however it is turned."""
    largest = max(float(np.linalg.norm(o[:, None] - o[None], axis=-1).max()) for o in outlines)
    return min(wanted, float(room.min()) / largest)


def joints_of(kit: Kit) -> list[Fold]:
    """Which side of which piece meets which, in the order of the pieces."""
    sides: dict[tuple[int, int], tuple[int, int]] = {}
    found: list[Fold] = []
    for number, piece in enumerate(kit.assembly.pieces):
        ring = piece.vertices
        for side, start in enumerate(ring):
            end = ring[(side + 1) % len(ring)]
            if (end, start) in sides:
                other, other_side = sides[end, start]
                found.append(Fold((other, number), (other_side, side)))
            sides[start, end] = number, side
    return found


def _on_one_page(kit: Kit, strips: list[Strip], joints: list[Fold], size: tuple[float, float], room: Floats) -> Net:
    """Shrunk step by step until one sheet holds everything."""
    area = sum(Shape((hull_outline(strip.points),)).area for strip in strips)
    scale = min(kit.spec.net_scale, float(np.sqrt(room.prod() / area)))
    while True:
        shrunk = [upright(s.moved(scale * np.eye(2), np.zeros(2)), room - 2 * TAB_MM) for s in strips]
        if all((np.ptp(s.points, axis=0) <= room - 2 * TAB_MM).all() for s in shrunk):
            pages = _laid_out(kit, shrunk, joints, size)
            if len(pages) == 1:
                return Net(size, scale, len(strips), pages)
        scale *= SHRINK


def _laid_out(kit: Kit, strips: list[Strip], joints: list[Fold], size: tuple[float, float]) -> tuple[Page, ...]:
    """Strips with their tabs packed on sheets, and what is drawn on each."""
    folded = {joint for strip in strips for joint in strip.folds}
    numbers = {joint: n for n, joint in enumerate((j for j in range(len(joints)) if j not in folded), 1)}
    tabs = _tabs(strips, joints, folded)
    shapes = [Shape((hull_outline(np.vstack([s.points, *t])),)) for s, t in zip(strips, tabs, strict=True)]
    sheet = Sheet(size[0], size[1] - HEADING_MM, MARGIN_MM, GAP_MM)
    places = pack(shapes, [1] * len(shapes), sheet, STEP_MM, aligned=False)
    pages: list[Page] = []
    for page in range(1 + max(place.sheet for place in places)):
        own = [place for place in places if place.sheet == page]
        drawn = Page((), (), (), ())
        for place in own:
            turn, shift = rotation(place.degrees), np.array([place.x, place.y])
            strip = strips[place.shape].moved(turn, shift)
            moved = tuple(tab @ turn.T + shift for tab in tabs[place.shape])
            drawn = _joined(drawn, _drawn(kit, strip, moved, joints, numbers))
        pages.append(drawn)
    return tuple(pages)


def _joined(one: Page, other: Page) -> Page:
    return Page(one.faces + other.faces, one.tabs + other.tabs, one.lines + other.lines, one.labels + other.labels)


def _tabs(strips: list[Strip], joints: list[Fold], folded: set[int]) -> list[list[Floats]]:
    """Glue tabs by strip: one for each cut joint, on the first of its two sides that has room beside it."""
    home = {piece: k for k, strip in enumerate(strips) for piece in strip.outlines}
    bodies = [np.concatenate([o[triangulated(o)] for o in strip.outlines.values()]) for strip in strips]
    tabs: list[list[Floats]] = [[] for _ in strips]
    for number, joint in enumerate(joints):
        if number in folded:
            continue
        ends = list(zip(joint.pieces, joint.sides, strict=True))
        for share, (piece, side) in [(share, end) for share in (1.0, 0.5) for end in ends]:
            strip = home[piece]
            tab = _tab(strips[strip].outlines[piece], side, share)
            body = tab[[[0, 1, 2], [0, 2, 3]]]
            if not overlapping(body, bodies[strip], 0.05).any():
                tabs[strip].append(tab)
                bodies[strip] = np.concatenate([bodies[strip], body])
                break
    return tabs


def _tab(outline: Floats, side: int, share: float) -> Floats:
    """(4, 2): a trapezium outside a side, counter-clockwise, its legs at 45°."""
    b, a = outline[side], outline[(side + 1) % len(outline)]
    along = a - b
    length = float(np.linalg.norm(along))
    along = along / length
    outward = np.array([along[1], -along[0]])
    height = share * min(TAB_MM, TAB_SHARE * length)
    return np.array([a, b, b + height * (along + outward), a + height * (outward - along)])


def _drawn(kit: Kit, strip: Strip, tabs: tuple[Floats, ...], joints: list[Fold], numbers: dict[int, int]) -> Page:
    steps = {step.face: number for number, step in enumerate(kit.assembly.steps, 1)}
    bends = {frozenset(j.edge): 180.0 - j.dihedral_degrees for j in kit.assembly.joints}
    faces: list[Face] = []
    labels: list[Label] = []
    for number, outline in strip.outlines.items():
        piece = kit.assembly.pieces[number]
        part = kit.part_set.parts[piece.part]
        step = steps.get(piece.face, number + 1)
        faces.append(Face(number, step, part.class_index, part.name, outline))
        text = f"{part.name} {step}"
        height = min(_label_height(outline), MOST_TEXT * _mean_side(outline) / len(text))
        labels.append(Label(text, outline.mean(axis=0), height))
    lines: list[Line] = []
    folds = set(strip.folds)
    for joint_number, joint in enumerate(joints):
        for end, (piece, side) in enumerate(zip(joint.pieces, joint.sides, strict=True)):
            if piece not in strip.outlines or (joint_number in folds and end):
                continue
            outline = strip.outlines[piece]
            ring = kit.assembly.pieces[piece].vertices
            bend = bends[frozenset((ring[side], ring[(side + 1) % len(ring)]))]
            start, stop = outline[side], outline[(side + 1) % len(outline)]
            lines.append(Line(_fold_kind(bend) if joint_number in folds else "cut", start, stop))
            if joint_number not in folds:
                labels.append(_number(str(numbers[joint_number]), start, stop, outline))
    return Page(tuple(faces), tabs, tuple(lines), tuple(labels))


def _fold_kind(bend_degrees: float) -> str:
    if abs(bend_degrees) < FLAT_DEGREES:
        return "flat"
    return "mountain" if bend_degrees > 0 else "valley"


def _mean_side(outline: Floats) -> float:
    return float(np.linalg.norm(np.roll(outline, -1, axis=0) - outline, axis=1).mean())


def _label_height(outline: Floats) -> float:
    return 0.13 * _mean_side(outline)


def _number(text: str, start: Floats, end: Floats, outline: Floats) -> Label:
    """A cut's number, inside the face beside the middle of the side."""
    height = 0.6 * _label_height(outline)
    along = (end - start) / np.linalg.norm(end - start)
    inward = np.array([-along[1], along[0]])
    return Label(text, (start + end) / 2 + 0.9 * height * inward, height)


# ---- written


def _tint(colour: str) -> str:
    mixed = [round(255 * TINT + (1 - TINT) * value) for value in bytes.fromhex(colour[1:])]
    return "#" + "".join(f"{value:02X}" for value in mixed)


def _heading(net: Net, page: int) -> str:
    scale = "full size" if abs(net.scale - 1) < 1e-9 else f"scale {net.scale:.3g}"
    return (
        f"Page {page} of {len(net.pages)}, {scale}. Cut solid lines; fold dashes back (mountain), dash-dots forward "
        f"(valley); glue equal numbers. The ruler is {RULER_MM:g} mm."
    )


def _ruler(net: Net) -> list[tuple[Floats, Floats]]:
    """Lines of a ruler with a tick each centimetre, under the heading."""
    left, foot = net.size_mm[0] / 2 - RULER_MM / 2, net.size_mm[1] - MARGIN_MM - HEADING_MM + 0.5
    ticks = [(left + 10 * k, 2.0 if k in {0, RULER_MM / 10} else 1.0) for k in range(int(RULER_MM / 10) + 1)]
    return [
        (np.array([left, foot]), np.array([left + RULER_MM, foot])),
        *((np.array([x, foot]), np.array([x, foot + tall])) for x, tall in ticks),
    ]


def net_svg(net: Net) -> bytes:
    """All pages side by side, in mm; each piece a polygon of class `face`, seen from outside."""
    width, height = net.size_mm
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width * len(net.pages):g}mm" height="{height:g}mm" '
        f'viewBox="0 0 {width * len(net.pages):g} {height:g}">',
        f"<title>Net: {sum(len(p.faces) for p in net.pages)} pieces in {net.strips} strips</title>",
        "<style>text{font-family:Helvetica,Arial,sans-serif;text-anchor:middle;dominant-baseline:central}"
        "line,.page,.tab{fill:none;stroke:#000}.tab{stroke:#888;fill:#fff}",
        *(
            f".{kind}{{stroke-width:{stroke:g}" + (f";stroke-dasharray:{_dashes(kind)}" if DASHES[kind] else "") + "}"
            for kind, stroke in WIDTHS.items()
        ),
        "</style>",
    ]
    for number, page in enumerate(net.pages):
        lines += _svg_page(net, number, page)
    return ("\n".join([*lines, "</svg>"]) + "\n").encode()


def _svg_page(net: Net, number: int, page: Page) -> Iterator[str]:
    width, height = net.size_mm

    def point(at: Floats) -> str:
        return f"{at[0]:.6f},{height - at[1]:.6f}"

    yield f'<g transform="translate({width * number:g} 0)">'
    yield f'<rect class="page" width="{width:g}" height="{height:g}"/>'
    yield f'<text x="{width / 2:g}" y="{MARGIN_MM + 1:g}" font-size="3">{escape(_heading(net, number + 1))}</text>'
    for (x1, y1), (x2, y2) in _ruler(net):
        yield f'<line class="cut" x1="{x1:g}" y1="{height - y1:g}" x2="{x2:g}" y2="{height - y2:g}"/>'
    for tab in page.tabs:
        yield f'<polygon class="tab" points="{" ".join(map(point, tab))}"/>'
    for face in page.faces:
        fill = _tint(class_colour(face.class_index))
        yield (
            f'<polygon class="face" data-class="{face.class_name}" data-piece="{face.piece}" '
            f'data-step="{face.step}" fill="{fill}" points="{" ".join(map(point, face.outline))}"/>'
        )
    for line in page.lines:
        (x1, y1), (x2, y2) = line.start, line.end
        yield f'<line class="{line.kind}" x1="{x1:.4f}" y1="{height - y1:.4f}" x2="{x2:.4f}" y2="{height - y2:.4f}"/>'
    for label in page.labels:
        x, y = label.at
        yield f'<text x="{x:.3f}" y="{height - y:.3f}" font-size="{label.height:.2f}">{label.text}</text>'
    yield "</g>"


def _dashes(kind: str) -> str:
    return " ".join(f"{dash:g}" for dash in DASHES[kind])


def net_pdf(net: Net) -> bytes:
    """One PDF page for each page, at true size when printed without scaling."""
    stream = io.BytesIO()
    width, height = net.size_mm
    canvas = Canvas(stream, pagesize=(width * MM, height * MM), invariant=1, pageCompression=1)
    canvas.setTitle("Net")
    canvas.setCreator("drkid")
    for number, page in enumerate(net.pages, 1):
        canvas.scale(MM, MM)
        canvas.setFont("Helvetica", 3)
        canvas.drawCentredString(width / 2, height - MARGIN_MM - 2, _heading(net, number))
        canvas.setLineWidth(WIDTHS["cut"])
        for start, end in _ruler(net):
            canvas.line(*start.tolist(), *end.tolist())
        _pdf_page(canvas, page)
        canvas.showPage()
    canvas.save()
    return stream.getvalue()


def _pdf_page(canvas: Canvas, page: Page) -> None:
    canvas.setStrokeColor(HexColor("#888888"))
    canvas.setLineWidth(WIDTHS["tab"])
    for tab in page.tabs:
        _pdf_polygon(canvas, tab, fill=0, stroke=1)
    for face in page.faces:
        canvas.setFillColor(HexColor(_tint(class_colour(face.class_index))))
        _pdf_polygon(canvas, face.outline, fill=1, stroke=0)
    canvas.setStrokeColor(HexColor("#000000"))
    canvas.setFillColor(HexColor("#000000"))
    for line in page.lines:
        canvas.setLineWidth(WIDTHS[line.kind])
        canvas.setDash(list(DASHES[line.kind]))
        canvas.line(*line.start.tolist(), *line.end.tolist())
    canvas.setDash([])
    for label in page.labels:
        canvas.setFont("Helvetica", label.height)
        canvas.drawCentredString(float(label.at[0]), float(label.at[1]) - 0.35 * label.height, label.text)


def _pdf_polygon(canvas: Canvas, outline: Floats, *, fill: int, stroke: int) -> None:
    path = canvas.beginPath()
    path.moveTo(*outline[0].tolist())
    for corner in outline[1:]:
        path.lineTo(*corner.tolist())
    path.close()
    canvas.drawPath(path, fill=fill, stroke=stroke)
