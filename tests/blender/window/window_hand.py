# SPDX-License-Identifier: GPL-3.0-or-later
"""Parts of the run in Blender's window: steps, a file with characters, simulated clicks and typing, and
comparisons of what is shown and saved."""

from __future__ import annotations

import contextlib
import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import bpy
import window
import window_scene
from window_scene import LARGE, SMALL, blender_points, shown_points, worst

ZIP, FOLDER = window.arguments()[:2]
GROUPS = sys.argv[sys.argv.index("--") + 3 :]
PATIENCE = 90.0
SCENE, SECOND = "Scene", "Second"

Steps = Iterator[None]
steps_of: dict[str, list[Callable[[Run], Steps]]] = {}


def step(group: str) -> Callable:
    """Steps of a group run one after the other in the same file; each group starts with a fresh one."""

    def add(function: Callable[[Run], Steps]) -> Callable[[Run], Steps]:
        steps_of.setdefault(group, []).append(function)
        return function

    return add


class Run:
    """wanted  the method that each character must show: Sinew's, or '' for the Armature modifier's own"""

    def __init__(self) -> None:
        self.wanted: dict[str, str] = {}
        self.faults = 0
        self.saved: list[dict[str, object]] = []
        self.step = ""

    def fault(self, text: str) -> None:
        self.faults += 1
        print(f"FAULT {self.step} | {text}".replace("\n", " "), flush=True)

    def check(self, holds: bool, text: str) -> None:
        if not holds:
            self.fault(text)

    def check_shapes(self, when: str = "") -> None:
        """The shapes that the windows show, without making Blender evaluate anything."""
        for main in bpy.context.window_manager.windows:
            depsgraph = main.view_layer.depsgraph
            for name, method in self.wanted.items():
                obj = main.scene.objects.get(name)
                if obj is None or depsgraph is None or not obj.visible_get(view_layer=main.view_layer):
                    continue
                if obj.mode == "EDIT":
                    # Shows its cage.
                    continue
                self.check_shape(obj, method, depsgraph, when)

    def check_shape(
        self, obj: bpy.types.Object, method: str, depsgraph: bpy.types.Depsgraph, when: str
    ) -> None:
        armature = bpy.data.objects[f"{obj.name.partition('.')[0]} Rig"]
        expected = blender_points(obj, armature, method or "lbs", depsgraph)
        off = worst(shown_points(obj, depsgraph), expected)
        self.check(off <= window_scene.TOLERANCE, f"{obj.name} {when} is off by {off:.4f}")
        if method and hasattr(obj, "sinew"):
            self.check(not obj.sinew.error, f"{obj.name} {when}: {obj.sinew.error}")

    def check_frames(self) -> Steps:
        """Compares the shapes at other frames, and again here."""
        scene = bpy.context.window_manager.windows[0].scene
        here = scene.frame_current
        for frame in (here % 20 + 1, 20, here):
            scene.frame_set(frame)
            yield from wait()
            self.check_shapes(f"at frame {frame}")

    def see(self, when: str, ticks: int = 2) -> Steps:
        """What is shown once Blender has redrawn."""
        yield from wait(ticks)
        self.check_shapes(when)

    def undo(self, when: str, wanted: str | None = None) -> Steps:
        """By the key.

        wanted  the method that Hero then shows, if it is another one
        """
        press("Z", ctrl=True)
        if wanted is not None:
            self.wanted["Hero"] = wanted
        yield from self.see(when, 4)

    def save(self, name: str, **options: object) -> None:
        bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / name), **options)
        self.note_saved(FOLDER / name)

    def note_saved(self, path: Path, in_memory: bool = False) -> None:
        """Records a file for window_read.py, which reads it in another Blender."""
        if not path.exists():
            self.fault(f"{path.name} was not saved")
            return
        characters = {
            name: {"armature": f"{name} Rig", "method": method} for name, method in self.wanted.items()
        }
        kept = FOLDER / f"kept-{GROUPS[-1]}-{len(self.saved)}.blend"
        kept.write_bytes(path.read_bytes())
        self.saved.append(
            {"path": str(kept), "characters": characters, "in_memory": in_memory, "step": self.step}
        )


def wait(ticks: int = 2) -> Steps:
    """Blender redraws in the meantime."""
    for _tick in range(ticks):
        yield


def click(name: str, *objects: str, how: str = "INVOKE_DEFAULT", **arguments: object) -> set[str]:
    """Selects the objects, of which the first becomes active, and presses a button whose effect can be
    undone."""
    if objects:
        choose(*objects)
    category, _dot, operator = name.partition(".")
    with window.in_view3d("WINDOW"):
        return getattr(getattr(bpy.ops, category), operator)(how, True, **arguments)


