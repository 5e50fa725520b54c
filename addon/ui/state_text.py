# SPDX-License-Identifier: GPL-3.0-or-later
"""Sentences for the panel about who deforms a mesh, and why."""

from __future__ import annotations

from collections.abc import Sequence

import bpy

from ..attach import attach, behind_nodes, properties
from ..core.icons import RENDER, VIEWPORT, Deformer
from ..deform import apply_plan, session, small_meshes
from ..deform.plan import ARMATURE_MODIFIER_MODES, State
from .sidebar import draw_text, names_text
from .translations import tr

ICONS = {
    State.OFF: "MODIFIER_OFF",
    State.BUILT_IN: "MOD_ARMATURE",
    State.ASIDE: "HIDE_ON",
    State.WAITING: "SORTTIME",
    State.IN_DEPSGRAPH: "CHECKMARK",
    State.AFTER_UPDATE: "RECOVER_LAST",
}


def reasons_of(obj: bpy.types.Object) -> list[str]:
    """Returns why it is not deformed as usual, and what deforms instead in each view; empty where it is, or
    is off."""
    if not properties.of(obj).enabled:
        return []
    state, views = session.state_of(obj), apply_plan.plan_of_icons(obj)
    reason = views.reason or (state.plan.reason if state is not None else "")
    return [each for each in (reason, *views.view_reasons) if each]


def sentence_of(obj: bpy.types.Object) -> str:
    """Returns who deforms the mesh, by which method, and why if not as usual."""
    settings, state = properties.of(obj), session.state_of(obj)
    replaced = names_text([each.name for each in settings.replaced_modifiers])
    if settings.error:
        return settings.error
    if not settings.enabled:
        text = "Off: {modifiers} deforms it"
        if not any(modifier.show_viewport for modifier, _replaced in attach.replaced_modifiers(obj)):
            text = "Off, and so is {modifiers} in the viewport"
        return tr(text, modifiers=replaced)
    method = tr(properties.method_label(settings.method))
    views = ". ".join(map(tr, apply_plan.plan_of_icons(obj).view_reasons))
    if state is None or uses_builtin(obj) or state.plan.state is State.WAITING:
        until = tr("{modifiers} deforms it until the next frame", modifiers=replaced)
        return ". ".join((method, *map(tr, reasons_of(obj) or (until,))))
    text = tr("{method} in the place of {modifiers}", method=method, modifiers=replaced)
    if state.plan.reason:
        reason = tr(state.plan.reason)
        text = tr("{text}, after Blender's evaluation: {reason}", text=text, reason=reason)
    return f"{text}. {views}" if views else text


def switch_text(objects: Sequence[bpy.types.Object]) -> str:
    """Returns what the switch of these meshes shows."""
    on = [obj for obj in objects if properties.of(obj).enabled]
    if not on:
        return "Off"
    views = {attach.deformer(obj, name) for obj in on for name in (VIEWPORT, RENDER)}
    if views == {Deformer.SINEW}:
        return "On"
    shown = {attach.deformer(obj, VIEWPORT) for obj in on}
    return "On, hidden" if shown == {Deformer.NOTHING} else "On, in part"


def icon_of(obj: bpy.types.Object) -> str:
    settings, state = properties.of(obj), session.state_of(obj)
    if settings.error or (settings.enabled and problems_of(obj)):
        return "ERROR"
    if not settings.enabled or state is None:
        return ICONS[State.OFF]
    if attach.deformer(obj, VIEWPORT) is Deformer.NOTHING:
        return ICONS[State.ASIDE]
    is_built_in = uses_builtin(obj) or attach.deformer(obj, VIEWPORT) is Deformer.ARMATURE
    return ICONS[State.BUILT_IN if is_built_in else state.plan.state]


def problems_of(obj: bpy.types.Object) -> list[str]:
    """Returns what the artist should fix, apart from an error that switched it off."""
    settings, state = properties.of(obj), session.state_of(obj)
    if state is None:
        return []
    found = list(state.bound.lacks((settings.method, settings.mix.method)))
    if state.evaluation.failures:
        found.append(
            tr(
                "{count} times not deformed within Blender's evaluation; last: {failure}",
                count=state.evaluation.failures,
                failure=tr(state.evaluation.failure),
            )
        )
    found += state.bound.facts.warnings
    # Such a modifier may have been added since.
    return [*found, *(sentence for sentence in behind_nodes.warnings(obj) if sentence not in found)]


def draw_in_mode(layout: bpy.types.UILayout, context: bpy.types.Context, obj: bpy.types.Object) -> None:
    """For modes whose tools work through the Armature modifier: draws whether its shape is Sinew's, and the
    switch that makes it so if the artist has changed it."""
    if obj.mode not in ARMATURE_MODIFIER_MODES or not properties.of(obj).enabled or obj.library is not None:
        return
    sentence, modifiers = shape_in_mode(obj)
    draw_text(layout, context, sentence, icon="INFO")
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


def draw_mesh(layout: bpy.types.UILayout, context: bpy.types.Context, obj: bpy.types.Object) -> None:
    """Draws everything about one mesh."""
    if properties.of(obj).error:
        draw_text(layout, context, properties.of(obj).error, icon="ERROR", alert=True)
    for sentence in (*reasons_of(obj), *attach.notes(obj)):
        draw_text(layout, context, sentence, icon="INFO")
    draw_in_mode(layout, context, obj)
    state = session.state_of(obj)
    if state is not None and state.plan.normals_reason:
        text = tr("Blender computes normals: {reason}", reason=tr(state.plan.normals_reason))
        draw_text(layout, context, text, icon="INFO")
    for sentence in problems_of(obj):
        draw_text(layout, context, sentence, icon="ERROR")


def draw_character(
    layout: bpy.types.UILayout, context: bpy.types.Context, meshes: list[bpy.types.Object]
) -> None:
    """Draws everything for one mesh; for several their errors, and which of them have more to read in the
    list."""
    if len(meshes) == 1:
        draw_mesh(layout, context, meshes[0])
        return
    for obj in meshes:
        if properties.of(obj).error:
            draw_text(layout, context, properties.of(obj).error, icon="ERROR", alert=True)
    by_reason: dict[str, list[str]] = {}
    for obj in meshes:
        views = apply_plan.plan_of_icons(obj).view_reasons if properties.of(obj).enabled else []
        for reason in (*(reasons_of(obj) if uses_builtin(obj) else views), *attach.notes(obj)):
            by_reason.setdefault(reason, []).append(obj.name)
    for reason, names in by_reason.items():
        who = names_text(names, most=2)
        if len(names) == len(meshes):
            who = tr("All {count} meshes", count=len(meshes))
        draw_text(layout, context, f"{who}: {tr(reason)}", icon="INFO")
    if context.active_object in meshes:
        draw_in_mode(layout, context, context.active_object)
    warned = [obj.name for obj in meshes if not properties.of(obj).error and problems_of(obj)]
    if warned:
        text = tr("{names}: warnings, see Meshes", names=names_text(warned))
        draw_text(layout, context, text, icon="ERROR")


def uses_builtin(obj: bpy.types.Object) -> bool:
    """Whether its Armature modifiers deform it, though Sinew is on."""
    settings, state = properties.of(obj), session.state_of(obj)
    if not settings.enabled or state is None:
        return False
    return obj.mode in ARMATURE_MODIFIER_MODES or state.plan.state in (State.BUILT_IN, State.ASIDE)
