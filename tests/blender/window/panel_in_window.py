# SPDX-License-Identifier: GPL-3.0-or-later
"""In Blender's window, with Sinew's zip: a character of five meshes by clicks and keys. Prints "FACTS" and a
line of JSON with what was not as wanted.

    blender --factory-startup --enable-event-simulate --python panel_in_window.py -- sinew.zip FOLDER

The window has 1280 x 800 pixels. Places are those of its picture: from the left, from the top.
"""

from __future__ import annotations

import inspect
import json
import sys
from collections.abc import Iterator
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
import five_meshes
import window
from bl_ui.space_statusbar import STATUSBAR_HT_header
from bpy_extras.view3d_utils import location_3d_to_region_2d
from mathutils import Vector

ZIP, FOLDER = window.arguments()
VIEW = (400, 500)
# Positions in the sidebar.
ADD, METHOD, SWITCH = (880, 125), (930, 128), (812, 151)
COMPARE, ADD_ARROW = (830, 171), (1002, 125)
# Headers of panels while all are closed; what Diagnostics has below its own.
HEADER, DIAGNOSTICS = (850, 97), (850, 265)
CHECK, MEND = (830, 322), (835, 473)
SUGGEST_BUTTON = (970, 171)
# The header of Suggest, and the recommended method.
SUGGEST, BEST = (850, 153), (880, 184)
# The height of the status bar in pixels.
STATUS_BAR = 24
# Positions in the list of methods.
RECOMMENDED, DUAL_QUATERNION = (955, 168), (832, 303)
# In that behind the arrow of Add.
ADD_DUAL_QUATERNION = (906, 303)
# Positions in the dialog of a comparison, which opens here.
DIALOG, CENTRES_OF_ROTATION, LOG_MATRIX = (400, 400), (171, 470), (171, 577)
faults: list[str] = []


def check(what: str, found: object, wanted: object = True) -> None:
    if found != wanted:
        faults.append(f"{what}: {found}, not {wanted}")


def main_window() -> bpy.types.Window:
    return bpy.context.window_manager.windows[0]


def enabled() -> list[bool]:
    return [obj.sinew.enabled for obj in meshes()]


def meshes() -> list[bpy.types.Object]:
    return [bpy.data.objects[name] for name in five_meshes.MESHES]


def methods() -> list[str]:
    return [obj.sinew.method if obj.sinew.replaced_modifiers else "" for obj in meshes()]


def scene() -> bpy.types.Scene:
    return main_window().scene


def undo() -> Iterator[None]:
    window.press("Z", VIEW, ctrl=True)
    yield from window.wait()


def search(text: str) -> Iterator[None]:
    """Runs an operator with F3, as without Developer Extras."""
    window.press("F3", VIEW)
    yield from window.wait()
    for letter in text:
        window.press("SPACE" if letter == " " else letter.upper(), VIEW, text=letter)
    yield from window.wait()
    window.press("RET", VIEW)
    yield from window.wait()


def start() -> Iterator[None]:
    window.install(ZIP)
    bpy.context.preferences.view.show_developer_ui = False
    bpy.context.preferences.filepaths.temporary_directory = str(FOLDER)
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    five_meshes.make(vertices=1200)
    scene().frame_set(12)
    window.open_sidebar()
    yield from window.wait()
    window.choose_tab()
    bpy.ops.ed.undo_push(message="made")
    yield from window.wait()


def auto_mixed() -> Iterator[None]:
    """Esc leaves nothing behind, and one undo step takes back what it made."""

    def mixes() -> list[tuple[str, bool]]:
        return [(obj.sinew.mix.method, "Mix" in obj.vertex_groups) for obj in meshes()]

    def mix(last_frame: int) -> None:
        scene().frame_end = last_frame
        with window.in_view3d():
            bpy.ops.sinew.auto_mix("INVOKE_DEFAULT", True, over="SCENE")

    choose("lbs")
    mix(last_frame=2000)
    yield from window.wait(4)
    window.press("ESC", VIEW)
    yield from window.wait()
    check("a mix, stopped", mixes(), [("OFF", False)] * 5)
    mix(last_frame=12)
    yield from window.until(lambda: mixes() == [("dq", True)] * 5, "the mix")
    yield from undo()
    check("a mix, undone", mixes(), [("OFF", False)] * 5)
    choose("dq")


