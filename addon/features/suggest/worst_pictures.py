# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of candidates where they stretch most, as icons of Blender's. There are none without a window."""

from __future__ import annotations

from dataclasses import replace

import bpy
import bpy.utils.previews
import numpy as np

from ..measure.metrics import Measured
from ..pages import shaded
from ..pages.views import close_view

PIXELS = 128
# Of what other close-ups show: these pictures are smaller.
NEARER = 0.6

# By the session_uid of the scene.
_pictures: dict[int, bpy.utils.previews.ImagePreviewCollection] = {}


def are_drawn() -> bool:
    return not bpy.app.background


def remove(scene: bpy.types.Scene) -> None:
    if scene.session_uid in _pictures:
        bpy.utils.previews.remove(_pictures.pop(scene.session_uid))


def begin(scene: bpy.types.Scene) -> None:
    """Removes the pictures of an earlier suggestion."""
    remove(scene)
    if are_drawn():
        _pictures[scene.session_uid] = bpy.utils.previews.new()


def add(scene: bpy.types.Scene, name: str, measured: Measured) -> None:
    """Draws the end of the longest edge, relative to its length at rest."""
    points, edges = measured.shape.points.T, measured.shape.surface.edges
    if not (len(edges) and np.isfinite(points).all()):
        return
    view = close_view(points, points[edges[measured.stretch.argmax(), :1]])
    view = replace(view, width=NEARER * view.width, height=NEARER * view.height)
    picture = _pictures[scene.session_uid].new(name)
    picture.image_size = picture.icon_size = (PIXELS, PIXELS)
    pixels = shaded.draw(measured.shape, view, PIXELS).ravel()
    picture.image_pixels_float.foreach_set(pixels)
    picture.icon_pixels_float.foreach_set(pixels)


def icon(scene: bpy.types.Scene, name: str) -> int:
    """Returns its number; 0 where there is none."""
    found = _pictures.get(scene.session_uid, {}).get(name)
    return 0 if found is None else found.icon_id


def clear() -> None:
    while _pictures:
        bpy.utils.previews.remove(_pictures.popitem()[1])
