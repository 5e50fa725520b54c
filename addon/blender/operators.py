# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel's buttons: poll, gather, one call, report."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import bpy

from ..core.errors import SinewError
from ..core.frames import parse_frames
from . import bake, drive, handlers, inbetween, inbetween_bake, properties

# A bake in the window draws in between: rarely enough to cost little, often enough for Esc.
SECONDS_BETWEEN_REDRAWS = 0.1


def _chosen(context: bpy.types.Context) -> list[bpy.types.Object]:
    """The objects selected or active."""
    chosen = list(context.selected_objects)
    active = context.active_object
    if active is not None and active not in chosen:
        chosen.append(active)
    return chosen


def armatures(context: bpy.types.Context) -> list[bpy.types.Object]:
    """The armatures meant: those selected or active, and those of such meshes; the active one first."""
    found = {o if o.type == "ARMATURE" else drive.armature_of(o) for o in _chosen(context)} - {None}
    return sorted(found, key=lambda o: (o != context.active_object, o.name))


def targets(context: bpy.types.Context) -> list[bpy.types.Object]:
    """The meshes meant: those active or selected, and all that a selected or active armature deforms."""
    chosen, active = _chosen(context), context.active_object
    armatures = {o for o in chosen if o.type == "ARMATURE"}
    meshes = [
        o
        for o in drive.deformed_meshes(list(context.scene.objects))
        if o in chosen or drive.armature_of(o) in armatures
    ]
    # The active one first: the panel shows its details.
    return sorted(meshes, key=lambda o: o != active)


def driven_targets(context: bpy.types.Context) -> list[bpy.types.Object]:
    return [obj for obj in targets(context) if properties.is_driven(obj)]


def _for_each(
    operator: bpy.types.Operator,
    objects: list[bpy.types.Object],
    action: Callable[[bpy.types.Object], None],
    done: str,
) -> set[str]:
    count = 0
    for obj in objects:
        try:
            action(obj)
            count += 1
        except SinewError as error:
            operator.report({"ERROR"}, str(error))
    if count == 0:
        return {"CANCELLED"}
    operator.report({"INFO"}, f"{done} {count} mesh{'es' if count > 1 else ''}")
    return {"FINISHED"}


class SINEW_OT_add(bpy.types.Operator):
    bl_idname = "sinew.add"
    bl_label = "Add Sinew"
    bl_description = (
        "Deform with Sinew in the place of the Armature modifier, which stays in the stack, switched off"
    )
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if any(not properties.is_driven(obj) for obj in targets(context)):
            return True
        others = drive.not_meshes(context.selected_objects)
        if others:
            cls.poll_message_set(f"{others[0].name} is no mesh: Sinew deforms meshes only")
        else:
            cls.poll_message_set("Select a mesh with an Armature modifier, or an armature that deforms one")
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        objects = [obj for obj in targets(context) if not properties.is_driven(obj)]
        result = _for_each(self, objects, drive.add, "Sinew deforms")
        handlers.session.forget()
        handlers.refresh(context)
        return result


class OnDriven:
    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if driven_targets(context):
            return True
        cls.poll_message_set("Select a mesh that Sinew deforms, or its armature")
        return False


class SINEW_OT_rebind(OnDriven, bpy.types.Operator):
    bl_idname = "sinew.rebind"
    bl_label = "Rebind"
    bl_description = "Read mesh, weights and bones anew, and switch on again after an error"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        objects = driven_targets(context)
        result = _for_each(self, objects, lambda obj: handlers.rebind(obj, context), "Rebound")
        failed = [properties.of(obj).error for obj in objects if properties.of(obj).error]
        if failed:
            self.report({"ERROR"}, failed[0])
            return {"CANCELLED"}
        return result


class SINEW_OT_remove(OnDriven, bpy.types.Operator):
    bl_idname = "sinew.remove"
    bl_label = "Remove"
    bl_description = "Take Sinew off and give the Armature modifier back as it was"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        objects = driven_targets(context)
        result = _for_each(self, objects, drive.remove, "Removed Sinew from")
        handlers.session.forget()
        return result