def recommended_by_click() -> Iterator[None]:
    """Method and stages of all, in one undo step."""
    from bl_ext.user_default.sinew.features.suggest import recommend

    names = ("twist_spread", "bulge_limit", "delta_mush")

    def settings() -> list[tuple[str, list[bool]]]:
        return [(obj.sinew.method, [getattr(obj.sinew, name).enabled for name in names]) for obj in meshes()]

    choose("lbs")
    before = settings()
    recommend.choices.clear()
    yield from window.click(METHOD)
    yield from window.click(RECOMMENDED)
    yield from window.until(lambda: scene().session_uid in recommend.choices, "a recommendation")
    window.press("ESC", RECOMMENDED)
    yield from window.wait()
    choice = recommend.choices[scene().session_uid]
    wanted = [choice.variant.all_values[f"{name}.enabled"] for name in names]
    check("recommended", settings(), [(choice.variant.method, wanted)] * 5)
    check("another than before", settings() != before)
    yield from undo()
    check("recommended, undone", settings(), before)
    choose("dq")


def one_click_for_a_method() -> Iterator[None]:
    yield from window.click(ADD)
    check("added", methods(), ["lbs"] * 5)
    yield from window.click(METHOD)
    yield from window.click(DUAL_QUATERNION)
    check("chosen", methods(), ["dq"] * 5)
    # The list stays open, to try another.
    window.press("ESC", DUAL_QUATERNION)
    yield from window.wait()
    yield from window.click(SWITCH)
    check("switched off", enabled(), [False] * 5)
    yield from undo()
    check("on again", enabled(), [True] * 5)
    yield from undo()
    check("chosen, undone", methods(), ["lbs"] * 5)
    yield from undo()
    check("added, undone", methods(), [""] * 5)
    preferences = bpy.context.preferences.addons["bl_ext.user_default.sinew"].preferences
    preferences.first_method = "qv"
    yield from window.click(ADD)
    check("added as preferred", methods(), ["qv"] * 5)
    preferences.first_method = "AS_BEFORE"
    yield from undo()
    yield from window.click(ADD_ARROW)
    yield from window.click(ADD_DUAL_QUATERNION)
    check("added by a method of the list", methods(), ["dq"] * 5)
    window.press("ESC", ADD_DUAL_QUATERNION)
    yield from window.wait()
    yield from undo()


def by_search_and_keys() -> Iterator[None]:
    yield from search("add sinew")
    check("added by search", methods(), ["lbs"] * 5)
    yield from search("switch on off")
    check("switched by search", enabled(), [False] * 5)
    yield from search("switch on off")
    with window.in_view3d("WINDOW"):
        bpy.ops.sinew.compare("EXEC_DEFAULT", methods={"lbs", "dq"})
    yield from window.wait()
    window.press("F", VIEW, alt=True, shift=True)
    yield from window.wait()
    state = scene().sinew_comparison
    check("flipped", (state.arrangement, state.shows_second), ("FLIP", False))
    yield from search("flip comparison")
    check("flipped by search", scene().sinew_comparison.shows_second)
    window.press("Y", VIEW, alt=True, shift=True)
    yield from window.wait()
    window.press("ESC", VIEW)
    yield
    with window.in_view3d("WINDOW"):
        bpy.ops.sinew.end_comparison("EXEC_DEFAULT")
    yield


def copies_in_view() -> bool:
    """Whether the view shows the corners of all copies beside the sidebar."""
    area = window.area_of("VIEW_3D")
    region = next(region for region in area.regions if region.type == "WINDOW")
    sidebar = next(region for region in area.regions if region.type == "UI")
    depsgraph = main_window().view_layer.depsgraph
    copies = [obj for obj in bpy.data.objects if obj.is_property_set("sinew") and obj.sinew.identity.method]
    for copy in copies:
        evaluated = copy.evaluated_get(depsgraph)
        for corner in evaluated.bound_box:
            point = evaluated.matrix_world @ Vector(corner)
            place = location_3d_to_region_2d(region, area.spaces[0].region_3d, point)
            if place is None or not (0 <= place.x <= sidebar.x - region.x and 0 <= place.y <= region.height):
                return False
    return bool(copies)