def execute(name: str, *objects: str, **arguments: object) -> set[str]:
    """The same, without a dialog."""
    return click(name, *objects, how="EXEC_DEFAULT", **arguments)


def choose(*names: str) -> None:
    layer = bpy.context.window_manager.windows[0].view_layer
    for obj in layer.objects:
        obj.select_set(obj.name in names)
    layer.objects.active = layer.objects[names[0]]


def press(key: str, text: str = "", **held: bool) -> None:
    """text  what the key types"""
    main = bpy.context.window_manager.windows[0]
    area = window.area_of("VIEW_3D")
    region = next(region for region in area.regions if region.type == "WINDOW")
    x, y = region.x + region.width // 2, region.y + region.height // 2
    main.event_simulate(type="MOUSEMOVE", value="NOTHING", x=x, y=y)
    typed = {"unicode": text} if text else {}
    main.event_simulate(type=key, value="PRESS", x=x, y=y, **typed, **held)
    main.event_simulate(type=key, value="RELEASE", x=x, y=y)


@contextlib.contextmanager
def playing() -> Iterator[None]:
    with window.in_view3d():
        bpy.ops.screen.animation_play()
    try:
        yield
    finally:
        with window.in_view3d():
            bpy.ops.screen.animation_cancel(restore_frame=False)


def set_frame(frame: int) -> None:
    bpy.context.window_manager.windows[0].scene.frame_set(frame)


def hero() -> bpy.types.Object:
    return bpy.data.objects["Hero"]


def rig(name: str = "Hero") -> bpy.types.Object:
    return bpy.data.objects[f"{name} Rig"]


def push(message: str) -> None:
    bpy.ops.ed.undo_push(message=message)


def make_base() -> None:
    """Two scenes with characters that never had Sinew, and a camera."""
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    scene = bpy.context.window.scene
    window_scene.make_character("Hero", LARGE, (-1.5, 0.0, 0.0))
    window_scene.make_character("Small", SMALL, (-1.5, 2.0, 0.0))
    front = window_scene.make_character("Front", LARGE, (-1.5, -2.0, 0.0))
    # They change nothing, but Sinew can not know that: where weights may change, it deforms after the
    # evaluation.
    front.modifiers.new("Cast", "CAST").factor = 0.0
    front.modifiers.move(1, 0)
    late = window_scene.make_character("Late", LARGE, (-1.5, -4.0, 0.0))
    late.modifiers.new("Weights", "VERTEX_WEIGHT_EDIT")
    late.modifiers.move(1, 0)
    bpy.context.window.scene = second = bpy.data.scenes.new(SECOND)
    window_scene.make_character("Guest", LARGE, (0.0, 0.0, 0.0))
    bpy.context.window.scene = scene
    for each in (scene, second):
        each.render.engine = "BLENDER_WORKBENCH"
        each.render.resolution_x = each.render.resolution_y = 64
        each.frame_start, each.frame_end = 1, 20
        each.frame_set(12)
    choose("Hero")
    window.open_sidebar()
    with window.in_view3d():
        # Software rendering is slow: draw no more than shows the meshes.
        bpy.context.space_data.overlay.show_overlays = False
        bpy.context.space_data.shading.light = "MATCAP"
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "base.blend"))


def fresh(run: Run) -> Steps:
    """The file before Sinew; then Hero, Front and Late have dq, which their own Armature modifiers do not
    give, and Small has the method that it had."""
    # A copy, which steps may save.
    shutil.copy(FOLDER / "base.blend", FOLDER / "open.blend")
    bpy.ops.wm.open_mainfile(filepath=str(FOLDER / "open.blend"))
    yield from wait()
    run.wanted = {"Hero": "", "Small": "", "Front": "", "Late": "", "Guest": ""}
    run.check_shapes("before Sinew")
    click("sinew.add", "Hero")
    hero().sinew.method = "dq"
    click("sinew.add", "Small")
    # Here, as the extension was installed only now.
    from bl_ext.user_default.sinew.attach import references

    run.check(not references.noted(), "what an operator made is taken for made between undo steps")
    for name in ("Front", "Late"):
        click("sinew.add", name)
        bpy.data.objects[name].sinew.method = "dq"
    run.wanted = {"Hero": "dq", "Small": "lbs", "Front": "dq", "Late": "dq", "Guest": ""}
    choose("Hero")
    yield from wait()
    window.choose_tab()
    push("Sinew is on")
    yield from wait()
