# SPDX-License-Identifier: GPL-3.0-or-later
"""Sentences for the panel about who deforms a mesh, and why."""

from collections.abc import Sequence

import bpy

from ..attach import attach, other_tools, properties
from ..attach.icons import Deformer
from ..deform import lifecycle, session, small_meshes, survey
from ..deform.plan import ARMATURE_MODIFIER_MODES, State
from . import operators
from .sidebar import draw_text, names_text
from .translations import tr

ICONS = {
    State.OFF: "MODIFIER_OFF",
    State.REFUSED: "ERROR",
    State.LINKED: "MOD_ARMATURE",
    State.EDITING: "MOD_ARMATURE",
    State.BUILT_IN: "MOD_ARMATURE",
    State.WAITING: "SORTTIME",
    State.IN_DEPSGRAPH: "CHECKMARK",
    State.AFTER_UPDATE: "RECOVER_LAST",
}


def reasons_of(obj: bpy.types.Object) -> list[str]:
    """Returns why it is not deformed as usual, and what deforms instead in each view; empty where it is, is
    off or has an error."""
    plan = session.plan_of(obj)
    if plan.state in (State.OFF, State.REFUSED):
        return []
    return [each for each in (plan.lacks or plan.reason, *plan.view_reasons) if each]


def sentence_of(obj: bpy.types.Object) -> str:
    """Returns who deforms the mesh, by which method, and why if not as usual."""
    plan, settings = session.plan_of(obj), properties.of(obj)
    replaced = names_text([each.name for each in settings.replaced_modifiers])
    if plan.state is State.REFUSED:
        return plan.reason
    if plan.state is State.OFF:
        text = "Off: {modifiers} deforms it"
        if not any(modifier.show_viewport for modifier, _replaced in attach.replaced_modifiers(obj)):
            text = "Off, and so is {modifiers} in the viewport"
        return tr(text, modifiers=replaced)
    method = tr(properties.method_label(settings.method))
    # What is switched off in one view may wait until the other is evaluated.
    is_waiting = plan.state is State.WAITING and not plan.view_reasons
    if plan.uses_builtin or plan.lacks or is_waiting:
        until = tr("{modifiers} deforms it until the next frame", modifiers=replaced)
        return ". ".join((method, *map(tr, reasons_of(obj) or (until,))))
    text = tr("{method} in the place of {modifiers}", method=method, modifiers=replaced)
    if plan.reason:
        text = tr("{text}, after Blender's evaluation: {reason}", text=text, reason=tr(plan.reason))
    return ". ".join((text, *map(tr, plan.view_reasons)))


def switch_text(objects: Sequence[bpy.types.Object]) -> str:
    """Returns what the switch of these meshes shows."""
    plans = [session.plan_of(obj) for obj in objects if properties.of(obj).enabled]
    on = [plan for plan in plans if plan.state is not State.REFUSED]
    if not on:
        return "On, but not possible" if plans else "Off"
    if {view for plan in on for view in (plan.viewport, plan.render)} == {Deformer.SINEW}:
        return "On"
    return "On, hidden" if {plan.viewport for plan in on} == {Deformer.NOTHING} else "On, in part"


def icon_of(obj: bpy.types.Object) -> str:
    plan = session.plan_of(obj)
    if plan.state is not State.OFF and problems_of(obj):
        return ICONS[State.REFUSED]
    if plan.is_read and plan.viewport is Deformer.NOTHING:
        return "HIDE_ON"
    if plan.is_read and plan.viewport is Deformer.ARMATURE:
        return ICONS[State.BUILT_IN]
    return ICONS[State.WAITING if plan.lacks else plan.state]


def problems_of(obj: bpy.types.Object) -> list[str]:
    """Returns what the artist should fix, apart from what prevents Sinew."""
    settings, state, failed = properties.of(obj), session.skinned_of(obj), lifecycle.failure_of_saving(obj)
    found = [failed] if failed else []
    if state is None:
        return found
    found += state.bound.lacks((settings.method, settings.mix.method))
    if state.failures.count:
        found.append(
            tr(
                "{count} times not deformed within Blender's evaluation; last: {failure}",
                count=state.failures.count,
                failure=tr(state.failures.last),
            )
        )
    found += survey.facts_of(obj, state).warnings
    # Such a modifier may have been added since.
    return [*found, *(sentence for sentence in other_tools.warnings(obj) if sentence not in found)]


