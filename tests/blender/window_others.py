# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps with other programs and code in Blender: exporters, renders, other add-ons, libraries."""

from __future__ import annotations

import contextlib
import random
from collections.abc import Callable

import addon_utils
import bpy
import window
import window_scene
from window_hand import (
    FOLDER,
    PATIENCE,
    Run,
    Steps,
    choose,
    click,
    fresh,
    hero,
    press,
    rig,
    set_frame,
    step,
    wait,
)
from window_scene import blender_points, shown_points, worst


@step("exports")
def gltf(run: Run) -> Steps:
    for applied in (False, True):
        path = FOLDER / f"hero-{applied}.glb"
        choose("Hero", "Hero Rig")
        with window.in_view3d("WINDOW"):
            bpy.ops.export_scene.gltf(
                filepath=str(path), use_selection=True, export_format="GLB", export_apply=applied
            )
        data = path.read_bytes()
        run.check(
            b'"skins"' in data and b"JOINTS_0" in data, f"glTF has no skin, modifiers applied: {applied}"
        )
        run.note_exported(path)
        run.check_shapes("right after the export")
        yield from wait()
        run.check_shapes("after the export")
    yield from run.check_frames()


@step("exports")
def fbx(run: Run) -> Steps:
    for applied in (False, True):
        path = FOLDER / f"hero-{applied}.fbx"
        choose("Hero", "Hero Rig")
        with window.in_view3d("WINDOW"):
            bpy.ops.export_scene.fbx(
                filepath=str(path), use_selection=True, bake_anim=False, use_mesh_modifiers=applied
            )
        run.check(b"SubDeformer" in path.read_bytes(), f"FBX has no skin, modifiers applied: {applied}")
        run.note_exported(path)
        run.check_shapes("right after the export")
        yield from wait()
        run.check_shapes("after the export")
    yield from run.check_frames()


@step("exports")
def save_after_exports(run: Run) -> Steps:
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "exported.blend"), copy=True)
    run.note_saved(FOLDER / "exported.blend")
    yield from wait()


class ComparingEngine(bpy.types.RenderEngine):
    """Draws nothing; compares the characters in the render's own evaluation. A GPU render engine would
    alternate with the window, so that the two threads would never run at the same time."""

    bl_idname, bl_label = "SINEW_COMPARING", "Comparing"
    seen: list[tuple[int, str, float]] = []
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


@step("renders")
def render_locked(run: Run) -> Steps:
    bpy.utils.register_class(ComparingEngine)
    bpy.context.preferences.view.render_display_type = "NONE"
    _start_render(run, True, 20, {"Hero": "dq", "Small": "lbs", "Front": "dq", "Late": "dq"})
    yield from _end_of_render()
    _check_rendered(run, 20)
    run.check_shapes("after the render")
    yield from run.check_frames()


@step("renders")
def render_unlocked(run: Run) -> Steps:
    """Without using the panel."""
    _start_render(run, False, 20, {"Hero": "dq", "Small": "lbs", "Front": "dq", "Late": "dq"})
    yield from _end_of_render()
    _check_rendered(run, 20)
    run.check_shapes("after the render")
    yield from run.check_frames()


@step("renders")
def render_unlocked_while_it_plays(run: Run) -> Steps:
    with window.in_view3d():
        bpy.ops.screen.animation_play()
    yield from wait(5)
    _start_render(run, False, 20, {})
    yield from _end_of_render()
    with window.in_view3d():
        bpy.ops.screen.animation_cancel(restore_frame=False)
    yield from wait()
    run.check_shapes("after the render")
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
    yield from wait()
    run.check_shapes("afterwards")
    yield from run.check_frames()
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "rendered.blend"), copy=True)
    run.note_saved(FOLDER / "rendered.blend")
    click("sinew.remove", "Hero")
    run.wanted["Hero"] = ""
    yield from wait()
    run.check_shapes("removed afterwards")
    click("sinew.add", "Hero")
    run.wanted["Hero"] = "lbs"
    yield from wait()
    run.check_shapes("added afterwards")
    yield from run.check_frames()


@step("renders")
def open_another_file_after_renders(run: Run) -> Steps:
    yield from fresh(run)
    run.check_shapes("in a fresh file")
    yield from run.check_frames()


@step("renders")
def stop_a_render(run: Run) -> Steps:
    _start_render(run, False, 200, {})
    yield from wait(10)
    press("ESC")
    yield from _end_of_render()
    scene = bpy.context.window_manager.windows[0].scene
    scene.frame_start, scene.frame_end = 1, 20
    run.check_shapes("after Esc")
    yield from run.check_frames()


class Hostile:
    """A handler of another add-on, before Sinew's own or after them."""

    def __init__(
        self, what: Callable[[], None], event: str = "frame_change_post", ahead: bool = True
    ) -> None:
        self.what, self.functions, self.ahead = what, getattr(bpy.app.handlers, event), ahead

    def __call__(self, *_arguments: object) -> None:
        self.what()

    def __enter__(self) -> Hostile:
        self.functions.insert(0 if self.ahead else len(self.functions), self)
        return self

    def __exit__(self, *_error: object) -> None:
        self.functions.remove(self)


