# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps with other programs and code in Blender: exporters, renders, other add-ons."""

from __future__ import annotations

import contextlib
import random

import addon_utils
import bpy
import window
import window_scene
from window_hand import FOLDER, PATIENCE, Run, Steps, click, fresh, playing, set_frame, step, wait
from window_scene import blender_points, shown_points, worst


class ComparingEngine(bpy.types.RenderEngine):
    """Draws nothing; compares the characters in the render's own evaluation. A GPU render engine would
    alternate with the window, so that the two threads would never run at the same time."""

    bl_idname, bl_label = "SINEW_COMPARING", "Comparing"
    seen: list[tuple[int, str, float]] = []
    stops_at = 0
    wanted: dict[str, str] = {}

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        for name, method in self.wanted.items():
            obj = depsgraph.scene.objects.get(name)
            if obj is None:
                continue
            original = obj.original
            expected = blender_points(original, bpy.data.objects[f"{name} Rig"], method or "lbs", depsgraph)
            off = worst(shown_points(original, depsgraph), expected)
            self.seen.append((depsgraph.scene.frame_current, name, off))
        result = self.begin_result(
            0, 0, depsgraph.scene.render.resolution_x, depsgraph.scene.render.resolution_y
        )
        self.end_result(result)
        if depsgraph.scene.frame_current == self.stops_at:
            # Blender then stops as by Esc. A simulated Esc stops no render.
            self.report({"ERROR"}, "stopped")


def _start_render(run: Run, locked: bool, frames: int, compare: dict[str, str]) -> None:
    scene = bpy.context.window_manager.windows[0].scene
    scene.render.engine = "SINEW_COMPARING"
    scene.render.resolution_x = scene.render.resolution_y = 16
    scene.render.use_lock_interface = locked
    scene.frame_start, scene.frame_end = 1, frames
    scene.render.filepath = str(FOLDER / "frames" / "f")
    ComparingEngine.seen.clear()
    ComparingEngine.wanted = compare
    with window.in_view3d():
        bpy.ops.render.render("INVOKE_DEFAULT", animation=True)


def _is_rendering() -> bool:
    return bpy.app.is_job_running("RENDER")


def _end_of_render() -> Steps:
    """Sinew notices it within a twentieth of a second, and then shows the window's frame again."""
    yield from window.until(lambda: not _is_rendering(), "the end of the render", PATIENCE)
    yield from wait(5)


def _check_rendered(run: Run, frames: int) -> None:
    seen = ComparingEngine.seen
    count = len({frame for frame, _name, _off in seen})
    run.check(count == frames, f"{count} of {frames} frames were rendered")
    wrong = [(frame, name, round(off, 4)) for frame, name, off in seen if off > window_scene.TOLERANCE]
    run.check(not wrong, f"rendered frames are off: {wrong[:6]}, {len(wrong)} of {len(seen)}")


def _render(run: Run, locked: bool) -> Steps:
    _start_render(run, locked, 20, {"Hero": "dq", "Small": "lbs", "Front": "dq", "Late": "dq"})
    yield from _end_of_render()
    _check_rendered(run, 20)
    run.check_shapes("after the render")
    yield from run.check_frames()


@step("renders")
def render_locked(run: Run) -> Steps:
    bpy.utils.register_class(ComparingEngine)
    bpy.context.preferences.view.render_display_type = "NONE"
    yield from _render(run, True)


@step("renders")
def render_unlocked(run: Run) -> Steps:
    """Without using the panel."""
    yield from _render(run, False)


@step("renders")
def render_unlocked_while_it_plays(run: Run) -> Steps:
    with playing():
        yield from wait(5)
        _start_render(run, False, 20, {})
        yield from _end_of_render()
    yield from run.see("after the render")
    yield from run.check_frames()


@step("renders")
def click_during_unlocked_renders(run: Run) -> Steps:
    """Uses the panel's buttons and properties while the render's thread goes through the frames. The
    panel may refuse them."""
    chance = random.Random(16)
    for _turn in range(3):
        _start_render(run, False, 60, {})
        while _is_rendering():
            yield
            name = chance.choice(("Hero", "Small", "Front", "Late"))
            obj = bpy.data.objects[name]
            action = chance.randrange(7)
            try:
                if action == 0:
                    click("sinew.add", name)
                elif action == 1:
                    click("sinew.remove", name)
                elif action == 2:
                    click("sinew.rebind", name)
                elif action == 3:
                    obj.sinew.enabled = not obj.sinew.enabled
                else:
                    obj.sinew.method = chance.choice(("lbs", "dq"))
            except RuntimeError:
                # The button is greyed out.
                pass
        yield from wait()
    # As an artist checks the result.
    for name in ("Hero", "Small", "Front", "Late"):
        with contextlib.suppress(RuntimeError):
            click("sinew.add", name)
        obj = bpy.data.objects[name]
        obj.sinew.enabled = True
        obj.sinew.method = "dq"
        run.wanted[name] = "dq"
    yield from run.see("afterwards")
    yield from run.check_frames()
    run.save("rendered.blend", copy=True)
    click("sinew.remove", "Hero")
    run.wanted["Hero"] = ""
    yield from run.see("removed afterwards")
    click("sinew.add", "Hero")
    run.wanted["Hero"] = "lbs"
    yield from run.see("added afterwards")
    yield from run.check_frames()


@step("renders")
def open_another_file_after_renders(run: Run) -> Steps:
    yield from fresh(run)
    run.check_shapes("in a fresh file")
    yield from run.check_frames()


@step("renders")
def stop_a_render(run: Run) -> Steps:
    ComparingEngine.stops_at = 10
    _start_render(run, False, 20, run.wanted)
    yield from _end_of_render()
    ComparingEngine.stops_at = 0
    _check_rendered(run, 10)
    scene = bpy.context.window_manager.windows[0].scene
    scene.frame_start, scene.frame_end = 1, 20
    run.check_shapes("after the stop")
    yield from run.check_frames()


@step("renders")
def others_throw(run: Run) -> Steps:
    """Another add-on's handler fails before Sinew's is called."""

    def throw(*_arguments: object) -> None:
        raise ValueError("another add-on's fault")

    for event in ("frame_change_pre", "frame_change_post", "depsgraph_update_post", "save_pre", "save_post"):
        functions = getattr(bpy.app.handlers, event)
        functions.insert(0, throw)
        try:
            set_frame(bpy.context.window_manager.windows[0].scene.frame_current % 20 + 1)
            yield from run.see(f"while {event} throws")
            run.save(f"throws-{event}.blend", copy=True)
            yield from run.see(f"after {event} threw")
        finally:
            functions.remove(throw)
    yield from run.check_frames()


def _module() -> str:
    return next(m.__name__ for m in addon_utils.modules() if m.__name__.endswith(".sinew"))


@step("addon")
def disable_and_enable(run: Run) -> Steps:
    module = _module()
    for turn in range(2):
        bpy.ops.preferences.addon_disable(module=module)
        yield from wait()
        # With Blender's most similar method.
        run.check_shapes(f"disabled, turn {turn}")
        set_frame(7 + turn)
        yield from run.see(f"disabled at frame {7 + turn}")
        bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / f"disabled{turn}.blend"), copy=True)
        bpy.ops.preferences.addon_enable(module=module)
        yield from run.see(f"enabled, turn {turn}")
        yield from run.check_frames()
