"""The guide as one HTML page, which prints a group of steps a sheet."""

from functools import cache
from html import escape
from importlib.resources import files
from string import Template

from drkid.report.drawing import svg
from drkid.report.guide import Guide, Instruction, joined_text
from drkid.report.guide_pages import Page, front_lines, part_lines
from drkid.report.tables import Html, table


def guide_html(guide: Guide, pages: list[Page], closing: Page) -> str:
    """The page, self-contained: pictures are inline SVG."""
    return Template(_template()).substitute(
        title=escape(f"How to build the kit of {guide.scene.document.source.name}"),
        front=_front(guide, closing),
        groups="\n".join(_group(page) for page in pages),
        closing=escape(closing.text),
        last=_figure(closing),
    )


@cache
def _template() -> str:
    return (files("drkid.report") / "page" / "guide.html").read_text(encoding="utf-8")


def _front(guide: Guide, closing: Page) -> str:
    lines = "".join(f"<p>{escape(line)}</p>" for line in front_lines(guide))
    drawings = dict(zip(guide.part_names, closing.parts, strict=True))
    rows = [
        (Html(svg(drawings[line.file])), line.name, line.count, line.file, Html(_sides(line.sides)))
        for line in part_lines(guide)
    ]
    return lines + table(("outer face", "piece", "how many", "file", "sides in mm"), rows)


def _sides(sides: tuple[tuple[str, float], ...]) -> str:
    return ", ".join(f'<span class="ticks">{word}</span> {length:.1f}' for word, length in sides)


def _group(page: Page) -> str:
    items = "".join(f"<li>{_step(step)}</li>" for step in page.steps)
    return f'<section><h2>{page.heading}</h2>{_figure(page)}<ol class="steps">{items}</ol></section>'


def _step(step: Instruction) -> str:
    return f"<b>{step.step}</b> {escape(step.part)}: {escape(joined_text(step))}"


def _figure(page: Page) -> str:
    return f"<figure>{''.join(svg(drawing) for drawing in page.drawings)}</figure>"
