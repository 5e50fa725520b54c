# SPDX-License-Identifier: GPL-3.0-or-later
"""Variants: a panel with those of the character, and what one does with them, each one undo step."""

from dataclasses import replace

import bpy

from ...attach import properties, variant_settings
from ...attach.feature import Feature
from ...base.errors import SinewError, WrongUse
from ...deform import session
from ...skinning.parameters import PRESETS
from ...skinning.variants import FILE, Variant, named, parse
from ...ui import character, operators, stepped
from ...ui.operators import OnSinewObjects
from ...ui.sidebar import Sidebar
from ...ui.translations import tr
from . import choices, keys, stored

ACTIONS = (
    ("RENAME", "Rename\u2026", "Give it a name of its own", "NONE", 0),
    ("UPDATE", "Set to What Is Set Now", "Replace it by the method and stages of the character", "NONE", 1),
    ("DUPLICATE", "Duplicate", "Add a copy behind it", "DUPLICATE", 2),
    ("UP", "Move Up", "Move it before the one above", "TRIA_UP", 3),
    ("DOWN", "Move Down", "Move it behind the one below", "TRIA_DOWN", 4),
    ("DELETE", "Delete", "Take it off the list; the character stays as it is", "X", 5),
)


class SINEW_OT_add_variant(OnSinewObjects, bpy.types.Operator):
    bl_label = "Add Variant"
    bl_description = (
        "Keep what is set now with the character: method, stages with their settings, scale and normals"
    )

    name: bpy.props.StringProperty(name="Name", description="Empty: it is called by what it is")

    def run(self, context: bpy.types.Context) -> None:
        variant = named(_current(context), self.name)
        stored.write(context, [*stored.lines(context), variant.key])


class SINEW_OT_use_variant(OnSinewObjects, bpy.types.Operator):
    bl_label = "Use Variant"
    bl_description = "Deform the character so"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    variant: bpy.props.StringProperty(
        name="Variant", description="Its text, as `sinew methods` explains", options={"SKIP_SAVE"}
    )

    @classmethod
    def description(cls, _context: bpy.types.Context, values: bpy.types.OperatorProperties) -> str:
        variant = stored.read(values.variant)
        return cls.bl_description if variant is None else tr(variant.label)

    def run(self, context: bpy.types.Context) -> set[str] | None:
        variant = parse(self.variant)
        if variant.method == FILE:
            raise SinewError("The character is as in the file already")
        if variant.method in PRESETS:
            return self._use_preset(context)
        with session.changing(context):
            variant_settings.use(character.followers(context), variant)
        return None

    @staticmethod
    def _use_preset(context: bpy.types.Context) -> set[str]:
        off = [obj for obj in character.followers(context) if not properties.of(obj).enabled]
        with session.changing(context):
            for obj in off:
                properties.of(obj).enabled = True
        done = bpy.ops.sinew.recommend("INVOKE_DEFAULT")
        # In a window it goes on, as an undo step of its own.
        return {"CANCELLED"} if "RUNNING_MODAL" in done and not off else {"FINISHED"}


class SINEW_OT_edit_variant(OnSinewObjects, bpy.types.Operator):
    bl_label = "Edit Variant"
    bl_description = "Rename, change, duplicate, move or delete it"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    number: bpy.props.IntProperty(options={"HIDDEN", "SKIP_SAVE"})
    action: bpy.props.EnumProperty(name="Action", description="What to do with it", items=ACTIONS)
    name: bpy.props.StringProperty(
        name="Name", description="Empty: it is called by what it is", options={"SKIP_SAVE"}
    )

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        if self.action != "RENAME":
            return self.execute(context)
        variant = stored.read(self._text(context))
        self.name = variant.name if variant is not None else ""
        return context.window_manager.invoke_props_dialog(self)

    def draw(self, _context: bpy.types.Context) -> None:
        self.layout.prop(self, "name")

    def run(self, context: bpy.types.Context) -> None:
        texts, number = stored.lines(context), self.number
        text = self._text(context)
        if self.action == "RENAME":
            texts[number] = named(parse(text), self.name).key
        elif self.action == "UPDATE":
            old = stored.read(text)
            texts[number] = replace(_current(context), name=old.name if old is not None else "").key
        elif self.action == "DUPLICATE":
            texts.insert(number + 1, text)
        elif self.action == "DELETE":
            del texts[number]
        else:
            other = number + (1 if self.action == "DOWN" else -1)
            if not 0 <= other < len(texts):
                raise SinewError("It is at the end of the list already")
            texts[number], texts[other] = texts[other], text
        stored.write(context, texts)

    def _text(self, context: bpy.types.Context) -> str:
        texts = stored.lines(context)
        if not 0 <= self.number < len(texts):
            raise SinewError("There is no such variant")
        return texts[self.number]


class SINEW_PT_variants(Sidebar, operators.OfSkinned, bpy.types.Panel):
    bl_label = "Variants"

    def draw(self, context: bpy.types.Context) -> None:
        layout, lead = self.layout, character.lead(context)
        if lead is None:
            return
        current, column = variant_settings.read(lead), layout.column(align=True)
        for variant in choices.ALWAYS:
            choices.draw_use(column, variant, current)
        for number, text in enumerate(stored.lines(context)):
            row, variant = column.row(align=True), stored.read(text)
            if variant is None:
                row.label(text=tr("Of a newer Sinew: {text}", text=text), icon="ERROR", translate=False)
            else:
                choices.draw_use(row, variant, current)
            row.operator_menu_enum(
                "sinew.edit_variant", "action", text="", icon="DOWNARROW_HLT"
            ).number = number
        stepped.draw_progress(layout, "sinew.recommend")
        layout.operator("sinew.add_variant", text="Add What Is Set Now", icon="ADD")
        row = layout.row(align=True)
        row.operator("sinew.contact_sheet", icon="IMGDISPLAY")
        row.operator("sinew.save_contact_sheet", text="", icon="EXPORT")
        row.operator("sinew.variant_keys", icon="LINENUMBERS_ON")
        stepped.draw_progress(layout, "sinew.save_contact_sheet")


def _current(context: bpy.types.Context) -> Variant:
    lead = character.lead(context)
    if lead is None:
        raise WrongUse("Select a mesh that Sinew deforms, or its armature")
    return variant_settings.read(lead)


FEATURE = Feature(
    (
        *(SINEW_OT_add_variant, SINEW_OT_use_variant, SINEW_OT_edit_variant, keys.SINEW_OT_variant_keys),
        *(SINEW_PT_variants, keys.SINEW_MT_variants_pie),
    ),
    end=keys.forget,
)
