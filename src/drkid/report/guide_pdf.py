"""The guide as PDF on A4, a group of steps a sheet."""

import io

from reportlab.lib.utils import simpleSplit
from reportlab.pdfgen.canvas import Canvas

from drkid.report.drawing import POINT, draw_on
from drkid.report.guide import Guide, joined_text
from drkid.report.guide_pages import GAP_MM, Page, PartLine, front_lines, part_lines

WIDTH, HEIGHT, MARGIN = 210.0, 297.0, 15.0  # mm: A4
TEXT, SMALL, HEAD = 10.0, 8.5, 15.0  # points
LEADING = 1.3  # of the letters' size
COLUMNS = 2  # of steps


class _Sheet:
    """A canvas with a pen that moves down the page."""

    def __init__(self, title: str) -> None:
        self.buffer = io.BytesIO()
        self.canvas = Canvas(self.buffer, pagesize=(WIDTH / POINT, HEIGHT / POINT), invariant=1, pageCompression=1)
        self.canvas.setTitle(title)
        self.canvas.setCreator("drkid")
        self.y, self.number = HEIGHT - MARGIN, 1

    def line(self, text: str, size: float = TEXT, x: float = MARGIN, font: str = "Helvetica") -> None:
        self.y -= size * LEADING * POINT
        self.canvas.setFont(font, size)
        self.canvas.setFillColor("#000000")
        self.canvas.drawString(x / POINT, self.y / POINT, winansi(text))

    def paragraph(self, text: str, size: float = TEXT) -> None:
        for line in simpleSplit(winansi(text), "Helvetica", size, (WIDTH - 2 * MARGIN) / POINT):
            self.line(line, size)
        self.y -= 2

    def room(self, height: float) -> None:
        if self.y - height < MARGIN:
            self.turn()

    def turn(self) -> None:
        self.canvas.setFont("Helvetica", SMALL)
        self.canvas.drawRightString((WIDTH - MARGIN) / POINT, 8 / POINT, str(self.number))
        self.canvas.showPage()
        self.number += 1
        self.y = HEIGHT - MARGIN

    def saved(self) -> bytes:
        self.turn()
        self.canvas.save()
        return self.buffer.getvalue()


def winansi(text: str) -> str:
    """Text in the letters that a PDF's own fonts have; others become question marks."""
    return text.encode("cp1252", "replace").decode("cp1252")


def guide_pdf(guide: Guide, pages: list[Page], closing: Page) -> bytes:
    """The guide; the same kit makes the same bytes."""
    title = f"How to build the kit of {guide.scene.document.source.name}"
    sheet = _Sheet(winansi(title))
    for line in simpleSplit(winansi(title), "Helvetica-Bold", HEAD, (WIDTH - 2 * MARGIN) / POINT):
        sheet.line(line, HEAD, font="Helvetica-Bold")
    sheet.y -= 3
    for text in front_lines(guide):
        sheet.paragraph(text)
    _parts(sheet, part_lines(guide), closing)
    for page in pages:
        sheet.turn()
        _group(sheet, page)
    sheet.turn()
    sheet.line("Closing the shell", HEAD, font="Helvetica-Bold")
    sheet.y -= 2
    sheet.paragraph(closing.text)
    _drawings(sheet, closing)
    return sheet.saved()


def _parts(sheet: _Sheet, lines: list[PartLine], closing: Page) -> None:
    for line, drawing in zip(lines, closing.parts, strict=True):
        sheet.room(drawing.height + 4)
        draw_on(sheet.canvas, drawing, MARGIN, sheet.y - drawing.height)
        middle, x = sheet.y - drawing.height / 2, MARGIN + drawing.width + 8
        sides = ",   ".join(f"{word} {length:.1f} mm" for word, length in line.sides)
        after = sheet.y - drawing.height - 4
        sheet.y = middle + 6
        sheet.line(f"{line.count} × {line.name}", HEAD, x, "Helvetica-Bold")
        sheet.line(sides, TEXT, x)
        sheet.line(line.file, SMALL, x)
        sheet.y = after


def _group(sheet: _Sheet, page: Page) -> None:
    steps = page.steps
    sheet.line(page.heading, HEAD, font="Helvetica-Bold")
    sheet.y -= 3
    _drawings(sheet, page)
    width = (WIDTH - 2 * MARGIN) / COLUMNS
    rows = -(-len(steps) // COLUMNS)
    top = lowest = sheet.y
    for column in range(COLUMNS):
        sheet.y = top
        for step in steps[column * rows : (column + 1) * rows]:
            text = f"{step.step} {step.part}: {joined_text(step)}"
            for line in simpleSplit(text, "Helvetica", TEXT, (width - 5) / POINT):
                sheet.line(line, TEXT, MARGIN + column * width)
            sheet.y -= 1
        lowest = min(lowest, sheet.y)
    sheet.y = lowest


def _drawings(sheet: _Sheet, page: Page) -> None:
    """In rows, as many in each as there is room for, in the middle."""
    rows: list[list[int]] = [[]]
    for i, drawing in enumerate(page.drawings):
        used = sum(page.drawings[j].width + GAP_MM for j in rows[-1])
        if rows[-1] and used + drawing.width > WIDTH - 2 * MARGIN + 1:
            rows.append([])
        rows[-1].append(i)
    for row in rows:
        drawings = [page.drawings[i] for i in row]
        tallest, x = max(d.height for d in drawings), (WIDTH - sum(d.width + GAP_MM for d in drawings) + GAP_MM) / 2
        for drawing in drawings:
            draw_on(sheet.canvas, drawing, x, sheet.y - (tallest + drawing.height) / 2)
            x += drawing.width + GAP_MM
        sheet.y -= tallest + GAP_MM
