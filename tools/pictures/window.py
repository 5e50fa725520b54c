# SPDX-License-Identifier: GPL-3.0-or-later
"""What the scripts that photograph Blender's window share: installing Sinew, clicks, steps between redraws.

They run under an X server of their own; the photograph is of the whole screen, by xwd and netpbm.
"""

from __future__ import annotations

import subprocess
import sys
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import addon_utils
import bpy
import numpy as np


def arguments() -> list[Path]:
    """Those behind --."""
    return [Path(argument).resolve() for argument in sys.argv[sys.argv.index("--") + 1 :]]


def install(package: Path) -> None:
    addon_utils.enable("bl_pkg")
    bpy.ops.extensions.package_install_files(
        filepath=str(package), repo="user_default", enable_on_install=True
    )


def final_points(obj: bpy.types.Object) -> np.ndarray:
    mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    points = np.empty((len(mesh.vertices), 3), dtype=np.float32)
    mesh.vertices.foreach_get("co", points.ravel())
    return points


def area_of(kind: str) -> bpy.types.Area:
    """The main window's first area of this type, such as VIEW_3D."""
    return next(area for area in bpy.context.window_manager.windows[0].screen.areas if area.type == kind)


def in_view3d(region_type: str = "UI"):
    """The context of a click in a region of the 3D view; the sidebar's by default."""
    window, area = bpy.context.window_manager.windows[0], area_of("VIEW_3D")
    region = next(region for region in area.regions if region.type == region_type)
    return bpy.context.temp_override(window=window, area=area, region=region)


def look_from_front(place: tuple[float, float, float], distance: float) -> None:
    """At once, where the operators take their time."""
    view = area_of("VIEW_3D").spaces[0].region_3d
    view.view_perspective = "ORTHO"
    view.view_rotation = (0.7071068, 0.7071068, 0.0, 0.0)
    view.view_location, view.view_distance = place, distance


def select_only(obj: bpy.types.Object) -> None:
    with in_view3d():
        bpy.ops.object.select_all(action="DESELECT")
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj


def open_sidebar() -> None:
    with in_view3d():
        bpy.context.space_data.show_region_ui = True
        bpy.context.space_data.overlay.show_bones = False


def choose_tab() -> None:
    """Only once the sidebar was drawn: before, it has no tabs."""
    with in_view3d():
        bpy.context.region.active_panel_category = "Sinew"


def open_panels(*opened: str, first: Sequence[str] = ()) -> None:
    """Has these open, and the others of Sinew closed, when they are first drawn.

    first  what stands before all others, or before the others of its parent; those that are open, if not said
    """
    names = [name for name in dir(bpy.types) if name.startswith("SINEW_PT_")]
    panels = sorted((getattr(bpy.types, name) for name in names), key=lambda p: hasattr(p, "bl_parent_id"))
    for panel in reversed(panels):
        bpy.utils.unregister_class(panel)
    first = first or opened
    place = {name: number for number, name in enumerate(first)}
    panels.sort(key=lambda p: (hasattr(p, "bl_parent_id"), place.get(p.__name__, len(place))))
    for panel in panels:
        panel.bl_options = set() if panel.__name__ in opened else {"DEFAULT_CLOSED"}
        bpy.utils.register_class(panel)


def wait(ticks: int = 3) -> Iterator[None]:
    """So many steps of run()."""
    for _tick in range(ticks):
        yield


def until(wanted: Callable[[], object], what: str, patience: float = 60.0) -> Iterator[None]:
    """Steps of run() until it is so, for as many seconds at most."""
    end = time.monotonic() + patience
    while not wanted():
        if time.monotonic() > end:
            raise AssertionError(f"{what} did not come")
        yield


def move(place: tuple[int, int]) -> None:
    """The mouse, to a place of the window's picture: from its left and its top. These need
    --enable-event-simulate."""
    main = bpy.context.window_manager.windows[0]
    main.event_simulate(type="MOUSEMOVE", value="NOTHING", x=place[0], y=main.height - place[1])


def press(key: str, place: tuple[int, int], text: str = "", **held: bool) -> None:
    """A key or a button of the mouse there.

    text  what the key types
    """
    move(place)
    main = bpy.context.window_manager.windows[0]
    at = {"x": place[0], "y": main.height - place[1]}
    typed = {"unicode": text} if text else {}
    main.event_simulate(type=key, value="PRESS", **at, **typed, **held)
    main.event_simulate(type=key, value="RELEASE", **at, **held)


def click(place: tuple[int, int], **held: bool) -> Iterator[None]:
    """Blender notices the mouse over a button before it is pressed."""
    move(place)
    yield
    press("LEFTMOUSE", place, **held)
    yield
    yield


def close_panels(header: tuple[int, int]) -> Iterator[None]:
    """All of the sidebar. Opened with Ctrl, a panel closes all others.

    header  the place of the first one's; it is open
    """
    for held in ({}, {"ctrl": True}, {}):
        yield from click(header, **held)


def photograph(picture: Path) -> None:
    """As PNG or WebP, by the name."""
    bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=3)
    png = picture.with_suffix(".png")
    subprocess.run(f"xwd -root -silent | xwdtopnm | pnmtopng > '{png}'", shell=True, check=True)
    if picture.suffix == ".webp":
        save_webp(pixels_of(png), picture)
        png.unlink()
    print("PHOTOGRAPHED", flush=True)


def pixels_of(picture: Path) -> np.ndarray:
    """float32 [height, width, 4], the lowest row first."""
    image = bpy.data.images.load(str(picture))
    width, height = image.size
    pixels = np.empty(width * height * 4, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(height, width, 4)


def save_webp(pixels: np.ndarray, picture: Path) -> None:
    """As pixels_of() returns them. An image that is loaded from a PNG would be saved as one, whatever its
    name."""
    height, width, _channels = pixels.shape
    image = bpy.data.images.new(picture.stem, width, height)
    image.pixels.foreach_set(np.ascontiguousarray(pixels).ravel())
    image.file_format = "WEBP"
    image.save(filepath=str(picture), quality=90)
    bpy.data.images.remove(image)


def run(steps: Iterator[None], seconds: float = 1.0) -> None:
    """One step a timer's tick, every so many seconds, so that the window redraws and plays between them; then
    Blender ends."""

    def tick() -> float | None:
        try:
            next(steps)
        except StopIteration:
            bpy.ops.wm.quit_blender()
            return None
        except BaseException:
            traceback.print_exc()
            sys.stderr.flush()
            bpy.ops.wm.quit_blender()
            return None
        return seconds

    bpy.context.preferences.view.show_splash = False
    bpy.app.timers.register(tick, first_interval=2.0, persistent=True)
