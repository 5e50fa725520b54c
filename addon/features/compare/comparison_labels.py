# SPDX-License-Identifier: GPL-3.0-or-later
"""The methods' names above a comparison's characters, drawn in the 3D views; nothing of this is in the
file."""

from collections.abc import Sequence

import blf
import bpy
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d
from mathutils import Vector

from ...attach import properties
from ...ui.translations import tr
from ..heat.heat_legend import draw_rectangle
from . import comparison, comparison_state

FONT = 0
# In points, at scale 1.
SIZE, PADDING, STRIPE, ABOVE = 13, 6, 3, 16
# Room for the headers and for some labels above each other.
BELOW_TOP = 150
BACKGROUND = (0.05, 0.05, 0.05, 0.75)


def labels(context: bpy.types.Context) -> list[tuple[str, tuple[float, float, float], Vector]]:
    """Returns text, colour and world position of each label: centred above a method's visible copies, or
    above the originals."""
    state = comparison_state.of_scene(context.scene)
    if state is None:
        return []
    groups: dict[str, list[bpy.types.Object]] = {}
    for copy in comparison_state.copies_of(state):
        groups.setdefault(properties.of(copy).identity.method, []).append(copy)
    found = []
    originals = comparison.originals(state)
    if originals:
        text = tr("Original: {method}", method=comparison.label_shown(originals[0]))
        found.append((text, (1.0, 1.0, 1.0), originals))
    for method in comparison_state.shown_methods(state):
        copies = groups.get(method, [])
        if copies:
            found.append((comparison_state.label_of(method), tuple(copies[0].color[:3]), copies))
    depsgraph = context.evaluated_depsgraph_get()
    placed = [(text, colour, _top(objects, context, depsgraph)) for text, colour, objects in found]
    return [label for label in placed if label[2] is not None]


def _top(
    objects: list[bpy.types.Object], context: bpy.types.Context, depsgraph: bpy.types.Depsgraph
) -> Vector | None:
    """Returns None where none of the objects is visible."""
    visible = [obj for obj in objects if obj.visible_get(viewport=context.space_data)]
    if not visible:
        return None
    points = np.concatenate([comparison.corners(obj.evaluated_get(depsgraph)) for obj in visible])
    low, high = points.min(axis=0), points.max(axis=0)
    return Vector(((low[0] + high[0]) / 2, (low[1] + high[1]) / 2, high[2]))


def draw() -> None:
    context = bpy.context
    if context.space_data.type != "VIEW_3D" or not context.space_data.overlay.show_overlays:
        return
    scale = context.preferences.system.ui_scale
    blf.size(FONT, SIZE * scale)
    line = (0.75 * SIZE + 2 * PADDING + STRIPE + 2) * scale
    found = []
    for text, colour, place in labels(context):
        point = location_3d_to_region_2d(context.region, context.region_data, place)
        if point is not None:
            # Close up, the label stays visible.
            y = min(point.y, context.region.height - BELOW_TOP * scale) + ABOVE * scale
            width = blf.dimensions(FONT, text)[0]
            found.append((text, colour, point.x - width / 2, y, width))
    heights = apart([(x, y, width) for _text, _colour, x, y, width in found], line, 2 * PADDING * scale)
    for (text, colour, x, _y, width), y in zip(found, heights, strict=True):
        _draw_label(text, colour, x, y, width, scale)


def apart(labels: Sequence[tuple[float, float, float]], line: float, gap: float) -> list[float]:
    """Returns the height at which to draw each label so that none covers another: its own, or above those in
    its way.

    labels  the left edge, height and width of each, in pixels
    line    the smallest difference of the heights of two labels above each other
    gap     the smallest distance of two labels beside each other
    """
    placed: list[tuple[float, float, float]] = []
    for left, height, width in labels:
        beside = [y for x, y, w in placed if left < x + w + gap and x < left + width + gap]
        for other in sorted(beside):
            if abs(height - other) < line:
                height = other + line
        placed.append((left, height, width))
    return [height for _left, height, _width in placed]


def _draw_label(
    text: str, colour: tuple[float, float, float], x: float, y: float, width: float, scale: float
) -> None:
    """White on dark, which is legible on any view, above a stripe of the colour."""
    padding, stripe = PADDING * scale, STRIPE * scale
    left, bottom, across = x - padding, y - padding, width + 2 * padding
    draw_rectangle(left, bottom, across, SIZE * scale * 0.75 + 2 * padding, BACKGROUND)
    draw_rectangle(left, bottom - stripe, across, stripe, (*colour, 1.0))
    blf.color(FONT, 1.0, 1.0, 1.0, 1.0)
    blf.position(FONT, x, y, 0.0)
    blf.draw(FONT, text)