class SINEW_OT_bake(OnDriven, bpy.types.Operator):
    bl_idname = "sinew.bake"
    bl_label = "Bake"
    bl_description = "Write what Sinew deforms as data that plays without it"
    bl_options = {"REGISTER", "UNDO"}

    kind: bpy.props.EnumProperty(
        name="To",
        items=[
            ("shape-keys", "Shape Keys", "One a frame, with keyed values, in this file"),
            ("mdd", "MDD Cache", "A point cache and a Mesh Cache modifier, in this file"),
            ("pc2", "PC2 Cache", "A point cache and a Mesh Cache modifier, in this file"),
            ("alembic", "Alembic", "The final meshes with UVs and materials; this file stays as it is"),
            ("usd", "USD", "The final meshes with UVs and materials; this file stays as it is"),
            ("gltf", "glTF", "The final meshes, the frames as morph targets; this file stays as it is"),
        ],
    )
    frames: bpy.props.StringProperty(
        name="Frames", description="Such as 1,12,40-48; empty: the scene's frames", default=""
    )
    step: bpy.props.IntProperty(
        name="Step", description="Every so many of the frames", default=1, min=1, soft_max=12
    )
    folder: bpy.props.StringProperty(
        name="Folder",
        description="Where files go; // is beside this file",
        default="//",
        subtype="DIR_PATH",
        # Without it, newer versions warn of "//"; older ones do not know it.
        options={"PATH_SUPPORTS_BLEND_RELATIVE"} if bpy.app.version >= (4, 5) else set(),
    )
    overwrite: bpy.props.BoolProperty(
        name="Overwrite", description="Replace files that are there already", default=False
    )
    in_steps: bpy.props.BoolProperty(options={"HIDDEN", "SKIP_SAVE"})

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if not self.in_steps:
            self.asked = True
            return context.window_manager.invoke_props_dialog(self)
        try:
            self.bake = self._start(context)
        except SinewError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.steps = self.bake.sample()
        manager = context.window_manager
        self.timer = manager.event_timer_add(0.0, window=context.window)
        manager.progress_begin(0.0, 1.0)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.type == "ESC":
            self.cancel(context)
            self.report({"WARNING"}, "Bake stopped; nothing was written")
            return {"CANCELLED"}
        # Whatever else is done meanwhile would end up in the bake.
        if event.type != "TIMER":
            return {"RUNNING_MODAL"}
        try:
            until = time.perf_counter() + SECONDS_BETWEEN_REDRAWS
            part = next(self.steps, None)
            while part is not None and time.perf_counter() < until:
                part = next(self.steps, None)
            if part is None:
                self._end(context)
                return self._finish(self.bake)
        except SinewError as error:
            self._end(context)
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        context.window_manager.progress_update(part)
        context.workspace.status_text_set(f"Sinew bakes: {part:.0%} (Esc stops)")
        return {"RUNNING_MODAL"}

    def cancel(self, context: bpy.types.Context) -> None:
        """Also when the window closes; not of a dialog."""
        if self.in_steps:
            self.steps.close()
            self._end(context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        if getattr(self, "asked", False):
            # A dialog's operator can not go on in steps itself.
            names = ("kind", "frames", "step", "folder", "overwrite")
            bpy.ops.sinew.bake(
                "INVOKE_DEFAULT", in_steps=True, **{name: getattr(self, name) for name in names}
            )
            return {"CANCELLED"}
        try:
            started = self._start(context)
            for _part in started.sample():
                pass
            return self._finish(started)
        except SinewError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}

    def _start(self, context: bpy.types.Context) -> bake.Started:
        scene, name = context.scene, Path(bpy.data.filepath).stem
        if self.kind != bake.SHAPE_KEYS and self.folder.startswith("//") and not name:
            raise SinewError("Save the file first, or choose a folder that is not beside it")
        frames = sorted(set(parse_frames(self.frames))) if self.frames.strip() else None
        frames = frames or list(range(scene.frame_start, scene.frame_end + 1))
        suffix = bake.suffix_of(self.kind)
        target = Path(bpy.path.abspath(self.folder)) / f"{name or 'untitled'}{suffix}"
        return bake.start(driven_targets(context), self.kind, frames[:: self.step], target, self.overwrite)

    def _finish(self, started: bake.Started) -> set[str]:
        started.publish()
        started.place()
        self.report({"INFO"}, f"Baked {started.what}")
        return {"FINISHED"}

    def _end(self, context: bpy.types.Context) -> None:
        manager = context.window_manager
        manager.event_timer_remove(self.timer)
        manager.progress_end()
        context.workspace.status_text_set(None)


class SINEW_OT_bake_inbetweens(bpy.types.Operator):
    bl_idname = "sinew.bake_inbetweens"
    bl_label = "Bake In-betweens"
    bl_description = (
        "Write the in-betweens as plain keys into a copy of the action, which plays without Sinew; the "
        "action itself stays in the file"
    )
    bl_options = {"REGISTER", "UNDO"}

    step: bpy.props.IntProperty(
        name="Step", description="Frames from one baked key to the next", default=1, min=1, soft_max=12
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if any(inbetween.is_on(armature) for armature in armatures(context)):
            return True
        cls.poll_message_set("Choose a method for the in-betweens of a selected armature")
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        manager = context.window_manager
        manager.progress_begin(0.0, 1.0)
        baked = []
        try:
            for armature in filter(inbetween.is_on, armatures(context)):
                try:
                    baked.append(inbetween_bake.bake(armature, self.step, manager.progress_update))
                except SinewError as error:
                    self.report({"ERROR"}, str(error))
        finally:
            manager.progress_end()
        if not baked:
            return {"CANCELLED"}
        names = ", ".join(f"{one.bones} bones into {one.action.name}" for one in baked)
        self.report({"INFO"}, f"Baked {names}")
        return {"FINISHED"}


CLASSES = (SINEW_OT_add, SINEW_OT_rebind, SINEW_OT_remove, SINEW_OT_bake, SINEW_OT_bake_inbetweens)