def draw_in_mode(layout: bpy.types.UILayout, obj: bpy.types.Object) -> None:
    """For modes whose tools work through the Armature modifier: draws whether its shape is Sinew's, and the
    switch that makes it so if the artist has changed it."""
    if session.plan_of(obj).state is not State.EDITING or obj.mode not in ARMATURE_MODIFIER_MODES:
        return
    sentence, modifiers = shape_in_mode(obj)
    draw_text(layout, sentence, icon="INFO")
    for modifier in modifiers:
        row = layout.row()
        row.prop(modifier, "use_deform_preserve_volume")
        if len(modifiers) > 1:
            row.label(text=modifier.name, translate=False)


def shape_in_mode(obj: bpy.types.Object) -> tuple[str, list[bpy.types.ArmatureModifier]]:
    """Returns what the Armature modifiers show in such a mode, and those whose Preserve Volume has to be
    switched for Sinew's shape."""
    method = tr(properties.method_label(properties.of(obj).method))
    if not small_meshes.has_builtin_shape(obj):
        return tr(
            "It has no {method} with these settings: what you see here is another shape", method=method
        ), []
    others = small_meshes.other_volume(obj)
    if others:
        return tr("Switch Preserve Volume to see {method} here, too", method=method), others
    if attach.has_switched_volume(obj):
        return tr(
            "The shape is the same: {method}. Preserve Volume is switched for it meanwhile", method=method
        ), []
    return tr("The shape is the same: {method}", method=method), []


def draw_mesh(layout: bpy.types.UILayout, obj: bpy.types.Object) -> None:
    """Draws everything about one mesh."""
    plan = session.plan_of(obj)
    if plan.state is State.REFUSED:
        draw_text(layout, plan.reason, icon="ERROR", alert=True)
    for sentence in (*reasons_of(obj), *attach.notes(obj), *other_tools.notes(obj)):
        draw_text(layout, sentence, icon="INFO")
    draw_in_mode(layout, obj)
    if plan.normals_reason:
        draw_text(layout, "Blender computes normals: {reason}", icon="INFO", reason=tr(plan.normals_reason))
    for sentence in problems_of(obj):
        draw_text(layout, sentence, icon="ERROR")


def draw_character(
    layout: bpy.types.UILayout, context: bpy.types.Context, meshes: list[bpy.types.Object]
) -> None:
    """Draws everything for one mesh; for several their errors, and which of them have more to read in the
    list."""
    if len(meshes) == 1:
        draw_mesh(layout, meshes[0])
        return
    plans = {obj: session.plan_of(obj) for obj in meshes}
    for plan in plans.values():
        if plan.state is State.REFUSED:
            draw_text(layout, plan.reason, icon="ERROR", alert=True)
    by_reason: dict[str, list[str]] = {}
    for obj, plan in plans.items():
        is_off = plan.state in (State.OFF, State.REFUSED)
        views = reasons_of(obj) if plan.uses_builtin else plan.view_reasons
        for reason in (*(() if is_off else views), *attach.notes(obj), *other_tools.notes(obj)):
            by_reason.setdefault(reason, []).append(obj.name)
    for reason, names in by_reason.items():
        who = names_text(names, most=2)
        if len(names) == len(meshes):
            who = tr("All {count} meshes", count=len(meshes))
        draw_text(layout, f"{who}: {tr(reason)}", icon="INFO")
    active = operators.active_object(context)
    if active in meshes:
        draw_in_mode(layout, active)
    warned = [obj.name for obj in meshes if problems_of(obj)]
    if warned:
        draw_text(layout, "{names}: warnings, see Meshes", icon="ERROR", names=names_text(warned))
