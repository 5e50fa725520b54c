# SPDX-License-Identifier: GPL-3.0-or-later
"""The buttons of a comparison: poll, gather, one call, report."""

from __future__ import annotations

import bpy
import numpy as np

from ...attach import attach, properties
from ...core.comparison import USUAL_METHODS
from ...core.errors import SinewError
from ...deform import characters
from ...ui import operators
from ...ui.translations import tr
from . import comparison, comparison_state, framing


def character(context: bpy.types.Context) -> list[bpy.types.Object]:
    """Returns the visible meshes that the selected armatures deform, and those parented to their bones:
    clothes and eyes belong to the selected body. Empty where nothing is deformed."""
    armatures, viewport = operators.armatures(context), _viewport(context)
    visible = [
        obj
        for obj in context.scene.objects
        if obj.type == "MESH" and not properties.is_copy(obj) and obj.visible_get(viewport=viewport)
    ]
    deformed = [obj for obj in attach.deformed_meshes(visible) if attach.armature_of(obj) in armatures]
    attached = [obj for obj in visible if attach.armature_of(obj) is None and _hangs_on(obj, armatures)]
    return [*deformed, *attached] if deformed else []


def _hangs_on(obj: bpy.types.Object, armatures: list[bpy.types.Object]) -> bool:
    parent = obj.parent
    while parent is not None and parent not in armatures:
        parent = parent.parent
    return parent is not None


def _viewport(context: bpy.types.Context) -> bpy.types.SpaceView3D | None:
    space = context.space_data
    return space if space is not None and space.type == "VIEW_3D" else None


def _compared(context: bpy.types.Context) -> list[bpy.types.Object]:
    state = comparison_state.of_scene(context.scene)
    return comparison.originals(state) if state is not None else []


class SinewComparisonChoice(bpy.types.PropertyGroup):
    """A method in the dialog, called `name`."""

    is_shown: bpy.props.BoolProperty(
        name="Show", description="Show a copy of the character under this method"
    )


METHOD_ITEMS = [
    *((m.name, m.label, m.description) for m in properties.METHODS.values()),
    (
        characters.BLENDER,
        properties.method_label(characters.BLENDER),
        "As it stands in the stack, without Sinew",
    ),
]


class SINEW_OT_compare(bpy.types.Operator):
    bl_idname = "sinew.compare"
    bl_label = "Compare"
    bl_description = (
        "Show live copies of the character beside it, one for each method, until End Comparison takes them "
        "away; renders leave them out"
    )
    bl_options = {"REGISTER", "UNDO"}

    methods: bpy.props.EnumProperty(
        name="Methods",
        description="Show a copy of the character under each of these",
        items=METHOD_ITEMS,
        options={"ENUM_FLAG"},
        default=set(USUAL_METHODS),
    )
    # Clicking an enum flag would clear all others.
    choices: bpy.props.CollectionProperty(
        type=SinewComparisonChoice,
        name="Choices",
        description="The same as check boxes, in the dialog",
        options={"SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if context.mode.startswith("EDIT"):
            cls.poll_message_set(tr("Leave edit mode first"))
            return False
        if operators.armatures(context) or _compared(context):
            return operators.can_change(cls)
        cls.poll_message_set(tr("Select a mesh that an armature deforms, or the armature"))
        return False

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        state = comparison_state.of_scene(context.scene)
        if state is not None and comparison_state.methods_of(state):
            self.methods = set(comparison_state.methods_of(state))
        self.choices.clear()
        for name, _label, _description in METHOD_ITEMS:
            choice = self.choices.add()
            choice.name, choice.is_shown = name, name in self.methods
        return context.window_manager.invoke_props_dialog(self)

    def draw(self, context: bpy.types.Context) -> None:
        column = self.layout.column(align=True)
        column.label(text="Show a copy under each of these")
        for choice in self.choices:
            column.prop(choice, "is_shown", text=properties.method_label(choice.name))

    def execute(self, context: bpy.types.Context) -> set[str]:
        if self.choices:
            self.methods = {choice.name for choice in self.choices if choice.is_shown}
        methods = [name for name in characters.method_names() if name in self.methods]
        meshes = character(context) or _compared(context)
        try:
            if not methods:
                raise SinewError("Choose at least one method to compare")
            if not meshes:
                raise SinewError("The armature deforms no mesh that is visible; show one first")
            problems = comparison.start(context, meshes, methods, _right_of_view(context))
        except SinewError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        viewport = _viewport(context)
        if viewport is not None and viewport.local_view is not None:
            for copy in comparison_state.copies_of(comparison_state.of_scene(context.scene)):
                copy.local_view_set(viewport, True)
        if viewport is not None:
            framing.show_all(context, viewport, meshes)
        for problem in problems:
            self.report({"WARNING"}, problem)
        return {"FINISHED"}


def _right_of_view(context: bpy.types.Context) -> np.ndarray:
    """[3], the direction of the screen's right in the world; +X where there is no 3D view."""
    viewport = _viewport(context)
    if viewport is None or viewport.region_3d is None:
        return np.array([1.0, 0.0, 0.0])
    # Also if the button is in the sidebar, a region without its own view.
    return np.array(viewport.region_3d.view_matrix)[0, :3]


class _WhileComparing:
    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if comparison_state.of_scene(context.scene) is not None:
            return True
        cls.poll_message_set("Compare methods first")
        return False


class SINEW_OT_flip_comparison(_WhileComparing, bpy.types.Operator):
    bl_idname = "sinew.flip_comparison"
    bl_label = "Flip Comparison"
    bl_description = "Show the other of the two copies that are compared, at the same place"
    # Only a view of the comparison: an undo step for each flip would push out the artist's own steps, and
    # take longer than the flip.
    bl_options = {"REGISTER"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        state = comparison_state.of_scene(context.scene)
        if state.arrangement != comparison_state.ONE_OF_TWO:
            state.arrangement = comparison_state.ONE_OF_TWO
        else:
            state.shows_second = not state.shows_second
        (shown,) = comparison_state.shown_methods(state)
        self.report({"INFO"}, properties.method_label(shown))
        return {"FINISHED"}


class SINEW_OT_end_comparison(bpy.types.Operator):
    bl_idname = "sinew.end_comparison"
    bl_label = "End Comparison"
    bl_description = "Take the copies away, and all that was made for them"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if comparison.is_on():
            return operators.can_change(cls)
        cls.poll_message_set("There is no comparison")
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        comparison.end(context)
        return {"FINISHED"}


CLASSES = (SinewComparisonChoice, SINEW_OT_compare, SINEW_OT_flip_comparison, SINEW_OT_end_comparison)
