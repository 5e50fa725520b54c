# SPDX-License-Identifier: GPL-3.0-or-later
"""The legend of the heat map, drawn over the 3D views: what is shown, and the values of the colours."""

import blf
import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader

from ...io import units
from ...ui.sidebar import uncovered
from ..measure.heat_scale import HeatScale
from . import bake_error

WIDTH, BAR, MARGIN, GAP, FONT_SIZE = 420, 14, 24, 8, 12
STEPS, LABELS = 64, 5
BACKGROUND, TEXT = (0.08, 0.08, 0.08, 0.75), (1.0, 1.0, 1.0, 1.0)


# By the session_uid of the measured scene: the range, and the measure with its methods.
contents: dict[int, tuple[HeatScale, str]] = {}


def labels(scale: HeatScale, scene: bpy.types.Scene) -> list[str]:
    """Returns the values at equal distances along the legend, with their unit."""
    texts = [units.text(scene, scale.metric.unit, value) for value in scale.ticks(LABELS)]
    if scale.clipped:
        texts[-1] = f"\u2265 {texts[-1]}"
        if scale.low != 0.0:
            texts[0] = f"\u2264 {texts[0]}"
    return texts


def draw() -> None:
    context = bpy.context
    content = contents.get(context.scene.session_uid) or bake_error.legend_of(context.scene)
    if content is None or not context.space_data.overlay.show_overlays:
        return
    scale, title = content
    size = context.preferences.system.ui_scale
    left, right = uncovered(context.area, context.region)
    width = min(WIDTH * size, right - left - 2 * MARGIN * size)
    x, y = (left + right - width) / 2, MARGIN * size
    blf.size(0, FONT_SIZE * size)
    blf.color(0, *TEXT)
    line = blf.dimensions(0, "Mg")[1] + GAP * size
    pad = 1.5 * GAP * size
    draw_rectangle(x - 2 * pad, y - pad, width + 4 * pad, 2 * line + BAR * size + 2 * pad, BACKGROUND)
    texts = labels(scale, context.scene)
    if len(texts) * max(blf.dimensions(0, text)[0] + GAP * size for text in texts) > width:
        texts = [texts[0], *[""] * (len(texts) - 2), texts[-1]]
    for number, text in enumerate(texts):
        share, wide = number / (len(texts) - 1), blf.dimensions(0, text)[0]
        # The first begins at the start of the bar, and the last ends at its end.
        is_end = number in (0, len(texts) - 1)
        _write(text, x + share * (width - wide) if is_end else x + share * width - wide / 2, y)
    _bar(scale, x, y + line, width, BAR * size)
    _write(title, x, y + line + (BAR + GAP) * size)


def _write(text: str, x: float, y: float) -> None:
    blf.position(0, round(x), round(y), 0)
    blf.draw(0, text)


def draw_rectangle(x: float, y: float, width: float, height: float, colour: tuple[float, ...]) -> None:
    corners = [(x, y), (x + width, y), (x, y + height), (x + width, y + height)]
    _strip(corners, [colour] * 4)


def _bar(scale: HeatScale, x: float, y: float, width: float, height: float) -> None:
    shares = np.linspace(0.0, 1.0, STEPS)
    corners = [(x + share * width, y + up) for share in shares for up in (0.0, height)]
    _strip(corners, [(*colour, 1.0) for colour in scale.ramp(shares) for _corner in range(2)])


def _strip(corners: list[tuple[float, float]], colours: list[tuple[float, ...]]) -> None:
    shader = gpu.shader.from_builtin("SMOOTH_COLOR")
    batch = batch_for_shader(shader, "TRI_STRIP", {"pos": [(*c, 0.0) for c in corners], "color": colours})
    gpu.state.blend_set("ALPHA")
    batch.draw(shader)
    gpu.state.blend_set("NONE")
