# SPDX-License-Identifier: GPL-3.0-or-later
"""Suggestions: a panel with the best methods at each measure, or all in order, and a click to use one.
Nothing is stored in files.

Beside them the preset Recommended, which measures and sets."""

from collections.abc import Iterator

import bpy

from ...attach import properties, stage_settings, variant_settings
from ...attach.feature import Feature
from ...attach.subscribers import subscribers
from ...base.errors import SinewError
from ...deform import characters, session
from ...io import units
from ...skinning import parameters
from ...ui import character, operators, stepped
from ...ui.operators import OnSinewObjects, sinew_targets
from ...ui.sidebar import Sidebar, draw_text
from ...ui.translations import counted, tr
from ..measure.measured_on import CHOICE, MeasuredOn
from ..measure.suggestion import CRITERIA, Criterion, Suggestion
from . import recommend, suggest
from .recommendation import Choice

BEST = "best"
# Several methods can be equally good.
MOST_BEST = 3


class SINEW_OT_suggest(OnSinewObjects, stepped.Stepped, bpy.types.Operator):
    bl_label = "Suggest a Method"
    bl_description = (
        "Measure what every method would make of the frames, and recommend one. The method stays as it is"
    )
    bl_options = {"REGISTER"}
    saying = "Sinew measures every method"

    over: bpy.props.EnumProperty(**stepped.OVER_WHICH, default="SCENE")

    def steps(self, context: bpy.types.Context) -> Iterator[float]:
        return suggest.scan(context.scene, sinew_targets(context), self.over)

    def run(self, context: bpy.types.Context) -> None:
        self.report({"INFO"}, recommend.choices[context.scene.session_uid].text)


class SINEW_OT_recommend(OnSinewObjects, stepped.Stepped, bpy.types.Operator):
    bl_label = "Recommended"
    bl_description = (
        "Measure the character in the frames in which its joints bend most, or without an action in a "
        "battery of poses, and set method and stages"
    )
    saying = "Sinew measures methods and stages"

    def steps(self, context: bpy.types.Context) -> Iterator[float]:
        objects = character.followers(context)
        if not objects:
            raise SinewError("All meshes have settings of their own")
        self.basis = MeasuredOn.of(context.scene, objects, CHOICE, recommend.OVER)
        self.choice = yield from recommend.search(context.scene, objects)

    def run(self, context: bpy.types.Context) -> None:
        recommend.keep(context.scene, self.choice, self.basis)
        suggest.drop_old(context.scene, sinew_targets(context))
        _use(context, self.choice)
        self.report({"INFO"}, self.choice.text)


class SINEW_OT_use_recommended(OnSinewObjects, bpy.types.Operator):
    bl_label = "Use Recommended"
    bl_description = "Deform all meshes of the character by the recommended method and stages"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    def run(self, context: bpy.types.Context) -> None:
        choice = recommend.choices.get(context.scene.session_uid)
        if choice is None:
            raise SinewError("Nothing is recommended yet: click Suggest first")
        _use(context, choice)


class SINEW_OT_suggestions_by(operators.Named, bpy.types.Operator):
    bl_label = "Suggestions by Measure"
    bl_description = "Show the best methods at each measure, or all methods in the order of one"
    bl_options = {"INTERNAL"}

    measure: bpy.props.EnumProperty(
        name="Measure",
        description="What the methods are compared by",
        items=(
            (BEST, "Best at Each Measure", "The best methods at each measure, with their worst value"),
            *((criterion.name, criterion.label, criterion.text) for criterion in CRITERIA),
        ),
    )

    def run(self, _context: bpy.types.Context) -> None:
        _View.measure = self.measure


class _View:
    """What the panel shows: BEST, or a criterion's name."""

    measure = BEST


class SINEW_PT_suggest(Sidebar, bpy.types.Panel):
    bl_label = "Suggest"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        is_any = context.scene.session_uid in recommend.choices
        return is_any and operators.has_sinew_targets(context)

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.active = operators.are_any_on(context)
        scene, chosen, used = context.scene, sinew_targets(context), _used(context)
        choice, basis = recommend.choices[scene.session_uid], recommend.bases[scene.session_uid]
        known = suggest.suggestions.get(scene.session_uid)
        if known is None:
            is_old = basis.draw(layout, scene, character.followers(context))
        else:
            is_old = known.basis.draw(layout, scene, chosen)
        _draw_recommended(layout, choice, used)
        layout = layout.column()
        layout.active = not is_old
        draw_text(layout, tr(choice.text), icon="SOLO_ON")
        if known is None:
            return
        suggestion = known.suggestion
        for method, why in suggestion.torn.items():
            draw_text(
                layout,
                "{method} tears here: {why}",
                icon="ERROR",
                method=tr(suggestion.methods[method]),
                why=tr(why),
            )
        count = len(suggestion.frames)
        draw_text(layout, counted(count, "The worst of {count} frame", "The worst of {count} frames"))
        criterion = next((c for c in CRITERIA if c.name == _View.measure), None)
        text = "Best at Each Measure" if criterion is None else criterion.label
        layout.operator_menu_enum("sinew.suggestions_by", "measure", text=text, icon="SORTSIZE")
        if criterion is None:
            _draw_best(layout, suggestion, used)
        else:
            draw_text(layout, criterion.text)
            _draw_order(layout, suggestion, criterion, used)
        self.layout.operator_menu_enum("sinew.suggest", "over", text="Measure Again", icon="VIEWZOOM")