def _deforms(run: Run, when: str) -> None:
    """Deformed by Sinew, or by the Armature modifier with a message; never at rest without a message."""
    depsgraph = bpy.context.window_manager.windows[0].view_layer.depsgraph
    shown = shown_points(hero(), depsgraph)
    by = {m: worst(shown, blender_points(hero(), rig(), m, depsgraph)) for m in ("dq", "lbs")}
    told = bool(hero().sinew.error) or not hero().sinew.enabled or not len(hero().sinew.replaced_modifiers)
    near = {method: off <= window_scene.TOLERANCE for method, off in by.items()}
    off = f"off by {by['dq']:.4f} from dq and {by['lbs']:.4f} from lbs"
    run.check(near["dq"] or (near["lbs"] and told), f"Hero {when} is {off}; error: {hero().sinew.error!r}")


@step("hostile")
def node_groups_removed(run: Run) -> Steps:
    def remove() -> None:
        for group in [g for g in bpy.data.node_groups if "Sinew" in g.name]:
            bpy.data.node_groups.remove(group)

    # The others have lost theirs as well, and report it.
    del run.wanted["Small"], run.wanted["Front"], run.wanted["Late"]
    for ahead in (True, False):
        where = "ahead of Sinew" if ahead else "behind Sinew"
        with Hostile(remove, ahead=ahead):
            for frame in (5, 6, 18):
                set_frame(frame)
                yield from wait()
                # If removed after Sinew's, it is noticed at the next frame; if repeatedly, at the third.
                if ahead or frame > 6:
                    _deforms(run, f"without its node group, removed {where}, at frame {frame}")
            bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "hostile.blend"), copy=True)
            yield from wait()
            _deforms(run, f"after saving, {where}")
        click("sinew.remove", "Hero")
        click("sinew.add", "Hero")
        hero().sinew.method = "dq"
        yield from run.check_frames()
    yield from fresh(run)


@step("hostile")
def modifiers_renamed(run: Run) -> Steps:
    number = 0

    def rename() -> None:
        nonlocal number
        number += 1
        for modifier in hero().modifiers:
            modifier.name = f"Renamed {number}"

    for event in ("frame_change_pre", "frame_change_post"):
        for ahead in (True, False):
            with Hostile(rename, event, ahead):
                for frame in (5, 6, 18):
                    set_frame(frame)
                    yield from wait()
                    _deforms(run, f"renamed at {event}, ahead {ahead}, frame {frame}")
    yield from run.check_frames()
    yield from fresh(run)


@step("hostile")
def modifiers_deleted(run: Run) -> Steps:
    def delete() -> None:
        for modifier in [m for m in hero().modifiers if m.type == "NODES"]:
            hero().modifiers.remove(modifier)

    for ahead in (True, False):
        with Hostile(delete, ahead=ahead):
            for frame in (5, 6, 18):
                set_frame(frame)
                yield from wait()
                if ahead or frame > 5:
                    _deforms(run, f"without its modifier, ahead {ahead}, at frame {frame}")
        bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "deleted.blend"), copy=True)
        yield from fresh(run)


@step("hostile")
def suspended_modifiers_renamed_and_deleted(run: Run) -> Steps:
    """A character with an animation: its other modifiers are suspended between Sinew's two handlers,
    while another add-on renames, deletes and adds some."""
    obj = hero()
    obj.modifiers.new("Behind", "SMOOTH").factor = 0.0
    obj.modifiers.new("Doomed", "SMOOTH").factor = 0.0
    obj.keyframe_insert("location", frame=1)
    obj.location.z += 1.0
    obj.keyframe_insert("location", frame=20)
    # So that it is deformed after the update.
    cast = obj.modifiers.new("Cast", "CAST")
    cast.factor = 0.0
    obj.modifiers.move(len(obj.modifiers) - 1, 0)
    yield from wait()
    for frame in (2, 3):
        set_frame(frame)
        yield from wait()
    number = 0

    def meddle() -> None:
        nonlocal number
        number += 1
        for modifier in hero().modifiers:
            if modifier.name.startswith("Behind"):
                modifier.name = f"Behind {number}"
        doomed = hero().modifiers.get("Doomed")
        if doomed is not None:
            hero().modifiers.remove(doomed)

    for ahead in (True, False):
        with Hostile(meddle, "frame_change_pre", ahead):
            for frame in (5, 6, 18):
                set_frame(frame)
                yield from wait()
                run.check_shapes(f"at frame {frame}, ahead {ahead}")
    for modifier in hero().modifiers:
        if modifier.name.startswith(("Behind", "Cast")):
            run.check(modifier.show_viewport and modifier.show_render, f"{modifier.name} stays off")
    yield from fresh(run)


