"""Seven-segment figures as solids, for engraving: straight strokes that every process can make."""

from drkid.solid import Solid

FIGURE_MM = (2.6, 4.2)  # width and height, stroke included
ADVANCE_MM = 3.8  # from one figure to the next
SEGMENTS = {
    "0": "abcdef", "1": "bc", "2": "abged", "3": "abgcd", "4": "fgbc",
    "5": "afgcd", "6": "afgedc", "7": "abc", "8": "abcdefg", "9": "abcdfg",
}  # fmt: skip


def width_mm(text: str) -> float:
    """Of a row of figures."""
    return (len(text) - 1) * ADVANCE_MM + FIGURE_MM[0]


def figures(text: str, stroke_mm: float, depth_mm: float) -> list[Solid]:
    """The strokes of a row of figures, from z = −depth up over z = 0, centred on x = 0, standing on y = 0."""
    left = -width_mm(text) / 2
    return [
        _stroke(segment, left + i * ADVANCE_MM, stroke_mm, depth_mm)
        for i, figure in enumerate(text)
        for segment in SEGMENTS[figure]
    ]


def _stroke(segment: str, x: float, stroke: float, depth: float) -> Solid:
    width, height = FIGURE_MM
    middle = (height - stroke) / 2
    low, high = {
        "a": ((0, height - stroke), (width, height)),
        "b": ((width - stroke, middle), (width, height)),
        "c": ((width - stroke, 0), (width, middle + stroke)),
        "d": ((0, 0), (width, stroke)),
        "e": ((0, 0), (stroke, middle + stroke)),
        "f": ((0, middle), (stroke, height)),
        "g": ((0, middle), (width, middle + stroke)),
    }[segment]
    return Solid.box((x + low[0], low[1], -depth), (x + high[0], high[1], depth))
