# SPDX-License-Identifier: GPL-3.0-or-later
"""Plots as SVG text for a page, by matplotlib, which Blender's own Python does not have."""

from __future__ import annotations

import io
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from ...base.errors import SinewError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Distinguishable with all kinds of colour vision (M. Okabe, K. Ito, 2008); readable on light and dark.
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c564b", "#7f7f7f")

# Replaced by the page's text colour, which is light in a dark page. No other part of a plot has this colour.
_TEXT_COLOUR = "#010203"


def line_plot(
    title: str, unit: str, frames: Sequence[float], lines: Mapping[str, Sequence[Sequence[float]]]
) -> str:
    """Returns an <svg> with the lines of each method in its colour, in the order of `lines`.

    lines  by method, one or more lines with a value for each frame; values that are not finite leave gaps

    Raises SinewError where matplotlib is missing.
    """
    settings = {"axes.spines.top": False, "axes.spines.right": False, "lines.markersize": 4}
    with new_figure(title, (4.6, 2.4), settings) as figure:
        axes = figure.add_subplot()
        name = re.sub(r"\W+", "-", title)
        for number, own in enumerate(lines.values()):
            # Where lines coincide, the lower ones remain visible at both edges of the upper ones.
            style: dict[str, Any] = {
                "color": colour_of(number),
                "linewidth": 1.6 + 1.4 * min(len(lines) - 1 - number, 3),
            }
            for index, line in enumerate(own):
                finite = [value if math.isfinite(value) else math.nan for value in line]
                alone = _without_neighbours(finite)
                axes.plot(frames, finite, gid=f"{name}-line-{number}-{index}", **style)
                axes.plot(
                    [frames[i] for i in alone],
                    [finite[i] for i in alone],
                    "o",
                    gid=f"{name}-points-{number}-{index}",
                    **style,
                )
        axes.axhline(0.0, color=_TEXT_COLOUR, linewidth=0.8, zorder=0)
        axes.grid(axis="y", alpha=0.25, color=_TEXT_COLOUR)
        axes.locator_params(axis="y", nbins=6)
        axes.locator_params(axis="x", nbins=7, integer=True)
        axes.margins(x=0.02)
        axes.set_title(f"{title} ({unit})" if unit else title, loc="left", parse_math=False)
        return to_svg(figure).replace(_TEXT_COLOUR, "currentColor")


def colour_of(number: int) -> str:
    return COLOURS[number % len(COLOURS)]


def _without_neighbours(line: Sequence[float]) -> list[int]:
    """Indices of the frames at which a line has a value but no segment."""
    padded = [math.nan, *line, math.nan]
    return [
        i
        for i, value in enumerate(line)
        if math.isfinite(value) and not (math.isfinite(padded[i]) or math.isfinite(padded[i + 2]))
    ]


@contextmanager
def new_figure(
    salt: str, inches: tuple[float, float], settings: Mapping[str, Any] | None = None
) -> Iterator[Figure]:
    """Context with a figure that needs no screen. Raises SinewError where matplotlib is missing.

    salt  of the ids in the SVG: different for each plot of a page, and the same in each run
    """
    try:
        import matplotlib
        from matplotlib.figure import Figure
    except ImportError:
        raise SinewError(
            "plots need matplotlib, which this Python does not have; pip install matplotlib and try again"
        ) from None
    # Text stays text, in the page's own font.
    usual = {"svg.fonttype": "none", "svg.hashsalt": salt, "font.family": "sans-serif", "font.size": 10}
    text = (
        "text.color",
        "axes.edgecolor",
        "axes.labelcolor",
        "axes.titlecolor",
        "xtick.color",
        "ytick.color",
    )
    colours = dict.fromkeys(text, _TEXT_COLOUR) if settings is not None else {}
    with matplotlib.rc_context({**usual, **colours, **(settings or {})}):
        yield Figure(figsize=inches, layout="constrained")


def to_svg(figure: Figure) -> str:
    """Returns the <svg> element alone, without a background or links outside the page."""
    file = io.StringIO()
    metadata = dict.fromkeys(("Creator", "Date", "Format", "Type"))
    figure.savefig(file, format="svg", transparent=True, metadata=metadata)
    text = file.getvalue()
    return text[text.index("<svg") :]
