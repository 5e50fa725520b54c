# SPDX-License-Identifier: GPL-3.0-or-later
"""The sidebar tab "Sinew" of the 3D view."""

from __future__ import annotations

import bpy
import sinew

from ..attach import attach, corrective_smooth, normals, properties, stage_settings
from ..deform import method_needs, session, small_meshes
from ..deform.plan import ObjectFacts, plan
from . import operators, precomputing
from .sidebar import Sidebar, draw_text


class SINEW_PT_main(Sidebar, bpy.types.Panel):
    bl_label = "Sinew"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        meshes = operators.targets(context)
        for other in attach.not_meshes(context.selected_objects):
            text = f"{other.name} stays with its Armature modifier: Sinew deforms meshes only"
            draw_text(layout, context, text, icon="INFO")
        if not meshes:
            draw_text(layout, context, "Select a mesh that an armature deforms, or the armature", icon="INFO")
            return
        skinned = [obj for obj in meshes if properties.has_sinew(obj)]
        if len(skinned) < len(meshes):
            count = len(meshes) - len(skinned)
            label = "Add Sinew" if count == 1 else f"Add Sinew to {count} Meshes"
            layout.operator("sinew.add", text=label, icon="MOD_ARMATURE")
        waits = operators.waits_for_render()
        if waits:
            draw_text(layout, context, f"{waits}: until then nothing can be changed", icon="INFO")
            layout = layout.column()
            layout.enabled = False
        for obj in skinned:
            box = layout.box()
            _draw_settings(box, context, obj)
            _draw_facts(box, context, obj)
        if skinned:
            row = layout.row(align=True)
            row.operator("sinew.rebind", icon="FILE_REFRESH")
            row.operator("sinew.remove", icon="X")
            layout.operator("sinew.bake", text="Bake…", icon="RENDER_ANIMATION")
            if not context.scene.render.use_lock_interface:
                draw_text(
                    layout, context, "Before rendering in this window, lock the interface:", icon="INFO"
                )
                layout.prop(context.scene.render, "use_lock_interface")


def _draw_settings(layout: bpy.types.UILayout, context: bpy.types.Context, obj: bpy.types.Object) -> None:
    settings = properties.of(obj)
    _draw_state(layout, context, obj)
    _draw_method(layout, context, obj)
    _draw_mix(layout, context, obj)
    state = session.state_of(obj)
    for sentence in [] if state is None else state.bound.lacks((settings.method, settings.mix.method)):
        draw_text(layout, context, sentence, icon="INFO")
    for stage in stage_settings.STAGES.values():
        if stage.name != "mix":
            _draw_stage(layout, context, obj, stage)
    _draw_take_over(layout, context, obj)
    layout.prop(settings, "scale_rule")
    _draw_normals(layout, context, obj)
    if len(obj.data.vertices) < max(small_meshes.VERTICES.values()):
        layout.prop(settings, "leave_small")


def _draw_normals(layout: bpy.types.UILayout, context: bpy.types.Context, obj: bpy.types.Object) -> None:
    if not normals.ARE_SUPPORTED:
        return
    layout.prop(properties.of(obj), "normals")
    state = session.state_of(obj)
    if state is not None and state.plan.normals_reason:
        draw_text(layout, context, f"Blender computes normals: {state.plan.normals_reason}", icon="INFO")


def _draw_state(layout: bpy.types.UILayout, context: bpy.types.Context, obj: bpy.types.Object) -> None:
    """On or off, and who deforms the object for what reason."""
    settings, state = properties.of(obj), session.state_of(obj)
    row = layout.row(align=True)
    row.label(text=obj.name, icon="OUTLINER_OB_MESH")
    row.prop(settings, "enabled", text="On" if settings.enabled else "Off", toggle=True)
    if settings.error:
        draw_text(layout, context, settings.error, icon="ERROR", alert=True)
    elif settings.enabled:
        facts = ObjectFacts(is_linked=obj.library is not None, mode=obj.mode)
        reason = plan(facts).reason or (state.plan.reason if state is not None else "")
        if reason:
            draw_text(layout, context, reason, icon="INFO")
        precomputing.draw(layout, obj, state)
    if state is not None and state.evaluation.failures:
        text = (
            f"{state.evaluation.failures} times not deformed within Blender's evaluation; last: "
            f"{state.evaluation.failure}"
        )
        draw_text(layout, context, text, icon="ERROR")


