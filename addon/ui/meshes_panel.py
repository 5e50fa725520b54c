# SPDX-License-Identifier: GPL-3.0-or-later
"""The list of a character's meshes, where each can have its own settings."""

import bpy

from ..attach import properties
from ..attach.feature import Feature
from ..deform import session, survey
from . import character, operators, state_text
from .settings_layout import draw_method, draw_parameters, draw_stages, named
from .sidebar import Sidebar, characters, draw_text, shortened
from .translations import tr

MOST_ROWS = 6


class SINEW_UL_meshes(bpy.types.UIList):
    """The character's meshes among the scene's objects."""

    def filter_items(
        self, context: bpy.types.Context, data: bpy.types.Scene, name: str
    ) -> tuple[list[int], list[int]]:
        meant = {obj.name for obj in operators.targets(context)}
        shown = [self.bitflag_filter_item if obj.name in meant else 0 for obj in getattr(data, name)]
        return shown, []

    def draw_item(
        self,
        context: bpy.types.Context,
        layout: bpy.types.UILayout,
        _data: bpy.types.Scene,
        obj: bpy.types.Object,
        _icon: int,
        _active_data: bpy.types.PropertyGroup,
        _active_property: str,
    ) -> None:
        row = layout.row(align=True)
        name = shortened(obj.name, characters() // 2)
        if not properties.has_sinew(obj):
            row.label(text=name, icon="OUTLINER_OB_MESH", translate=False)
            row.operator("sinew.add", text="Add", emboss=False).name = obj.name
            return
        settings = properties.of(obj)
        split = row.split(factor=0.6)
        split.label(text=name, icon=state_text.icon_of(obj), translate=False)
        method = split.row()
        method.active = settings.enabled and settings.is_own
        method.label(text=settings.method if settings.enabled else "off")
        icon = "UNLINKED" if settings.is_own else "LINKED"
        row.operator("sinew.own_settings", text="", icon=icon, emboss=False).name = obj.name


class SINEW_PT_meshes(Sidebar, operators.OfSkinned, bpy.types.Panel):
    bl_label = "Meshes"
    bl_parent_id = "SINEW_PT_main"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout, scene = self.layout, context.scene
        layout.enabled = not operators.waits_for_render()
        meshes = operators.targets(context)
        if len(meshes) > 1:
            rows = min(len(meshes), MOST_ROWS)
            layout.template_list(
                "SINEW_UL_meshes", "", scene, "objects", character.of(scene), "row", rows=rows, maxrows=rows
            )
        obj = character.chosen(scene)
        if obj is None:
            return
        if properties.has_sinew(obj):
            _draw_details(layout, obj, is_alone=len(meshes) == 1)
        else:
            draw_text(
                layout, "{name}: without Sinew, its Armature modifier deforms it", icon="INFO", name=obj.name
            )


def _draw_details(layout: bpy.types.UILayout, obj: bpy.types.Object, is_alone: bool) -> None:
    settings = properties.of(obj)
    if not is_alone:
        row = layout.row(align=True)
        row.operator("sinew.own_settings", depress=settings.is_own).name = obj.name
        row.prop(settings, "enabled", text=state_text.switch_text([obj]), toggle=True)
        row.operator("sinew.remove", text="", icon="X").name = obj.name
        state_text.draw_mesh(layout, obj)
    column = layout.column()
    column.active = settings.enabled
    if settings.is_own and not is_alone:
        draw_method(column, settings)
        draw_parameters(column, settings, obj)
        draw_stages(column, settings, obj, only=obj.name)
    _draw_further_modifiers(column, settings)
    _draw_facts(column, obj)


def _draw_further_modifiers(layout: bpy.types.UILayout, settings: properties.SinewSettings) -> None:
    """Draws the methods of several consecutive Armature modifiers."""
    if len(settings.armatures) > 1 or any(
        s.method != properties.SAME_METHOD for s in settings.replaced_modifiers
    ):
        for replaced in list(settings.replaced_modifiers)[1:]:
            layout.prop(replaced, "method", text=replaced.name, translate=False)


def _draw_facts(layout: bpy.types.UILayout, obj: bpy.types.Object) -> None:
    armature, state = properties.of(obj).armature, session.skinned_of(obj)
    rows = [("Armature", armature.name if armature else tr("none"))]
    if state is not None:
        facts = survey.facts_of(obj, state)
        mean, weighted = f"{facts.mean_influences:.2f}", facts.weighted_bones
        rows += [
            ("Vertices", f"{facts.vertices:,}"),
            ("Bones", tr("{bones}, {weighted} with weights", bones=facts.bones, weighted=weighted)),
            ("Influences", tr("{mean} a vertex, at most {most}", mean=mean, most=facts.most_influences)),
        ]
        if not state.plan.uses_builtin:
            rows.append(("Last frame", f"{state.shown.milliseconds:.2f} ms"))
    column = layout.column(align=True)
    for name, value in rows:
        named(column, name).label(text=shortened(value), translate=False)


FEATURE = Feature((SINEW_UL_meshes, SINEW_PT_meshes))
