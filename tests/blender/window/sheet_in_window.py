# SPDX-License-Identifier: GPL-3.0-or-later
"""Part of features_in_window.py: a contact sheet over the view by clicks and keys; variants by numbers."""

from __future__ import annotations

from collections.abc import Generator

import bpy
import five_meshes
import numpy as np
import window

VARIANTS = "blender, cor, soft=dq+delta_mush"
FRAME = 12


def main_window() -> bpy.types.Window:
    return bpy.context.window_manager.windows[0]


def body() -> bpy.types.Object:
    return bpy.data.objects["Body"]


def shown():
    from bl_ext.user_default.sinew.features.contact_sheet import overlay

    return overlay.shown[0] if overlay.shown else None


def place_of(row: int, column: int | None) -> tuple[int, int]:
    """The middle of a cell, or of a row's label, in the window's picture."""
    place, area = shown().place, window.area_of("VIEW_3D")
    region = next(region for region in area.regions if region.type == "WINDOW")
    box = place.layout.label(row) if column is None else place.layout.picture(row, column)
    x = region.x + place.room.left + place.left + box.left + box.width / 2
    y = place.room.top + place.top + box.top + box.height / 2
    return round(x), round(main_window().height - region.y - region.height + y)


def used() -> str:
    settings = body().sinew
    return settings.method if settings.enabled else "blender"


def seen() -> list[float]:
    """What the artist sees: the view, the frame and the pose."""
    view = window.area_of("VIEW_3D").spaces[0].region_3d
    poses = [
        value for bone in bpy.data.objects["Hero Rig"].pose.bones for row in bone.matrix for value in row
    ]
    place = (*view.view_location, *view.view_rotation, view.view_distance, bpy.context.scene.frame_current)
    return [*place, *poses]


def is_same(before: list[float]) -> bool:
    return bool(np.allclose(seen(), before, atol=1e-5))


def start(**options: object) -> None:
    with window.in_view3d():
        bpy.ops.sinew.contact_sheet("INVOKE_DEFAULT", variants=VARIANTS, **options)


def on_the_sheet(facts: dict) -> Generator[None, None, None]:
    """A click uses a variant and goes to its joint; keys come back."""
    before = seen()
    start()
    facts["opened"] = [shown() is not None, is_same(before)]
    cells = shown().sheet.cells
    count = shown().place.layout.rows * shown().place.layout.columns
    yield from window.until(lambda: len(cells) == count, "all cells")
    yield from window.wait()
    for place, what in (((1, 0), "a cell"), ((2, 0), "another"), ((0, None), "a label")):
        yield from window.click(place_of(*place))
        yield from window.wait(8)
        facts[what] = [used(), shown().is_looking, is_same(before)]
        if shown().is_looking:
            window.press("TWO", place_of(1, 0))
            yield from window.wait()
            facts[what] += [used(), shown().is_looking]
            window.press("BACK_SPACE", place_of(1, 0))
            yield from window.wait()
            facts[what] += [shown().is_looking, is_same(before)]
    window.press("THREE", place_of(1, 0))
    window.press("D", place_of(1, 0))
    yield from window.wait()
    facts["keys"] = [used(), shown().used, shown().sheet.is_difference]
    window.press("ESC", place_of(1, 0))
    yield from window.wait()
    facts["closed"] = [shown() is None, is_same(before), "Contact Sheet" in bpy.data.images]


def undone(facts: dict) -> Generator[None, None, None]:
    """Each use is one step, which has the artist's own pose."""
    view = (main_window().width // 3, main_window().height // 2)
    facts["undone"] = []
    pose = seen()
    for _step in range(3):
        window.press("Z", view, ctrl=True)
        yield from window.wait(4)
        facts["undone"] += [used(), is_same(pose)]


def stopped(facts: dict) -> Generator[None, None, None]:
    """Esc keeps what is drawn; then it closes."""
    start(difference=True)
    yield from window.until(lambda: len(shown().sheet.cells) > 0, "a cell")
    place = place_of(1, 0)
    if len(shown().sheet.cells) < 3 * shown().place.layout.columns:
        window.press("ESC", place)
        yield from window.wait()
    facts["stopped"] = [shown() is not None]
    window.press("ESC", place)
    yield from window.wait(4)
    facts["stopped"].append(shown() is None)


def by_keys(facts: dict) -> Generator[None, None, None]:
    """The keys 1 to 9 in the view, until Esc; one undo step each."""
    view = (main_window().width // 3, main_window().height // 2)
    facts["by keys"] = []
    with window.in_view3d("WINDOW"):
        bpy.ops.sinew.variant_keys("INVOKE_DEFAULT")
    yield from window.wait()
    for key in ("THREE", "ONE", "NINE", "ESC", "TWO"):
        window.press(key, view)
        yield from window.wait(3)
        facts["by keys"].append(used())
    window.press("Z", view, ctrl=True)
    yield from window.wait(4)
    facts["by keys"].append(used())


def steps() -> Generator[None, None, dict]:
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    five_meshes.make(vertices=1200)
    bpy.context.scene.frame_set(FRAME)
    with window.in_view3d():
        bpy.ops.sinew.add(method="dq")
    bpy.ops.ed.undo_push(message="Sinew is on")
    yield from window.wait()
    facts: dict = {}
    for part in (on_the_sheet, undone, stopped, by_keys):
        yield from part(facts)
    return facts