def comparison_by_clicks() -> Iterator[None]:
    """Dual quaternions and centres are ticked, as the original has linear blend; a click removes one, another
    adds one. The end gives the view back."""
    with window.in_view3d("WINDOW"):
        bpy.ops.view3d.view_selected()
    yield from window.wait()
    view = window.area_of("VIEW_3D").spaces[0].region_3d
    before = [*view.view_location, view.view_distance]
    window.move(DIALOG)
    yield from window.wait()
    with window.in_view3d():
        bpy.ops.sinew.compare("INVOKE_DEFAULT")
    yield from window.wait()
    yield from window.click(CENTRES_OF_ROTATION)
    yield from window.click(LOG_MATRIX)
    window.press("RET", LOG_MATRIX)
    yield from window.wait(4)
    state = scene().sinew_comparison
    compared = sorted({obj.sinew.identity.method for obj in state.collection.objects})
    check("compared", compared, ["dq", "log"])
    check("copies in view", copies_in_view())
    check("view moved", [*view.view_location, view.view_distance] != before)
    # Where its button was, the one that ends it is.
    yield from window.click(COMPARE)
    check("ended", scene().is_property_set("sinew_comparison"), False)
    check("view given back", np.allclose([*view.view_location, view.view_distance], before, atol=1e-5))
    with window.in_view3d("WINDOW"):
        bpy.ops.view3d.view_all()
    yield from window.wait()


