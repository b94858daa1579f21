"""The sheets of the guide, drawn: what HTML and PDF have in common."""

from dataclasses import dataclass

import numpy as np

from drkid.export.document import ClassDocument, PartDocument
from drkid.mesh import Floats
from drkid.report.building_picture import Builder
from drkid.report.drawing import Drawing
from drkid.report.guide import Guide, Instruction, closing_text, joining_text, tick_word

SHEET_MM = (180.0, 180.0)  # room for the pictures of a group on A4
GAP_MM = 5.0  # between pictures
PART_MM = 28.0  # width of a part in the table of classes


@dataclass(frozen=True)
class PartLine:
    """A row of the table of pieces: `sides` are their ticks and lengths, ascending, or numbers and lengths in order."""

    file: str
    name: str
    count: int
    sides: tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class Page:
    """A sheet: its steps, their pictures, and what else is on it."""

    steps: tuple[Instruction, ...]
    drawings: tuple[Drawing, ...]
    text: str = ""
    parts: tuple[Drawing, ...] = ()

    @property
    def heading(self) -> str:
        """Steps 1 to 15."""
        first, last = self.steps[0].step, self.steps[-1].step
        return f"Steps {first} to {last}" if first < last else f"Step {first}"


def guide_pages(guide: Guide) -> tuple[list[Page], Page]:
    """The groups of steps, and the sheet that closes the shell, which carries the drawings of the parts."""
    builder = Builder(guide)
    pages = [_page(builder, group) for group in guide.groups]
    last = guide.instructions[-1:]
    view = builder.views(last)[0]
    parts = tuple(builder.part_drawing(file, PART_MM) for file in guide.part_names)
    return pages, Page(last, (builder.drawing(last, view, *SHEET_MM),), closing_text(guide), parts)


def _page(builder: Builder, group: tuple[Instruction, ...]) -> Page:
    """One large picture, or a few smaller ones where no direction shows all new pieces: as large as they can be."""
    views = builder.views(group)
    shapes = [builder.extents(group, view) for view in views]
    columns = max((1, 2), key=lambda columns: _scale(shapes, columns))
    return Page(group, tuple(builder.drawing(group, view, *_room(len(views), columns)) for view in views))


def _room(pictures: int, columns: int) -> tuple[float, float]:
    """Width and height in mm for each of so many pictures."""
    columns = min(columns, pictures)
    rows = -(-pictures // columns)
    width, height = SHEET_MM
    return (width - GAP_MM * (columns - 1)) / columns, (height - GAP_MM * (rows - 1)) / rows


def _scale(shapes: list[Floats], columns: int) -> float:
    """Sum of the scales at which pictures of such extents fill their rooms."""
    room = np.array(_room(len(shapes), columns))
    return sum(float((room / shape).min()) for shape in shapes)


def part_lines(guide: Guide) -> list[PartLine]:
    """What there is of each part."""
    return [
        PartLine(part.file, guide.part_names[part.file], part.count, _sides(guide, ticks, one, part))
        for one, ticks in zip(guide.scene.document.classes, guide.ticks, strict=True)
        for part in one.parts
    ]


def _sides(
    guide: Guide, ticks: tuple[int, ...], one: ClassDocument, part: PartDocument
) -> tuple[tuple[str, float], ...]:
    if guide.is_merged:
        return tuple((f"{number}:", length) for number, length in enumerate(part.side_lengths, 1))
    return tuple((tick_word(count), length) for count, length in zip(ticks, one.edge_lengths, strict=True))


def front_lines(guide: Guide) -> list[str]:
    """What to know before beginning."""
    document = guide.scene.document
    items = [
        f"{item.count} × {_hardware(item.name, item.file, item.diameter, item.length)}" for item in document.hardware
    ]
    also = f" and {', '.join(items)}" if items else ""
    return [
        f"{len(document.pieces)} pieces in {len(document.classes)} classes{also}; about "
        f"{' × '.join(f'{x:.0f}' for x in guide.scene.assembled.extents)} mm when it stands.",
        *(_merged_lines(guide) if guide.is_merged else _lines()),
        "You look at the outer faces. " + joining_text(guide),
    ]


def _lines() -> list[str]:
    return [
        "Every piece has the number of its step. Pictures show what stands, grey, and the new pieces in the colour of "
        "their class, with their number, the letter of their class and ticks that tell their sides apart: one tick on "
        "the shortest side, two on the next longer, three on the longest; equal sides carry equal ticks.",
        "A line such as “7 A: | to || of 3” means: piece 7 is of class A; join its side with one tick to the side "
        "with two ticks of piece 3. L and R in pictures are the left and right hand of pieces whose mirror images "
        "differ.",
    ]


def _merged_lines(guide: Guide) -> list[str]:
    spec = guide.scene.document.spec
    engraved = spec.get("marks") and spec.get("mark_depth_mm")
    return [
        "Every piece has the number of its step. Pictures show what stands, grey, and the new pieces in the colour of "
        "their class, with their number, the letters of their class and the numbers of their sides, which run "
        "counter-clockwise.",
        "A line such as “7 B: side 2 to side 5 of 3” means: piece 7 is of class B; join its side 2 to side 5 of "
        "piece 3.",
        "The same letters and numbers are engraved inside, where there was room; seen from there sides run clockwise."
        if engraved
        else "Pieces bear no marks, and many look alike. Each build plate holds one class: write its letters, and 1 "
        "beside side 1, on the inner face of each piece as it comes off.",
    ]


def _hardware(name: str | None, file: str | None, diameter: float | None, length: float | None) -> str:
    if diameter is not None and length is not None:
        return f"{name or 'rod'} of {diameter:g} mm, {length:g} mm long"
    return f"{(name or '').replace('_', ' ')} ({file})"
