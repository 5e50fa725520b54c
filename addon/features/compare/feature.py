# SPDX-License-Identifier: GPL-3.0-or-later
"""Comparisons: a panel and its buttons, what a scene stores, labels in the 3D views."""

from collections.abc import Generator
from dataclasses import dataclass

import bpy
import numpy as np

from ...attach import attach, properties, references
from ...attach.feature import Feature
from ...attach.subscribers import subscribers
from ...attach.updates import may_change_file, updates_suspended
from ...base.errors import SinewError
from ...deform import characters
from ...skinning.variants import is_key, parse_list
from ...ui import operators, stepped
from ...ui.sidebar import Sidebar, draw_text
from ..pages import viewer
from ..pages.save import SavesPage
from ..variants import stored
from . import comparison, comparison_labels, comparison_state, framing


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
    attached = [obj for obj in visible if attach.armature_of(obj) is None and attach.hangs_on(obj, armatures)]
    return [*deformed, *attached] if deformed else []


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


class SINEW_OT_compare(operators.Acting, bpy.types.Operator):
    bl_label = "Compare"
    bl_description = (
        "Show live copies of the character beside it, one for each method, until End Comparison takes them "
        "away; renders leave them out"
    )

    methods: bpy.props.EnumProperty(
        name="Methods",
        description="Show a copy of the character under each of these",
        items=METHOD_ITEMS,
        options={"ENUM_FLAG"},
        default={"lbs", "dq", "cor"},
    )
    variants: bpy.props.StringProperty(
        name="Variants",
        description="Also a copy under each of these, divided by commas, as `sinew methods` explains",
    )
    # Clicking an enum flag would clear all others.
    choices: bpy.props.CollectionProperty(
        type=SinewComparisonChoice,
        name="Choices",
        description="The same as check boxes, in the dialog",
        options={"SKIP_SAVE"},
    )

    @classmethod
    def refusal(cls, context: bpy.types.Context) -> str:
        if context.mode.startswith("EDIT"):
            return "Leave edit mode first"
        is_any = operators.armatures(context) or _compared(context)
        return "" if is_any else "Select a mesh that an armature deforms, or the armature"

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        state = comparison_state.of_scene(context.scene)
        compared = comparison_state.methods_of(state) if state is not None else []
        if compared:
            self.methods = {name for name in compared if not is_key(name)}
        else:
            shown = {comparison.method_shown(obj) for obj in attach.deformed_meshes(character(context))}
            if len(shown) == 1:
                # Its copy would be the original once more.
                self.methods -= shown
        self.choices.clear()
        variants = [each.key for each in stored.of_methods(context)]
        for name in (*(item[0] for item in METHOD_ITEMS), *dict.fromkeys(variants)):
            choice = self.choices.add()
            choice.name, choice.is_shown = name, name in self.methods or name in compared
        return context.window_manager.invoke_props_dialog(self)

    def draw(self, _context: bpy.types.Context) -> None:
        column = self.layout.column(align=True)
        column.label(text="Show a copy under each of these")
        for choice in self.choices:
            column.prop(choice, "is_shown", text=comparison_state.label_of(choice.name), translate=False)

    def run(self, context: bpy.types.Context) -> None:
        if self.choices:
            chosen = [choice.name for choice in self.choices if choice.is_shown]
            self.methods = {name for name in chosen if not is_key(name)}
            self.variants = ",".join(filter(is_key, chosen))
        methods = [name for name in characters.method_names() if name in self.methods]
        for variant in parse_list(self.variants) if self.variants.strip() else ():
            if variant.method not in properties.METHODS:
                raise SinewError(f"{variant.method} can not be shown as a variant beside the character")
            methods.append(variant.key)
        meshes = character(context) or _compared(context)
        if not methods:
            raise SinewError("Choose at least one method to compare")
        if not meshes:
            raise SinewError("The armature deforms no mesh that is visible; show one first")
        framing.give_back(context)
        problems = comparison.start(context, meshes, methods, _right_of_view(context))
        viewport = _viewport(context)
        if viewport is not None and viewport.local_view is not None:
            for copy in comparison_state.copies_of(comparison_state.of_scene(context.scene)):
                copy.local_view_set(viewport, True)
        if viewport is not None:
            framing.show_all(context, viewport, meshes)
        for problem in problems:
            self.report({"WARNING"}, problem)