@step("hostile")
def weights_changed_behind_sinew(run: Run) -> Steps:
    """Blender sends no notification of what a handler changes."""
    changed = []

    def change() -> None:
        if not changed:
            changed.append(True)
            hero().vertex_groups[0].add(range(3000), 1.0, "REPLACE")

    with Hostile(change, "depsgraph_update_post", ahead=False):
        window_scene.pose(rig(), 40.0)
        yield from window.until(lambda: changed, "a change of weights", PATIENCE)
        yield from wait(20)
    run.check_shapes("after the change")
    yield from run.check_frames()
    yield from fresh(run)


@step("hostile")
def others_throw(run: Run) -> Steps:
    def throw() -> None:
        raise ValueError("another add-on's fault")

    for event in ("frame_change_pre", "frame_change_post", "depsgraph_update_post", "save_pre", "save_post"):
        with Hostile(throw, event):
            set_frame(bpy.context.window_manager.windows[0].scene.frame_current % 20 + 1)
            yield from wait()
            run.check_shapes(f"while {event} throws")
            path = FOLDER / f"throws-{event}.blend"
            bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
            run.note_saved(path)
            yield from wait()
            run.check_shapes(f"after {event} threw")
    yield from run.check_frames()


@step("hostile")
def evaluations_within_saving(run: Run) -> Steps:
    """Another add-on evaluates, and changes the frame, between save_pre and the writing."""

    def evaluate() -> None:
        scene = bpy.context.window_manager.windows[0].scene
        scene.frame_set(scene.frame_current)
        bpy.context.evaluated_depsgraph_get()
        bpy.context.view_layer.update()

    with Hostile(evaluate, "save_pre"):
        path = FOLDER / "evaluated.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
        run.note_saved(path)
        yield from wait()
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
        yield from wait()
        run.check_shapes(f"disabled at frame {7 + turn}")
        bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / f"disabled{turn}.blend"), copy=True)
        bpy.ops.preferences.addon_enable(module=module)
        yield from wait()
        run.check_shapes(f"enabled, turn {turn}")
        yield from run.check_frames()


@step("libraries")
def append(run: Run) -> Steps:
    source = FOLDER / "library.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(source), copy=True)
    run.note_saved(source)
    bpy.ops.wm.open_mainfile(filepath=str(FOLDER / "base.blend"))
    yield from wait()
    scene = bpy.context.window_manager.windows[0].scene
    for obj in list(scene.objects):
        bpy.data.objects.remove(obj)
    run.wanted = {"Guest": ""}
    with bpy.data.libraries.load(str(source)) as (_from, to):
        to.objects = ["Hero", "Hero Rig"]
    for obj in to.objects:
        scene.collection.objects.link(obj)
    yield from wait(4)
    _deforms(run, "appended")
    set_frame(4)
    yield from wait()
    _deforms(run, "appended at frame 4")
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "appended.blend"), copy=True)
    yield from wait()


@step("libraries")
def link_and_override(run: Run) -> Steps:
    source = FOLDER / "library.blend"
    bpy.ops.wm.open_mainfile(filepath=str(FOLDER / "base.blend"))
    yield from wait()
    scene = bpy.context.window_manager.windows[0].scene
    for obj in list(scene.objects):
        bpy.data.objects.remove(obj)
    run.wanted = {"Guest": ""}
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "links.blend"))
    with bpy.data.libraries.load(str(source), link=True) as (_from, to):
        to.objects = ["Hero", "Hero Rig"]
    for obj in to.objects:
        scene.collection.objects.link(obj)
    yield from wait(4)
    _linked_deforms(run, "linked")
    set_frame(4)
    yield from wait()
    _linked_deforms(run, "linked at frame 4")
    for obj in list(to.objects):
        made = obj.override_create(remap_local_usages=True)
        if made.name not in scene.collection.objects:
            scene.collection.objects.link(made)
    yield from wait(4)
    _linked_deforms(run, "overridden")
    set_frame(15)
    yield from wait()
    _linked_deforms(run, "overridden at frame 15")
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "overridden.blend"))
    yield from wait()
    bpy.ops.wm.open_mainfile(filepath=str(FOLDER / "overridden.blend"))
    yield from wait(4)
    _linked_deforms(run, "overridden, opened again")


def _linked_deforms(run: Run, when: str) -> None:
    """Deformed by Sinew or by Blender's most similar method, which is the same here; and animated."""
    main = bpy.context.window_manager.windows[0]
    depsgraph = main.view_layer.depsgraph
    for obj in main.scene.objects:
        if obj.type == "MESH" and obj.name.startswith("Hero"):
            armatures = [o for o in main.scene.objects if o.type == "ARMATURE"]
            armature = next(o for o in armatures if o.library == obj.library)
            shown = shown_points(obj, depsgraph)
            off = worst(shown, blender_points(obj, armature, "dq", depsgraph))
            text = f"{obj.name_full} {when} is off by {off:.4f}: {obj.sinew.error}"
            run.check(off <= window_scene.TOLERANCE, text)
