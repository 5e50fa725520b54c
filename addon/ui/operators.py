# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel's buttons: poll, gather, one call, report."""

from __future__ import annotations

from collections.abc import Callable

import bpy

from ..attach import attach, corrective_smooth, properties, stage_settings
from ..attach.updates import is_rendering_in_window
from ..core.errors import SinewError
from ..deform import session


def _chosen(context: bpy.types.Context) -> list[bpy.types.Object]:
    """The objects selected or active."""
    chosen = list(context.selected_objects)
    active = context.active_object
    if active is not None and active not in chosen:
        chosen.append(active)
    return chosen


def armatures(context: bpy.types.Context) -> list[bpy.types.Object]:
    """The armatures meant: those selected or active, and those of such meshes; the active one first."""
    found = {o if o.type == "ARMATURE" else attach.armature_of(o) for o in _chosen(context)} - {None}
    return sorted(found, key=lambda o: (o != context.active_object, o.name))


def targets(context: bpy.types.Context) -> list[bpy.types.Object]:
    """The meshes meant: those active or selected, and all that a selected or active armature deforms."""
    chosen, active = _chosen(context), context.active_object
    armatures = {o for o in chosen if o.type == "ARMATURE"}
    meshes = [
        o
        for o in attach.deformed_meshes(list(context.scene.objects))
        if o in chosen or attach.armature_of(o) in armatures
    ]
    # The active one first: the panel shows its details.
    return sorted(meshes, key=lambda o: o != active)


def sinew_targets(context: bpy.types.Context) -> list[bpy.types.Object]:
    return [obj for obj in targets(context) if properties.has_sinew(obj)]


def waits_for_render() -> str:
    """What a button has to wait for, as its thread reads what the button would change; else empty."""
    return "Wait for the end of the render" if is_rendering_in_window() else ""


def can_change(operator: type[bpy.types.Operator]) -> bool:
    """For poll()."""
    reason = waits_for_render()
    if reason:
        operator.poll_message_set(reason)
    return not reason


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
        if any(not properties.has_sinew(obj) for obj in targets(context)):
            return can_change(cls)
        others = attach.not_meshes(context.selected_objects)
        if others:
            cls.poll_message_set(f"{others[0].name} is no mesh: Sinew deforms meshes only")
        else:
            cls.poll_message_set("Select a mesh with an Armature modifier, or an armature that deforms one")
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        objects = [obj for obj in targets(context) if not properties.has_sinew(obj)]
        result = _for_each(self, objects, attach.add, "Sinew deforms")
        session.forget()
        session.refresh(context)
        return result


class OnSinewObjects:
    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if sinew_targets(context):
            return can_change(cls)
        cls.poll_message_set("Select a mesh that Sinew deforms, or its armature")
        return False


class SINEW_OT_rebind(OnSinewObjects, bpy.types.Operator):
    bl_idname = "sinew.rebind"
    bl_label = "Rebind"
    bl_description = "Read mesh, weights and bones anew, and switch on again after an error"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        objects = sinew_targets(context)
        result = _for_each(self, objects, lambda obj: session.rebind(obj, context), "Rebound")
        failed = [properties.of(obj).error for obj in objects if properties.of(obj).error]
        if failed:
            self.report({"ERROR"}, failed[0])
            return {"CANCELLED"}
        return result


class SINEW_OT_remove(OnSinewObjects, bpy.types.Operator):
    bl_idname = "sinew.remove"
    bl_label = "Remove"
    bl_description = "Take Sinew off and give the Armature modifier back as it was"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        objects = sinew_targets(context)
        result = _for_each(self, objects, attach.remove, "Removed Sinew from")
        session.forget()
        return result


class SINEW_OT_take_over_smooth(OnSinewObjects, bpy.types.Operator):
    bl_idname = "sinew.take_over_smooth"
    bl_label = "Take Over Corrective Smooth"
    bl_description = (
        "Have Delta Mush smooth in the place of the Corrective Smooth modifier, by its settings. It stays in "
        "the stack, switched off, until Sinew is removed"
    )
    bl_options = {"REGISTER", "UNDO"}

    name: bpy.props.StringProperty(
        options={"HIDDEN", "SKIP_SAVE"}, description="Of the object; empty for all"
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        objects = [obj for obj in sinew_targets(context) if self.name in ("", obj.name)]
        with session.changing(context):
            return _for_each(self, objects, corrective_smooth.take_over, "Took over Corrective Smooth of")


class SINEW_OT_make_group(OnSinewObjects, bpy.types.Operator):
    bl_idname = "sinew.make_group"
    bl_label = "Make Vertex Group"
    bl_description = (
        "Make the vertex group that says where the stage acts, and choose it. The shape stays as it is until "
        "you paint: for a mix it has no weights, for other stages all"
    )
    bl_options = {"REGISTER", "UNDO"}

    name: bpy.props.StringProperty(options={"HIDDEN", "SKIP_SAVE"}, description="Of the object")
    stage: bpy.props.StringProperty(options={"HIDDEN", "SKIP_SAVE"}, description="Name of the stage")

    def execute(self, context: bpy.types.Context) -> set[str]:
        if self.stage not in stage_settings.STAGES:
            self.report({"ERROR"}, f"There is no stage {self.stage!r}")
            return {"CANCELLED"}
        objects = [obj for obj in sinew_targets(context) if self.name in ("", obj.name)]
        with session.changing(context):
            return _for_each(self, objects, self._make, "Made the vertex group of")

    def _make(self, obj: bpy.types.Object) -> None:
        stage, settings = stage_settings.STAGES[self.stage], getattr(properties.of(obj), self.stage)
        if obj.data.library is not None or obj.data.is_editmode:
            why = (
                "in edit mode; leave it"
                if obj.data.is_editmode
                else "linked from another file; make it local"
            )
            raise SinewError(f"{obj.name}: its mesh is {why} first")
        name = settings.group or stage.label
        group = obj.vertex_groups.get(name) if settings.group else None
        if group is None:
            group = obj.vertex_groups.new(name=name)
            if stage.name != "mix":
                group.add(range(len(obj.data.vertices)), 1.0, "REPLACE")
        settings.group = group.name


CLASSES = (
    SINEW_OT_add,
    SINEW_OT_rebind,
    SINEW_OT_remove,
    SINEW_OT_take_over_smooth,
    SINEW_OT_make_group,
)