def _use(context: bpy.types.Context, choice: Choice) -> None:
    with session.changing(context):
        variant_settings.use_values(character.followers(context), choice.variant.method, choice.values)


def _used(context: bpy.types.Context) -> set[str]:
    """The methods and stages of the objects that the panel is about."""
    shown = [properties.of(obj) for obj in character.known_meshes(context)]
    stages = {name for settings in shown for name in stage_settings.names_on(settings)}
    return {settings.method for settings in shown} | stages


def _draw_best(layout: bpy.types.UILayout, suggestion: Suggestion, used: set[str]) -> None:
    """used: as from _used()"""
    for criterion in CRITERIA:
        best = suggestion.best(criterion)
        row = layout.split(factor=0.45)
        measured = suggestion.order(criterion)
        value = _value(suggestion, criterion, measured[0])
        row.label(text=f"{tr(criterion.label)} {value}", translate=False)
        column = row.column(align=True)
        for method in best[:MOST_BEST]:
            _draw_method(column, suggestion, method, used)
        if len(best) > MOST_BEST:
            column.label(text=tr("and {count} more", count=len(best) - MOST_BEST), translate=False)
        elif not best and (measured[0], criterion.name) in suggestion.worst:
            column.label(text="All alike")
    chosen = recommend.choices[bpy.context.scene.session_uid].variant.method
    row = suggest.RECOMMENDED if suggest.RECOMMENDED in suggestion.methods else chosen
    firsts = {best[0] for best in map(suggestion.best, CRITERIA) if best and row not in best}
    for method in sorted(firsts, key=list(suggestion.methods).index):
        draw_text(layout, tr(suggestion.why_not(method, row)), icon="DOT")


def _draw_order(
    layout: bpy.types.UILayout, suggestion: Suggestion, criterion: Criterion, used: set[str]
) -> None:
    best = suggestion.best(criterion)
    column = layout.column(align=True)
    for method in suggestion.order(criterion):
        row = column.split(factor=0.64, align=True)
        _draw_method(row, suggestion, method, used)
        value = _value(suggestion, criterion, method)
        row.label(text=value, icon="CHECKMARK" if method in best else "BLANK1", translate=False)


def _draw_method(layout: bpy.types.UILayout, suggestion: Suggestion, method: str, used: set[str]) -> None:
    """method: or suggest.RECOMMENDED"""
    if method == suggest.RECOMMENDED:
        _draw_recommended(layout, recommend.choices[bpy.context.scene.session_uid], used)
        return
    button = layout.operator("sinew.use_method", text=suggestion.methods[method], depress=method in used)
    button.method = method


def _draw_recommended(layout: bpy.types.UILayout, choice: Choice, used: set[str]) -> None:
    is_used = used == {choice.variant.method, *choice.variant.stages}
    layout.operator("sinew.use_recommended", text="Recommended", depress=is_used)


def _value(suggestion: Suggestion, criterion: Criterion, method: str) -> str:
    worst = suggestion.worst.get((method, criterion.name))
    if worst is None:
        return tr("none")
    if criterion.unit == "count":
        return f"{worst.value:,.0f}"
    return units.text(bpy.context.scene, criterion.unit, worst.value)


def _begin() -> None:
    characters.choosers[RECOMMENDED] = recommend.choose


def _end() -> None:
    del characters.choosers[RECOMMENDED]
    suggest.forget()


(RECOMMENDED,) = parameters.PRESETS

FEATURE = Feature(
    (
        SINEW_OT_suggest,
        SINEW_OT_recommend,
        SINEW_OT_use_recommended,
        SINEW_OT_suggestions_by,
        SINEW_PT_suggest,
    ),
    subscriptions=((subscribers.loading, suggest.forget),),
    begin=_begin,
    end=_end,
)
