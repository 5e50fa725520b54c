# SPDX-License-Identifier: GPL-3.0-or-later
"""The sidebar's list of all methods: the numbers of each, which is best at what, and a click to use it."""

from __future__ import annotations

from collections.abc import Iterator

import bpy

from ...attach import properties
from ...core.suggestion import CRITERIA, Criterion, Suggestion, Worst
from ...io import units
from ...ui import operators, stepped
from ...ui.operators import OnSinewObjects, sinew_targets
from ...ui.sidebar import Sidebar, characters, draw_text
from ...ui.translations import counted, tr
from . import suggest


class SINEW_OT_suggest(OnSinewObjects, stepped.Stepped, bpy.types.Operator):
    bl_idname = "sinew.suggest"
    bl_label = "Suggest a Method"
    bl_description = (
        "Measure what every method would make of the frames, and say which is best at what. The method stays "
        "as it is"
    )
    bl_options = {"REGISTER"}
    saying = "Sinew measures every method"

    over: bpy.props.EnumProperty(**stepped.OVER_WHICH, default="SCENE")

    def steps(self, context: bpy.types.Context) -> Iterator[float]:
        return suggest.scan(context.scene, sinew_targets(context), self.over)

    def finish(self, context: bpy.types.Context) -> set[str]:
        self.report({"INFO"}, suggest.suggestions[context.scene.session_uid].text)
        return {"FINISHED"}


class SINEW_PT_suggest(Sidebar, operators.OfSkinned, bpy.types.Panel):
    bl_label = "Suggest"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.active = operators.are_any_on(context)
        layout.operator_menu_enum("sinew.suggest", "over", text="Measure All Methods", icon="VIEWZOOM")
        suggestion = suggest.suggestions.get(context.scene.session_uid)
        if suggestion is None:
            return
        count = len(suggestion.frames)
        one = "The worst of {count} frame, the best method marked"
        many = "The worst of {count} frames, the best method marked"
        draw_text(layout, context, counted(count, one, many))
        used = {properties.of(obj).method for obj in operators.sinew_targets(context)}
        best = {criterion.name: suggestion.best(criterion) for criterion in CRITERIA}
        texts = {name: _texts(context.scene, suggestion, name) for name in suggestion.rank()}
        # Two columns, if the sidebar has room for them beside their icons.
        longest = max((len(text) for own in texts.values() for text in own.values()), default=0)
        columns = 2 if longest <= characters(context) // 2 - 5 else 1
        for name, own in texts.items():
            column = layout.column(align=True)
            button = column.operator("sinew.use_method", text=suggestion.methods[name], depress=name in used)
            button.method = name
            values = column.grid_flow(row_major=True, columns=columns, even_columns=True, align=True)
            for criterion, text in own.items():
                values.label(text=text, icon="CHECKMARK" if name in best[criterion] else "BLANK1")
        for criterion in CRITERIA:
            draw_text(layout, context, f"{tr(criterion.label)}: {tr(criterion.text)}")


def _texts(scene: bpy.types.Scene, suggestion: Suggestion, method: str) -> dict[str, str]:
    """Returns the text of each criterion."""
    return {
        criterion.name: f"{tr(criterion.label)} "
        + value_text(scene, criterion, suggestion.worst.get((method, criterion.name)))
        for criterion in CRITERIA
    }


def value_text(scene: bpy.types.Scene, criterion: Criterion, worst: Worst | None) -> str:
    if worst is None:
        return tr("none")
    if criterion.unit == "count":
        return f"{worst.value:,.0f}"
    return units.text(scene, criterion.unit, worst.value, signed=criterion.name == "volume")


CLASSES = (SINEW_OT_suggest, SINEW_PT_suggest)