def _right_of_view(context: bpy.types.Context) -> np.ndarray:
    """[3], the direction of the screen's right in the world; +X where there is no 3D view."""
    viewport = _viewport(context)
    if viewport is None or viewport.region_3d is None:
        return np.array([1.0, 0.0, 0.0])
    # Also if the button is in the sidebar, a region without its own view.
    return np.array(viewport.region_3d.view_matrix)[0, :3]


class SINEW_OT_flip_comparison(operators.Named, bpy.types.Operator):
    bl_label = "Flip Comparison"
    bl_description = "Show the other of the two copies that are compared, at the same place"
    # Only a view of the comparison: an undo step for each flip would push out the artist's own steps, and
    # take longer than the flip.
    bl_options = {"REGISTER"}

    @classmethod
    def refusal(cls, context: bpy.types.Context) -> str:
        return "" if comparison_state.of_scene(context.scene) is not None else "Compare methods first"

    def run(self, context: bpy.types.Context) -> None:
        state = comparison_state.of_scene(context.scene)
        if state.arrangement != comparison_state.ONE_OF_TWO:
            state.arrangement = comparison_state.ONE_OF_TWO
        else:
            state.shows_second = not state.shows_second
        (shown,) = comparison_state.shown_methods(state)
        self.report({"INFO"}, comparison_state.label_of(shown))


class SINEW_OT_end_comparison(operators.Acting, bpy.types.Operator):
    bl_label = "End Comparison"
    bl_description = "Take the copies away, and all that was made for them"

    @classmethod
    def refusal(cls, context: bpy.types.Context) -> str:
        return "" if comparison.is_on() else "There is no comparison"

    def run(self, _context: bpy.types.Context) -> None:
        _end()


class SINEW_OT_save_comparison(SavesPage, bpy.types.Operator):
    bl_label = "Save as Page"
    bl_description = (
        "Save one HTML file in which the character turns and plays in any browser, under the methods that "
        "are compared"
    )
    bl_options = {"REGISTER"}
    saying = "Sinew reads the frames of the page"
    usual_name = "comparison"

    over: bpy.props.EnumProperty(**stepped.OVER_WHICH, default="SCENE")

    @classmethod
    def refusal(cls, context: bpy.types.Context) -> str:
        state = comparison_state.of_scene(context.scene)
        is_any = state is not None and comparison.originals(state)
        return "" if is_any else "Compare methods first"

    def page(self, context: bpy.types.Context, title: str) -> Generator[float, None, str]:
        scene = context.scene
        state = comparison_state.of_scene(scene)
        assert state is not None, "refusal() says so"
        meshes = comparison.originals(state)
        # A copy that is shown is evaluated.
        copies = sorted(comparison_state.copies_of(state), key=lambda copy: copy.hide_get())
        of_each = {
            obj: [copy for copy in copies if properties.of(copy).identity.copied == obj]
            for obj in meshes
            if attach.armature_of(obj) is not None
        }
        attached = [obj for obj in meshes if obj not in of_each]
        armatures = list(dict.fromkeys(attach.armature_of(obj) for obj in of_each))
        frames = stepped.frames_over(scene, armatures, self.over)
        methods = comparison_state.methods_of(state)
        with stepped.kept_frame(scene, armatures):
            return (yield from viewer.page(scene, title, of_each, attached, methods, frames))


