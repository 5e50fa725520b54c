# SPDX-License-Identifier: GPL-3.0-or-later
"""Part of features_in_window.py: centres of rotation are computed in the background. The window stays
responsive, Esc stops the computation, a button resumes it, and a render waits for it."""

from __future__ import annotations

import importlib
import time
from collections.abc import Generator, Iterator

import bpy
import numpy as np
import window
import window_scene

_ZIP, FOLDER = window.arguments()
VERTICES, PATIENCE = 60_000, 300.0
facts: dict[str, object] = {}


def sinew(name: str):
    """A module of the extension."""
    return importlib.import_module(f"bl_ext.user_default.sinew.{name}")


def hero() -> bpy.types.Object:
    return bpy.data.objects["Hero"]


def plan() -> str:
    state = sinew("deform.session").skinned_of(hero())
    if state is None:
        return "none"
    return "waiting" if state.plan.lacks else state.plan.state.value


def off_modifier() -> float:
    depsgraph = bpy.context.window_manager.windows[0].view_layer.depsgraph
    rig = bpy.data.objects["Hero Rig"]
    expected = window_scene.blender_points(hero(), rig, "lbs", depsgraph)
    return window_scene.worst(window_scene.shown_points(hero(), depsgraph), expected)


class KeepingEngine(bpy.types.RenderEngine):
    """Draws nothing, and stores what it is given."""

    bl_idname, bl_label = "SINEW_KEEPING", "Keeping"
    points: np.ndarray | None = None

    def render(self, depsgraph):
        for obj in depsgraph.objects:
            if obj.name == "Hero":
                points = np.empty((len(obj.data.vertices), 3), dtype=np.float32)
                obj.data.vertices.foreach_get("co", points.ravel())
                KeepingEngine.points = points
        self.end_result(self.begin_result(0, 0, 4, 4))


def make_hero() -> None:
    """All of its weights are different, so that the computation takes long."""
    window_scene.make_character("Hero", VERTICES, (0.0, 0.0, 0.0))
    weights = np.random.default_rng(1).uniform(0.05, 0.6, (len(hero().vertex_groups), VERTICES))
    for group, own in zip(hero().vertex_groups, weights, strict=True):
        for vertex, weight in enumerate(own.tolist()):
            group.add([vertex], weight, "ADD")


def forget() -> None:
    """Forgets all results."""
    precomputations = sinew("skinning.precompute").precomputations
    precomputations._made.clear()
    precomputations.cache = None
    with window.in_view3d():
        bpy.ops.sinew.rebind("EXEC_DEFAULT")


def steps() -> Generator[None, None, dict]:
    yield from add_sinew()
    found = yield from see_it_found()
    yield from stop_and_go_on()
    yield from render(found)
    yield from end_while_it_runs()
    return facts


def add_sinew() -> Iterator[None]:
    bpy.context.preferences.filepaths.temporary_directory = str(FOLDER)
    scene = bpy.context.window.scene
    make_hero()
    scene.frame_set(12)
    window.select_only(hero())
    window.open_sidebar()
    yield
    window.choose_tab()
    with window.in_view3d():
        bpy.ops.sinew.add("INVOKE_DEFAULT")
    yield


def see_it_found() -> Generator[None, None, np.ndarray]:
    sinew("skinning.precompute").precomputations.cache = None
    started = time.monotonic()
    hero().sinew.method = "cor"
    facts["seconds_to_set"] = time.monotonic() - started
    facts["plan_at_first"] = plan()
    ticks = 0
    while plan() == "waiting" and ticks < 2000:
        ticks += 1
        if ticks == 3:
            facts["off_modifier_meanwhile"] = off_modifier()
            facts["watched"] = [op.bl_idname for op in bpy.context.window_manager.windows[0].modal_operators]
        yield
    facts["ticks_meanwhile"] = ticks
    facts["plan_then"] = plan()
    yield
    facts["off_modifier_then"] = off_modifier()
    return window_scene.shown_points(hero(), bpy.context.window_manager.windows[0].view_layer.depsgraph)


def stop_and_go_on() -> Iterator[None]:
    forget()
    yield from window.until(
        lambda: any(bpy.context.window_manager.windows[0].modal_operators), "the precomputation"
    )
    area = window.area_of("VIEW_3D")
    window.press("ESC", (area.width // 2, area.height // 2))
    yield from window.until(lambda: not sinew("skinning.precompute").precomputations.running, "its end")
    yield from window.wait()
    facts["plan_stopped"] = plan()
    facts["reason_stopped"] = sinew("deform.session").skinned_of(hero()).plan.lacks
    with window.in_view3d():
        bpy.ops.sinew.precompute("INVOKE_DEFAULT")
    yield from window.until(lambda: plan() == "in depsgraph", "its shape", PATIENCE)
    facts["plan_after_button"] = plan()


def render(found: np.ndarray) -> Iterator[None]:
    scene = bpy.context.window_manager.windows[0].scene
    bpy.utils.register_class(KeepingEngine)
    scene.render.engine = "SINEW_KEEPING"
    scene.render.resolution_x = scene.render.resolution_y = 4
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    yield
    for locked in (True, False):
        scene.render.use_lock_interface = locked
        KeepingEngine.points = None
        forget()
        facts.setdefault("plan_before_render", []).append(plan())
        with window.in_view3d():
            bpy.ops.render.render("INVOKE_DEFAULT")
        yield from window.until(lambda: KeepingEngine.points is not None, "the render", PATIENCE)
        yield from window.until(lambda: not bpy.app.is_job_running("RENDER"), "the end of the render")
        facts.setdefault("render_off", []).append(window_scene.worst(KeepingEngine.points, found))
        yield from window.until(lambda: plan() == "in depsgraph", "its shape", PATIENCE)


def end_while_it_runs() -> Iterator[None]:
    """Undo, another file, and the end of Blender."""
    forget()
    bpy.ops.ed.undo_push(message="one")
    bpy.ops.ed.undo_push(message="two")
    bpy.ops.ed.undo()
    yield
    forget()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    facts["running_after_load"] = len(sinew("skinning.precompute").precomputations.running)
    yield
    make_hero()
    sinew("attach.attach").add(hero(), "cor")
    sinew("deform.session").refresh(bpy.context)
    facts["plan_at_the_end"] = plan()
