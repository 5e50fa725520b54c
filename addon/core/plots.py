# SPDX-License-Identifier: GPL-3.0-or-later
"""Line plots over frames, as SVG for a page: text, and nothing to install."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from html import escape

# Told apart by people of all kinds of colour vision (M. Okabe, K. Ito, 2008); readable on light and dark.
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c564b", "#7f7f7f")

WIDTH, HEIGHT = 460, 240
LEFT, RIGHT, TOP, BOTTOM = 62, 14, 30, 34


def line_plot(
    title: str, unit: str, frames: Sequence[float], lines: Mapping[str, Sequence[Sequence[float]]]
) -> str:
    """An <svg> with the lines of each method in its colour, in the order of `lines`.

    lines  by method, one or more lines of a value for each frame; values that are not finite leave gaps
    """
    values = [v for own in lines.values() for line in own for v in line if math.isfinite(v)]
    low, high = min([0.0, *values]), max([0.0, *values])
    if high - low < 1e-12:
        high = low + 1.0
    marks = _round_marks(low, high)
    low, high = min(low, marks[0]), max(high, marks[-1])
    first, last = min(frames), max(frames)

    def x(frame: float) -> float:
        return LEFT + (WIDTH - LEFT - RIGHT) * (0.5 if first == last else (frame - first) / (last - first))

    def y(value: float) -> float:
        return TOP + (HEIGHT - TOP - BOTTOM) * (high - value) / (high - low)

    parts = [
        f'<svg class="plot" viewBox="0 0 {WIDTH} {HEIGHT}" role="img">',
        f"<title>{escape(title)}</title>",
        f'<text x="{LEFT}" y="18" class="plot-title">{escape(title)}'
        f'<tspan class="faint"> {escape(unit)}</tspan></text>',
    ]
    for mark in marks:
        kind = "axis" if mark == 0.0 else "grid"
        parts.append(
            f'<line x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y(mark):.1f}" y2="{y(mark):.1f}" class="{kind}"/>'
            f'<text x="{LEFT - 8}" y="{y(mark) + 4:.1f}" text-anchor="end">{_number(mark, marks)}</text>'
        )
    frame_marks = [first] if first == last else _round_marks(first, last, 6)
    for mark in frame_marks:
        if first <= mark <= last:
            parts.append(
                f'<line x1="{x(mark):.1f}" x2="{x(mark):.1f}" y1="{HEIGHT - BOTTOM}" '
                f'y2="{HEIGHT - BOTTOM + 4}" class="axis"/>'
                f'<text x="{x(mark):.1f}" y="{HEIGHT - BOTTOM + 17}" text-anchor="middle">'
                f"{_number(mark, frame_marks)}</text>"
            )
    for number, (method, own) in enumerate(lines.items()):
        # Where lines lie on each other, the one below still shows on both sides.
        colour, width = colour_of(number), 1.6 + 1.4 * min(len(lines) - 1 - number, 3)
        for line in own:
            for run in _runs(frames, line):
                points = " ".join(f"{x(frame):.1f},{y(value):.1f}" for frame, value in run)
                if len(run) == 1:
                    cx, cy = points.split(",")
                    parts.append(f'<circle cx="{cx}" cy="{cy}" r="3" fill="{colour}"/>')
                else:
                    stroke = f'stroke="{colour}" stroke-width="{width:.1f}"'
                    name = f"<title>{escape(method)}</title>"
                    parts.append(f'<polyline points="{points}" {stroke}>{name}</polyline>')
    parts.append("</svg>")
    return "".join(parts)


def colour_of(number: int) -> str:
    return COLOURS[number % len(COLOURS)]


def _runs(frames: Sequence[float], line: Sequence[float]) -> list[list[tuple[float, float]]]:
    """The stretches of a line between values that are not finite."""
    runs: list[list[tuple[float, float]]] = [[]]
    for frame, value in zip(frames, line, strict=True):
        if math.isfinite(value):
            runs[-1].append((frame, value))
        elif runs[-1]:
            runs.append([])
    return [run for run in runs if run]


def _round_marks(low: float, high: float, count: int = 5) -> list[float]:
    """About `count` round numbers that reach over low..high: 1, 2 or 5 times a power of ten apart."""
    rough = (high - low) / count
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(m * power for m in (1.0, 2.0, 5.0, 10.0) if m * power >= rough * 0.999)
    start, stop = math.floor(low / step + 1e-9), math.ceil(high / step - 1e-9)
    return [number * step for number in range(start, stop + 1)]


def _number(value: float, marks: Sequence[float]) -> str:
    """As many digits as tell the marks apart."""
    step = abs(marks[1] - marks[0]) if len(marks) > 1 else abs(value) or 1.0
    digits = max(0, -math.floor(math.log10(step) + 1e-9))
    if digits > 5:
        return f"{value:.0e}" if value else "0"
    return f"{value:.{digits}f}"