class SINEW_PT_comparison(Sidebar, bpy.types.Panel):
    bl_label = "Compare"

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        return comparison.is_on()

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        state = comparison_state.of_scene(context.scene)
        if state is None:
            draw_text(layout, "Another scene shows a comparison", icon="INFO")
            layout.operator("sinew.end_comparison", icon="X")
            return
        _draw_arrangement(layout, context, state)
        if state.collection is not None:
            layout.prop(state.collection, "hide_render", text="Render the Copies", invert_checkbox=True)
        layout.operator("sinew.compare", text="Methods…")
        if not stepped.draw_progress(layout, SINEW_OT_save_comparison.bl_idname):
            layout.operator("sinew.save_comparison", icon="URL")


def _draw_arrangement(
    layout: bpy.types.UILayout, context: bpy.types.Context, state: comparison_state.SinewComparison
) -> None:
    methods = comparison_state.methods_of(state)
    if not methods:
        draw_text(layout, "The copies were deleted", icon="INFO")
        return
    layout.row(align=True).prop(state, "arrangement", expand=True)
    layout.prop(state, "spacing")
    if state.arrangement == comparison_state.OVERLAID and context.space_data.shading.type == "SOLID":
        layout.prop_enum(context.space_data.shading, "color_type", "OBJECT", text="Colour by Method")
    if state.arrangement == comparison_state.ONE_OF_TWO:
        column = layout.column(align=True)
        column.prop(state, "first", text="")
        column.prop(state, "second", text="")
        (shown,) = comparison_state.shown_methods(state)
        layout.operator("sinew.flip_comparison", text="Flip", icon="UV_SYNC_SELECT")
        draw_text(layout, "Shown: {method}", method=comparison_state.label_of(shown))


def _end() -> None:
    framing.give_back(bpy.context)
    comparison.end(bpy.context)


def _end_later() -> None:
    """Has it ended by a timer, or without a window before the file is saved: deleting objects within the
    handlers of an evaluation can crash Blender."""
    if not bpy.app.background and not bpy.app.timers.is_registered(_end_soon):
        bpy.app.timers.register(_end_soon)


def _on_objects_changed(_objects: list[bpy.types.Object]) -> None:
    _end_later()


def _end_if_over() -> None:
    is_over, _removal.is_last = _removal.is_last and comparison.is_of_none_with_sinew(), False
    if is_over or comparison.is_without_original():
        _end()


def _end_soon() -> float | None:
    """A timer."""
    if not may_change_file():
        return 0.25
    with references.between_steps():
        _end_if_over()
    return None


def _stop() -> None:
    if bpy.app.timers.is_registered(_end_soon):
        bpy.app.timers.unregister(_end_soon)


@dataclass
class _Removal:
    """is_original: Sinew is being taken off a compared object. is_last: it was taken off the last of them."""

    is_original: bool = False
    is_last: bool = False


_removal = _Removal()


def _before_removal(obj: bpy.types.Object) -> None:
    _removal.is_original = comparison.is_original(obj)


def _after_removal() -> None:
    """With the last of a character's meshes its comparison goes, too."""
    was_original, _removal.is_original = _removal.is_original, False
    if not (was_original and comparison.is_of_none_with_sinew()):
        return
    with updates_suspended() as is_by_artist:
        _removal.is_last = not is_by_artist
    if is_by_artist:
        _end()
    else:
        _end_later()


FEATURE = Feature(
    (
        *(comparison_state.SinewComparison, SinewComparisonChoice, SINEW_OT_compare),
        *(SINEW_OT_flip_comparison, SINEW_OT_end_comparison, SINEW_OT_save_comparison),
        SINEW_PT_comparison,
    ),
    {"Scene.sinew_comparison": bpy.props.PointerProperty(type=comparison_state.SinewComparison)},
    overlays=(comparison_labels.draw,),
    end=_stop,
    subscriptions=(
        (subscribers.objects_changed, _on_objects_changed),
        (subscribers.saving, _end_if_over),
        (subscribers.before_removal, _before_removal),
        (subscribers.after_removal, _after_removal),
    ),
)
