# SPDX-License-Identifier: GPL-3.0-or-later
"""Brings a character and its copies into a 3D view that does not show all, and gives the view back."""

from collections.abc import Sequence

import bpy
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d
from mathutils import Vector

from ...ui.sidebar import uncovered
from . import comparison, comparison_state

# Share of the view's height, on each side.
MARGIN = 0.04
# The factor by which the view moves away in each step, and the number of steps.
STEP, MOST_STEPS = 1.1, 60


def show_all(
    context: bpy.types.Context, viewport: bpy.types.SpaceView3D, meshes: Sequence[bpy.types.Object]
) -> None:
    """Moves the view to the middle of them, and away as far as needed. Does not change a view that shows them
    all, one through a camera, or one that is locked to something.

    meshes  the compared meshes
    """
    view, area = viewport.region_3d, context.area
    state = comparison_state.of_scene(context.scene)
    is_locked = viewport.lock_object is not None or viewport.lock_cursor or view.lock_rotation
    if state is None or area is None or view.view_perspective == "CAMERA" or is_locked:
        return
    depsgraph = context.evaluated_depsgraph_get()
    shown = [*meshes, *comparison_state.copies_of(state)]
    points = np.concatenate([comparison.corners(obj.evaluated_get(depsgraph)) for obj in shown])
    region = next(region for region in area.regions if region.type == "WINDOW")
    if _are_visible(area, region, view, points):
        return
    state.view_before = _place(view)
    _fit(area, region, view, points)
    state.view_moved = _place(view)


def give_back(context: bpy.types.Context) -> None:
    """Before a comparison ends: views that are still where show_all() moved one are where it was before."""
    state = comparison_state.of_scene(context.scene)
    moved = None if state is None else tuple(state.view_moved)
    if not moved or not moved[3]:
        return
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            view = area.spaces.active.region_3d if area.type == "VIEW_3D" else None
            if view is not None and np.allclose(_place(view), moved, rtol=1e-5):
                view.view_location, view.view_distance = state.view_before[:3], state.view_before[3]


def _place(view: bpy.types.RegionView3D) -> tuple[float, ...]:
    return (*view.view_location, view.view_distance)


def _fit(
    area: bpy.types.Area, region: bpy.types.Region, view: bpy.types.RegionView3D, points: np.ndarray
) -> None:
    low, high = points.min(axis=0), points.max(axis=0)
    view.view_location = Vector(0.5 * (low + high))
    view.view_distance = max(0.5 * float(np.linalg.norm(high - low)), 1e-3)
    view.update()
    for _step in range(MOST_STEPS):
        if _are_visible(area, region, view, points):
            return
        view.view_distance *= STEP
        view.update()


def _are_visible(
    area: bpy.types.Area, region: bpy.types.Region, view: bpy.types.RegionView3D, points: np.ndarray
) -> bool:
    """Whether all points are where neither toolbar nor sidebar covers the view."""
    margin = MARGIN * region.height
    left, right = uncovered(area, region)
    lowest, highest = (left + margin, margin), (right - margin, region.height - margin)
    for point in points:
        place = location_3d_to_region_2d(region, view, Vector(point))
        if place is None or not all(a <= b <= c for a, b, c in zip(lowest, place, highest, strict=True)):
            return False
    return True