def pixels_of(picture: str) -> np.ndarray:
    """A photograph, float32 [height, width, 3] from 0 to 1, the lowest row first."""
    image = bpy.data.images.load(str(FOLDER / f"{picture}.png"))
    width, height = image.size
    pixels = np.empty(width * height * 4, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(height, width, 4)[:, :, :3]


def brightest(picture: str, place: tuple[int, int]) -> float:
    """The contrast of letters around a position in a photograph, 0 to 1."""
    pixels = pixels_of(picture)
    rows = len(pixels) - place[1]
    letters = pixels[rows - 8 : rows + 8, place[0] - 60 : place[0] + 60]
    return float(letters.mean(axis=2).max())


def filled(picture: str) -> int:
    """How many pixels of the status bar have the colour of Blender's progress bars."""
    colour = bpy.context.preferences.themes[0].user_interface.wcol_progress.item[:3]
    return int((np.abs(pixels_of(picture)[:STATUS_BAR] - colour).max(axis=2) < 0.04).sum())


def share_shown() -> float:
    """The share that the status bar shows; 0 while Blender draws its own."""
    draw = STATUSBAR_HT_header.draw
    return 0.0 if draw.__closure__ is None else inspect.getclosurevars(draw).nonlocals.get("share", 0.0)


def letters_differ(first: str, second: str, place: tuple[int, int]) -> bool:
    """Whether two photographs have other letters around a position."""
    change = np.abs(pixels_of(first) - pixels_of(second)).max(axis=2)
    rows = len(change) - place[1]
    return bool(change[rows - 8 : rows + 8, place[0] - 30 : place[0] + 30].max() > 0.3)


def progress_in_the_status_bar() -> Iterator[None]:
    """And in the button."""
    with window.in_view3d():
        bpy.ops.sinew.suggest("INVOKE_DEFAULT", over="SCENE")
    yield from window.until(lambda: share_shown() > 0.02, "progress")
    window.photograph(FOLDER / "progress.png")
    window.press("ESC", VIEW)
    yield from window.wait()
    window.photograph(FOLDER / "stopped.png")
    check("a progress bar", filled("progress") > 100)
    check("none after Esc", (filled("stopped"), share_shown()), (0, 0.0))
    check("progress in the button", letters_differ("progress", "stopped", SUGGEST_BUTTON))


def choose(method: str) -> None:
    scene().sinew_character.method = method
    bpy.ops.ed.undo_push(message=method)


def suggested_by_click() -> Iterator[None]:
    """The recommended method, which is another than the present one."""
    yield from window.close_panels(HEADER)
    choose("lbs")
    with window.in_view3d():
        scene().frame_start, scene().frame_end = 10, 12
        bpy.ops.sinew.suggest("EXEC_DEFAULT", over="SCENE")
    yield from window.wait()
    yield from window.click(BEST)
    from bl_ext.user_default.sinew.features.suggest import recommend

    check("one for all", len(set(methods())), 1)
    check("the recommended one", methods()[0], recommend.choices[scene().session_uid].variant.method)
    with window.in_view3d():
        bpy.ops.sinew.suggestions_by(measure="crossings")
    yield from window.wait(4)
    yield from undo()
    check("suggestion, undone", methods(), ["lbs"] * 5)
    choose("dq")
    yield from window.click(SUGGEST)
    yield from window.click(HEADER)


def off_greys() -> Iterator[None]:
    """Settings that have no effect while Sinew is off."""
    scene().sinew_character.method = "dq"
    yield
    window.photograph(FOLDER / "on.png")
    yield from window.click(SWITCH)
    window.photograph(FOLDER / "off.png")
    check("grey where off", brightest("off", METHOD) < 0.7 * brightest("on", METHOD))
    yield from window.click(SWITCH)
    check("on", enabled(), [True] * 5)


def without_weights() -> int:
    return sum(not vertex.groups for vertex in bpy.data.objects["Body"].data.vertices)


def mends_by_clicks() -> Iterator[None]:
    yield from window.close_panels(HEADER)
    yield from window.click(DIAGNOSTICS)
    for group in bpy.data.objects["Body"].vertex_groups:
        group.remove(list(range(300, 320)))
    bpy.ops.ed.undo_push(message="removed")
    check("weights lost", without_weights(), 20)
    yield from window.click(CHECK)
    # The panels below move to their places.
    yield from window.wait()
    yield from window.click(MEND)
    check("weights mended", without_weights(), 0)
    yield from undo()
    check("mending, undone", without_weights(), 20)
    yield from window.click(DIAGNOSTICS)
    yield from window.click(HEADER)


def key_blocks() -> list[tuple[str, bool, bool]]:
    """For the body: each corrective key's name, whether it is muted and whether a driver moves it."""
    keys = bpy.data.objects["Body"].data.shape_keys
    if keys is None:
        return []
    driven = {curve.data_path for curve in keys.animation_data.drivers} if keys.animation_data else set()
    return [(key.name, key.mute, f'key_blocks["{key.name}"].value' in driven) for key in keys.key_blocks[1:]]


def corrective_keys() -> Iterator[None]:
    """Made with F3, and driven by a bone; with it the Armature modifier alone has Sinew's shape."""
    yield from search("corrective shape key")
    ((name, *flags),) = key_blocks()
    check("corrective key", (name.startswith("Dual Quaternion"), *flags), (True, True, False))
    yield from undo()
    check("corrective key, undone", key_blocks(), [])
    rig, body = bpy.data.objects["Hero Rig"], bpy.data.objects["Body"]
    window.select_only(rig)
    rig.data.bones.active = rig.data.bones["bone.1"]
    with window.in_view3d("WINDOW"):
        bpy.ops.object.mode_set(mode="POSE")
        bpy.ops.sinew.corrective_key("EXEC_DEFAULT", driven=True)
    yield
    check("corrective key, driven", key_blocks(), [(name, True, True)])
    shown = window.final_points(body)
    for obj in meshes():
        obj.sinew.enabled = False
    yield
    without = window.final_points(body)
    body.data.shape_keys.key_blocks[1].mute = False
    yield
    off = [np.linalg.norm(each - shown, axis=1).max() for each in (without, window.final_points(body))]
    check("its shape is Sinew's", (bool(off[0] > 0.03), bool(off[1] <= 1e-5)), (True, True))
    with window.in_view3d("WINDOW"):
        bpy.ops.object.mode_set(mode="OBJECT")
    five_meshes.select(body)
    yield


def search_in_modes() -> Iterator[None]:
    """F3 searches other menus in each mode."""
    body, rig = bpy.data.objects["Body"], bpy.data.objects["Hero Rig"]
    for obj, mode in (
        *((body, mode) for mode in ("EDIT", "SCULPT", "WEIGHT_PAINT", "VERTEX_PAINT")),
        *((rig, mode) for mode in ("EDIT", "POSE")),
    ):
        window.select_only(obj)
        with window.in_view3d("WINDOW"):
            bpy.ops.object.mode_set(mode=mode)
        yield
        before = enabled()
        yield from search("switch on off")
        check(f"switched in {obj.type} {mode}", enabled(), [not on for on in before])
        with window.in_view3d("WINDOW"):
            bpy.ops.object.mode_set(mode="OBJECT")
        yield
    five_meshes.select(body)
    yield


def height_of_change(before: str, after: str) -> int:
    """How many rows of two photographs are between the first and the last that differ."""
    differ = np.abs(pixels_of(after) - pixels_of(before)).max(axis=(1, 2)) > 0.1
    rows = np.flatnonzero(differ)
    return int(np.ptp(rows)) + 1 if len(rows) else 0


def menus() -> Iterator[None]:
    window.move(VIEW)
    yield
    window.photograph(FOLDER / "no-menu.png")
    with window.in_view3d("WINDOW"):
        bpy.ops.wm.call_menu(name="SINEW_MT_menu")
    yield from window.wait()
    window.photograph(FOLDER / "menu.png")
    check("the menu is lower than the window", 200 < height_of_change("no-menu", "menu") < 600)
    window.press("ESC", VIEW)
    yield
    window.press("ESC", VIEW)
    yield


def modifiers() -> Iterator[None]:
    """What is shown above the stack, and its button, while the sidebar is closed."""
    area = window.area_of("PROPERTIES")
    area.spaces[0].context = "MODIFIER"
    view = window.area_of("VIEW_3D")
    view.spaces[0].show_region_ui = False
    yield from window.wait()
    with bpy.context.temp_override(window=main_window(), area=area, region=area.regions[-1]):
        bpy.ops.sinew.open_tab("INVOKE_DEFAULT")
    yield from window.wait(4)
    region = next(region for region in view.regions if region.type == "UI")
    check("its tab", (view.spaces[0].show_region_ui, region.active_panel_category), (True, "Sinew"))
    yield from flipped_sidebar(view, region)


def flipped_sidebar(view: bpy.types.Area, sidebar: bpy.types.Region) -> Iterator[None]:
    """The heat map's legend, and the view that shows a comparison, keep to what it leaves free."""
    from bl_ext.user_default.sinew.ui.sidebar import uncovered

    main = next(region for region in view.regions if region.type == "WINDOW")
    ends = []
    for _way in range(2):
        ends.append(uncovered(view, main))
        with bpy.context.temp_override(window=main_window(), area=view, region=sidebar):
            bpy.ops.screen.region_flip()
        yield from window.wait()
    (left, right), (left_then, right_then) = ends
    check("free beside the sidebar", right, main.width - sidebar.width)
    check("and when it is flipped", (left_then - left >= sidebar.width, right_then), (True, main.width))


def bake_error() -> Iterator[None]:
    """By F3, of what was baked to bones; its colours in the view, and views as before afterwards."""
    for obj in meshes():
        obj.sinew.enabled = True
    five_meshes.select(bpy.data.objects["Body"])
    shading = window.area_of("VIEW_3D").spaces[0].shading
    check("colours before", shading.color_type, "MATERIAL")
    with window.in_view3d("WINDOW"):
        bpy.ops.sinew.bake("EXEC_DEFAULT", kind="bones", frames="1-20", helpers=4)
        bpy.ops.view3d.view_selected()
        bpy.ops.ed.undo_push(message="baked")
    yield from search("heat map of bake error")
    yield from undo()
    check("bake error, undone", shading.color_type, "MATERIAL")
    yield from search("heat map of bake error")
    check("colours of the bake error", shading.color_type, "VERTEX")
    window.photograph(FOLDER / "bake-error.png")
    yield from search("heat map of bake error")
    window.photograph(FOLDER / "bake-error-off.png")
    view = (slice(200, -200), slice(100, 700))
    vivid = [float(np.ptp(pixels_of(name)[view], axis=2).mean()) for name in ("bake-error", "bake-error-off")]
    check("colours afterwards", (shading.color_type, vivid[0] > 1.2 * vivid[1]), ("MATERIAL", True))


def shortcuts() -> list[str]:
    keyconfigs = bpy.context.window_manager.keyconfigs
    items = [item for keymap in keyconfigs.addon.keymaps for item in keymap.keymap_items]
    names = [f"{item.idname} {getattr(item.properties, 'name', '')}" for item in items]
    return sorted(name for name in names if "sinew" in name.lower())


def goes_without_a_trace() -> Iterator[None]:
    check("shortcuts", shortcuts(), ["sinew.flip_comparison ", "wm.call_menu_pie SINEW_MT_pie"])
    bpy.context.preferences.active_section = "ADDONS"
    bpy.ops.preferences.addon_show(module="bl_ext.user_default.sinew")
    yield from window.wait()
    bpy.ops.preferences.addon_disable(module="bl_ext.user_default.sinew")
    check("shortcuts afterwards", shortcuts(), [])
    functions = [*bpy.types.VIEW3D_MT_object.draw._draw_funcs, *bpy.types.DATA_PT_modifiers.draw._draw_funcs]
    check("menus afterwards", [each for each in functions if "sinew" in each.__module__], [])
    yield from window.wait()


def steps() -> Iterator[None]:
    yield from start()
    yield from one_click_for_a_method()
    yield from by_search_and_keys()
    yield from search_in_modes()
    yield from comparison_by_clicks()
    yield from menus()
    yield from off_greys()
    yield from progress_in_the_status_bar()
    yield from suggested_by_click()
    yield from auto_mixed()
    yield from recommended_by_click()
    yield from mends_by_clicks()
    yield from corrective_keys()
    yield from modifiers()
    yield from bake_error()
    yield from goes_without_a_trace()
    print("FACTS " + json.dumps({"faults": faults}), flush=True)


window.run(steps(), 0.15)
