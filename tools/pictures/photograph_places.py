# SPDX-License-Identifier: GPL-3.0-or-later
"""Photographs where else than in the sidebar Sinew is found, in the window of a real Blender: the menu, the
modifier's own panel, the dialog of Bake, a corrective key and the preferences.

    blender --factory-startup --enable-event-simulate human.blend --python tools/pictures/photograph_places.py -- sinew.zip FOLDER

The window has 1280 x 800 pixels.
"""  # noqa: E501

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
import window

ZIP, FOLDER = window.arguments()
FRAME = 16
# Where the mouse opens menus and dialogs.
MENU, DIALOG = (250, 330), (480, 330)
# The border between the 3D view and the properties, and how far it is moved.
BORDER, MOVED = (1057, 500), -160
MODULE = "bl_ext.user_default.sinew"


def photograph(name: str, left: int = 0, right: int = 1280, top: int = 0, bottom: int = 800) -> None:
    """A part of the window, in pixels from its left and its top."""
    whole = FOLDER / f"{name}-whole.png"
    window.photograph(whole)
    pixels = window.pixels_of(whole)
    window.save_webp(pixels[len(pixels) - bottom : len(pixels) - top, left:right], FOLDER / f"{name}.webp")
    whole.unlink()


def start() -> Iterator[None]:
    window.install(ZIP)
    obj = bpy.data.objects["Human"]
    window.select_only(obj)
    with window.in_view3d():
        assert bpy.ops.sinew.add("INVOKE_DEFAULT") == {"FINISHED"}
        obj.sinew.method = "dq"
        overlay = bpy.context.space_data.overlay
        overlay.show_cursor = overlay.show_bones = overlay.show_axis_x = False
    bpy.context.scene.frame_set(FRAME)
    window.look_from_front((0.1, 0.0, 0.0), 2.4)
    yield from window.wait()


def widen_properties() -> Iterator[None]:
    window.move(BORDER)
    yield
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        bpy.ops.screen.area_move(x=BORDER[0], y=800 - BORDER[1], delta=MOVED)
    yield from window.wait()


def menu() -> Iterator[None]:
    """As from Object > Sinew: its own menu, where the mouse is."""
    window.move(MENU)
    yield
    with window.in_view3d("WINDOW"):
        bpy.ops.wm.call_menu(name="SINEW_MT_menu")
    yield from window.wait()
    photograph("place-menu", right=860, bottom=700)
    window.press("ESC", MENU)
    yield from window.wait()


def modifier() -> Iterator[None]:
    window.area_of("PROPERTIES").spaces[0].context = "MODIFIER"
    yield from window.wait()
    photograph("place-modifier", left=1058 + MOVED, top=230, bottom=650)


def bake() -> Iterator[None]:
    window.move(DIALOG)
    yield
    with window.in_view3d("WINDOW"):
        bpy.ops.sinew.bake("INVOKE_DEFAULT", kind="bones")
    yield from window.wait()
    photograph("place-bake", left=150, right=860, top=180, bottom=640)
    window.press("ESC", DIALOG)
    yield from window.wait()


def corrective() -> Iterator[None]:
    rig, obj = bpy.data.objects["Rig"], bpy.data.objects["Human"]
    window.select_only(rig)
    rig.data.bones.active = rig.data.bones["calf_l"]
    with window.in_view3d("WINDOW"):
        bpy.ops.object.mode_set(mode="POSE")
        bpy.ops.sinew.corrective_key("EXEC_DEFAULT", driven=True)
        bpy.ops.object.mode_set(mode="OBJECT")
    window.select_only(obj)
    yield
    window.area_of("PROPERTIES").spaces[0].context = "DATA"
    yield from window.wait()
    photograph("place-corrective", left=1058 + MOVED, top=230, bottom=660)


def preferences() -> Iterator[None]:
    bpy.context.preferences.active_section = "ADDONS"
    bpy.ops.preferences.addon_show(module=MODULE)
    yield from window.wait(4)
    photograph("place-preferences", left=270, right=979, top=88, bottom=330)


def steps() -> Iterator[None]:
    yield from start()
    yield from menu()
    yield from widen_properties()
    yield from modifier()
    yield from bake()
    yield from corrective()
    yield from preferences()


window.run(steps())
