"""Plots as inline SVG, in the page's own colours."""

from collections.abc import Sequence
from html import escape

import numpy as np

from drkid.mesh import Floats

WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 900, 300, 70, 12, 14, 40
LEAST_POSITIVE = 1e-15  # of a logarithmic axis, in percent: below the last bit of a length


def lines(x: Floats, series: dict[str, Floats], labels: tuple[str, str], limit: tuple[str, float] | None = None) -> str:
    """Series over `x` on a logarithmic axis, each named; `limit` is drawn across, dashed."""
    every = [np.maximum(y, LEAST_POSITIVE) for y in series.values()]
    known = np.concatenate([*every, [] if limit is None else [limit[1]]])
    low, high = np.floor(np.log10(known.min())), np.ceil(np.log10(known.max()))
    high = max(high, low + 1)
    span = max(float(x[-1] - x[0]), 1.0)

    def across(values: Floats) -> Floats:
        return LEFT + (values - x[0]) / span * (WIDTH - LEFT - RIGHT)

    def down(values: Floats) -> Floats:
        return TOP + (high - np.log10(values)) / (high - low) * (HEIGHT - TOP - BOTTOM)

    step = max(1, int(np.ceil((high - low) / 6)))
    powers = np.arange(low, high + 1, step)
    parts = [_level(float(down(np.array(10.0**p))), f"1e{p:.0f}" if abs(p) > 3 else f"{10.0**p:g}") for p in powers]
    for (name, _), y in zip(series.items(), every, strict=True):
        points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(across(x), down(y), strict=True))
        parts.append(f'<polyline class="{escape(name)}" points="{points}"><title>{escape(name)}</title></polyline>')
    for i, name in enumerate(series):
        at = WIDTH - RIGHT - 150 + 75 * i
        parts.append(f'<polyline class="{escape(name)}" points="{at},{TOP + 8} {at + 20},{TOP + 8}"/>')
        parts.append(f'<text x="{at + 25}" y="{TOP + 12}">{escape(name)}</text>')
    if limit is not None:
        y = float(down(np.array(limit[1])))
        parts.append(f'<path class="axis" stroke-dasharray="2 4" d="M{LEFT} {y:.1f}H{WIDTH - RIGHT}"/>')
        parts.append(f'<text class="on" x="{LEFT + 6}" y="{y - 5:.1f}">{escape(limit[0])}</text>')
    ends = [(float(x[0]), "start"), (float(x[-1]), "end")]
    parts += [
        f'<text x="{across(np.array(v)):.1f}" y="{HEIGHT - BOTTOM + 16}" text-anchor="{anchor}">{v:g}</text>'
        for v, anchor in ends
    ]
    return _framed(parts, labels)


def bars(values: Floats, colours: Sequence[str], names: Sequence[str], labels: tuple[str, str]) -> str:
    """One bar for each value, from 0, in its colour; its name is told by pointing at it."""
    top = _round_up(float(values.max()))
    wide, high = (WIDTH - LEFT - RIGHT) / len(values), HEIGHT - TOP - BOTTOM
    parts = [_level(TOP + high * (1 - share), f"{top * share:.3g}") for share in (0, 0.25, 0.5, 0.75, 1)]
    for i, (value, tint, name) in enumerate(zip(values.tolist(), colours, names, strict=True)):
        tall = high * value / top
        parts.append(
            f'<rect x="{LEFT + i * wide:.2f}" y="{TOP + high - tall:.2f}" width="{max(0.8 * wide, 0.5):.2f}" '
            f'height="{tall:.2f}" fill="{tint}"><title>{escape(name)}</title></rect>'
        )
    mean = TOP + high * (1 - float(values.mean()) / top)
    parts.append(f'<path class="axis" stroke-dasharray="6 3" d="M{LEFT} {mean:.2f}H{WIDTH - RIGHT}"/>')
    parts.append(
        f'<text class="on" x="{WIDTH - RIGHT}" y="{mean - 4:.2f}" text-anchor="end">mean {values.mean():.3g}</text>'
    )
    parts.append(f'<text x="{LEFT}" y="{HEIGHT - BOTTOM + 16}">1</text>')
    parts.append(f'<text x="{WIDTH - RIGHT}" y="{HEIGHT - BOTTOM + 16}" text-anchor="end">{len(values)}</text>')
    return _framed(parts, labels)


def _round_up(value: float) -> float:
    """The next of 1, 2, 5, 10, … times a power of ten."""
    if value <= 0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * next(m for m in (1, 2, 5, 10, 20) if m * power >= value))


def _level(y: float, text: str) -> str:
    return (
        f'<path class="grid" d="M{LEFT} {y:.1f}H{WIDTH - RIGHT}"/>'
        f'<text x="{LEFT - 8}" y="{y + 4:.1f}" text-anchor="end">{text}</text>'
    )


def _framed(parts: list[str], labels: tuple[str, str]) -> str:
    middle = (LEFT + WIDTH - RIGHT) / 2, (TOP + HEIGHT - BOTTOM) / 2
    names = (
        f'<text x="{middle[0]}" y="{HEIGHT - 6}" text-anchor="middle">{escape(labels[0])}</text>'
        f'<text transform="translate(14 {middle[1]}) rotate(-90)" text-anchor="middle">{escape(labels[1])}</text>'
    )
    title = escape(f"{labels[1]} over {labels[0]}")
    return (
        f'<svg class="plot" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{title}">'
        f"{''.join(parts)}{names}</svg>"
    )
