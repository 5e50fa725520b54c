# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws settings: a character's (character.py) or those of one mesh, which have the same names."""

import bpy
import sinew

from ..attach import corrective_smooth, normals, properties, stage_settings
from ..deform import bound, session, small_meshes
from . import operators, stepped
from .sidebar import draw_text
from .translations import tr

# Sentences about bones without a twist.
MOST_LEFT_OUT = 4


def named(layout: bpy.types.UILayout, name: str, factor: float = 0.4) -> bpy.types.UILayout:
    """Draws a name, and returns the rest of its row.

    factor  the name's share of the width; Blender's own leaves less for it
    """
    row = layout.split(factor=factor)
    row.label(text=name)
    return row.row(align=True)


def draw_method(layout: bpy.types.UILayout, settings: bpy.types.PropertyGroup, popover: str = "") -> None:
    """Without a popover, which chooses for the character, this property's own list is shown."""
    row = named(layout, "Method", factor=0.25)
    if popover:
        row.prop_with_popover(settings, "method", panel=popover, text="")
    else:
        row.prop(settings, "method", text="")


def draw_parameters(
    layout: bpy.types.UILayout, settings: bpy.types.PropertyGroup, obj: bpy.types.Object, signs: bool = False
) -> None:
    """Draws the parameters of all methods in use.

    obj    whose settings these are; for a character, its lead
    signs  only the signs, which are among the stages; else all others
    """
    for name in bound.methods_of(obj):
        for parameter in properties.METHODS[name].parameters:
            if (parameter.id == "signs") == signs:
                _draw_parameter(layout, getattr(settings, name), parameter, obj)


def draw_stages(
    layout: bpy.types.UILayout, settings: bpy.types.PropertyGroup, obj: bpy.types.Object, only: str = ""
) -> None:
    """Draws the stages, the signs, the scale rule, and who computes normals.

    only  the name of the mesh that buttons act on; empty for the character
    """
    _draw_mix(layout, settings, obj, only)
    for stage in stage_settings.STAGES.values():
        if stage.name != "mix":
            _draw_stage(layout, settings, obj, stage, only)
            if stage.name == "twist_spread" and settings.twist_spread.enabled:
                _draw_twists(layout, obj)
    _draw_take_over(layout, obj, only)
    draw_parameters(layout, settings, obj, signs=True)
    named(layout, "Scale").prop(settings, "scale_rule", text="")
    if normals.ARE_SUPPORTED:
        named(layout, "Normals").prop(settings, "normals", text="")
    if len(obj.data.vertices) < max(small_meshes.VERTICES.values()):
        layout.prop(settings, "leave_small")


def _draw_mix(
    layout: bpy.types.UILayout, settings: bpy.types.PropertyGroup, obj: bpy.types.Object, only: str
) -> None:
    mix = settings.mix
    named(layout, "Mix").prop(mix, "method", text="")
    if mix.method != properties.OFF:
        named(layout, "By").prop_search(mix, "group", obj, "vertex_groups", text="")
        if not mix.group:
            draw_text(layout, "Choose the vertex group that says where it takes over", icon="INFO")
        _draw_make_group(layout, settings, obj, "mix", only)
    if not stepped.draw_progress(layout, "sinew.auto_mix"):
        layout.operator_menu_enum("sinew.auto_mix", "over", text="Auto-Mix").name = only


def _draw_make_group(
    layout: bpy.types.UILayout,
    settings: bpy.types.PropertyGroup,
    obj: bpy.types.Object,
    stage: str,
    only: str,
) -> None:
    """Draws a button where the stage lacks the vertex group that it names, or the mix has none."""
    name = getattr(settings, stage).group
    if name in obj.vertex_groups or not (name or stage == "mix"):
        return
    text = tr("Make Vertex Group {name}", name=name) if name else "Make a Vertex Group"
    button = layout.operator("sinew.make_group", text=text, icon="GROUP_VERTEX")
    button.name, button.stage = only, stage


def _draw_stage(
    layout: bpy.types.UILayout,
    settings: bpy.types.PropertyGroup,
    obj: bpy.types.Object,
    stage: sinew.Stage,
    only: str,
) -> None:
    """Draws its switch, and its parameters while it is on."""
    group = getattr(settings, stage.name)
    switch, *others = stage.parameters
    layout.prop(group, switch.id, text=stage.label)
    if not stage_settings.is_on(settings, stage.name):
        return
    column = layout.column(align=True)
    for parameter in others:
        _draw_parameter(column, group, parameter, obj)
        if parameter.kind == "vertex_group":
            _draw_make_group(column, settings, obj, stage.name, only)


def _draw_parameter(
    layout: bpy.types.UILayout,
    group: bpy.types.PropertyGroup,
    parameter: sinew.Parameter,
    obj: bpy.types.Object,
) -> None:
    if parameter.kind == "vertex_group":
        named(layout, parameter.label).prop_search(group, parameter.id, obj, "vertex_groups", text="")
    elif parameter.kind == "enum":
        named(layout, parameter.label).prop(group, parameter.id, text="")
    else:
        layout.prop(group, parameter.id)


def _draw_twists(layout: bpy.types.UILayout, obj: bpy.types.Object) -> None:
    """Draws the bones that share a twist, with their own settings, and why others do not."""
    state, armature = session.skinned_of(obj), properties.of(obj).armature
    if state is None or armature is None:
        return
    twists = state.bound.first_deformer.bones.twists
    column = layout.column(align=True)
    if twists.bones:
        row = column.split(factor=0.45, align=True)
        for text in ("", "Amount", "Curve"):
            row.label(text=text)
    for name, tip in zip(twists.bones, twists.tips, strict=True):
        bone = armature.pose.bones.get(name)
        if bone is None:
            continue
        row = column.split(factor=0.45, align=True)
        icon = "BACK" if name == tip else "FORWARD"
        row.label(text=name, icon=icon, translate=False)
        row = row.row(align=True)
        row.prop(bone, "sinew_twist_amount", text="")
        row.prop(bone, "sinew_twist_curve", text="")
    if not twists.bones:
        draw_text(layout, "No bone was found whose twist can be spread", icon="INFO")
    for sentence in twists.left_out[:MOST_LEFT_OUT]:
        draw_text(layout, sentence, icon="INFO")


def _draw_take_over(layout: bpy.types.UILayout, obj: bpy.types.Object, only: str) -> None:
    """For the mesh, or for any of the character's."""
    meshes = [obj] if only else operators.sinew_targets(bpy.context)
    if any(operators.can_take_over(mesh) for mesh in meshes):
        layout.operator("sinew.take_over_smooth", icon="MOD_SMOOTH").name = only
        return
    for mesh in meshes:
        modifier = corrective_smooth.candidate(mesh)
        if modifier is not None and properties.of(mesh).enabled:
            draw_text(layout, corrective_smooth.why_not(mesh, modifier), icon="INFO")