def _draw_method(layout: bpy.types.UILayout, context: bpy.types.Context, obj: bpy.types.Object) -> None:
    """Of the object, and of its further Armature modifiers; then the methods' parameters."""
    settings = properties.of(obj)
    layout.prop(settings, "method", text="")
    draw_text(layout, context, properties.METHODS[settings.method].description)
    if len(settings.armatures) > 1 or any(
        s.method != properties.SAME_METHOD for s in settings.replaced_modifiers
    ):
        for replaced in list(settings.replaced_modifiers)[1:]:
            layout.prop(replaced, "method", text=replaced.name)
    for name in method_needs.methods_of(obj):
        for parameter in properties.METHODS[name].parameters:
            layout.prop(getattr(settings, name), parameter.id)


def _draw_mix(layout: bpy.types.UILayout, context: bpy.types.Context, obj: bpy.types.Object) -> None:
    mix = properties.of(obj).mix
    layout.prop(mix, "method", text="Mix")
    if mix.method == properties.OFF:
        return
    layout.prop_search(mix, "group", obj, "vertex_groups", text="By")
    if not mix.group:
        draw_text(layout, context, "Choose the vertex group that says where it takes over", icon="INFO")
    _draw_make_group(layout, obj, "mix")


def _draw_make_group(layout: bpy.types.UILayout, obj: bpy.types.Object, stage: str) -> None:
    """A button where the stage lacks the vertex group that it names, or the mix any."""
    name = getattr(properties.of(obj), stage).group
    if name in obj.vertex_groups or not (name or stage == "mix"):
        return
    text = f"Make Vertex Group {name}" if name else "Make a Vertex Group"
    button = layout.operator("sinew.make_group", text=text, icon="GROUP_VERTEX")
    button.name, button.stage = obj.name, stage


def _draw_stage(
    layout: bpy.types.UILayout, context: bpy.types.Context, obj: bpy.types.Object, stage: sinew.Stage
) -> None:
    """Its switch, and while it is on its parameters."""
    group = getattr(properties.of(obj), stage.name)
    switch, *others = stage.parameters
    layout.prop(group, switch.id, text=stage.label)
    if not stage_settings.is_on(group, stage):
        return
    column = layout.column(align=True)
    for parameter in others:
        if parameter.kind == "vertex_group":
            column.prop_search(group, parameter.id, obj, "vertex_groups")
            _draw_make_group(column, obj, stage.name)
        else:
            column.prop(group, parameter.id)


def _draw_take_over(layout: bpy.types.UILayout, context: bpy.types.Context, obj: bpy.types.Object) -> None:
    modifier = corrective_smooth.candidate(obj)
    if modifier is None or not properties.of(obj).enabled:
        return
    reason = corrective_smooth.why_not(obj, modifier)
    if reason:
        draw_text(layout, context, reason, icon="INFO")
    else:
        layout.operator("sinew.take_over_smooth", icon="MOD_SMOOTH").name = obj.name


def _draw_facts(layout: bpy.types.UILayout, context: bpy.types.Context, obj: bpy.types.Object) -> None:
    armature = properties.of(obj).armature
    state = session.state_of(obj)
    rows = [("Armature", armature.name if armature else "none")]
    if state is not None:
        facts = state.bound.facts
        rows += [
            ("Vertices", f"{facts.vertices:,}"),
            ("Bones", f"{facts.bones}, {facts.weighted_bones} with weights"),
            ("Influences", f"{facts.mean_influences:.2f} a vertex, at most {facts.most_influences}"),
        ]
        if not state.uses_builtin:
            rows.append(("Last frame", f"{state.shown.milliseconds:.2f} ms"))
    column = layout.column(align=True)
    for name, value in rows:
        split = column.split(factor=0.4)
        split.label(text=name)
        split.label(text=value)
    if state is not None:
        for warning in state.bound.facts.warnings:
            draw_text(layout, context, warning, icon="ERROR")


CLASSES = (SINEW_PT_main,)
