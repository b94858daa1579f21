"""Drawings of flat shapes and words in mm, as SVG and on a PDF page."""

from dataclasses import dataclass
from functools import cache
from html import escape
from typing import TYPE_CHECKING, Literal

from drkid.mesh import Floats

if TYPE_CHECKING:
    from reportlab.pdfgen.canvas import Canvas

POINT = 25.4 / 72  # mm
BASELINE = 0.36  # of a letter's size: from its middle down to the line it stands on


@dataclass(frozen=True, eq=False)
class Shape:
    """A polygon, closed, or a line: points (n, 2), y upwards, colours as #RRGGBB."""

    points: Floats
    fill: str | None = None
    stroke: str | None = None
    width: float = 0.2


@dataclass(frozen=True)
class Word:
    """Text about a point; `size` in mm; `halo` is drawn around its letters."""

    x: float
    y: float
    text: str
    size: float
    bold: bool = False
    colour: str = "#000000"
    halo: str | None = None


@dataclass(frozen=True, eq=False)
class Drawing:
    """Shapes and words in the order in which they are painted, on a sheet from (0, 0) to (width, height)."""

    width: float
    height: float
    items: tuple[Shape | Word, ...]
    title: str = ""


def svg(drawing: Drawing) -> str:
    """The drawing as inline SVG, as wide as it is in mm where there is room."""
    body = "".join(_svg_item(item, drawing.height) for item in drawing.items)
    return (
        f'<svg viewBox="0 0 {drawing.width:.6g} {drawing.height:.6g}" style="width:{drawing.width:.6g}mm" '
        f'stroke-linejoin="round" role="img" aria-label="{escape(drawing.title)}">{body}</svg>'
    )


def _svg_item(item: Shape | Word, height: float) -> str:
    if isinstance(item, Shape):
        path = " ".join(f"{x:.2f} {height - y:.2f}" for x, y in item.points.tolist())
        stroke = "" if item.stroke is None else f' stroke="{item.stroke}" stroke-width="{item.width:.2f}"'
        close = "" if item.fill is None else "Z"
        return f'<path d="M{path}{close}" fill="{item.fill or "none"}"{stroke}/>'
    halo = f' stroke="{item.halo}" stroke-width="{item.size / 4:.2f}" paint-order="stroke"' if item.halo else ""
    weight = ' font-weight="bold"' if item.bold else ""
    return (
        f'<text x="{item.x:.2f}" y="{height - item.y + BASELINE * item.size:.2f}" font-size="{item.size:.2f}" '
        f'text-anchor="middle" fill="{item.colour}"{halo}{weight}>{escape(item.text)}</text>'
    )


def draw_on(canvas: "Canvas", drawing: Drawing, x: float, y: float) -> None:
    """Paint the drawing with its lower left corner at (x, y) in mm."""
    canvas.saveState()
    canvas.scale(1 / POINT, 1 / POINT)
    canvas.translate(x, y)
    canvas.setLineJoin(1)
    for item in drawing.items:
        if isinstance(item, Shape):
            _pdf_shape(canvas, item)
        else:
            _pdf_word(canvas, item)
    canvas.restoreState()


def _pdf_shape(canvas: "Canvas", item: Shape) -> None:
    path = canvas.beginPath()
    first, *others = item.points.tolist()
    path.moveTo(*first)
    for point in others:
        path.lineTo(*point)
    if item.fill is not None:
        path.close()
        canvas.setFillColorRGB(*_channels(item.fill))
    if item.stroke is not None:
        canvas.setStrokeColorRGB(*_channels(item.stroke))
        canvas.setLineWidth(item.width)
    canvas.drawPath(path, stroke=int(item.stroke is not None), fill=int(item.fill is not None))


@cache
def _channels(code: str) -> tuple[float, float, float]:
    return int(code[1:3], 16) / 255, int(code[3:5], 16) / 255, int(code[5:7], 16) / 255


def _pdf_word(canvas: "Canvas", item: Word) -> None:
    font, base = "Helvetica-Bold" if item.bold else "Helvetica", item.y - BASELINE * item.size
    start = item.x - canvas.stringWidth(item.text, font, item.size) / 2
    modes: list[tuple[Literal[0, 1], str]] = [(1, item.halo)] if item.halo else []
    modes.append((0, item.colour))
    for mode, colour in modes:  # outlines first, then the letters on them
        text = canvas.beginText(start, base)
        text.setFont(font, item.size)
        text.setTextRenderMode(mode)
        text.setFillColor(colour)
        text.setStrokeColor(colour)
        canvas.setLineWidth(item.size / 4)
        text.textOut(item.text)
        text.setTextRenderMode(0)
        canvas.drawText(text)
