# SPDX-License-Identifier: GPL-3.0-or-later
"""Collects all texts that Sinew shows, for tools/translations.py: those registered in Blender, and those
in code."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from itertools import chain
from pathlib import Path

import bpy
import sinew
import sinew_addon
from bl_ui.utils import PresetPanel
from sinew_addon import registration
from sinew_addon.features.diagnose import mending
from sinew_addon.features.gltf import players
from sinew_addon.features.gltf.export_check import CAUSES, NAMED, NORMALS
from sinew_addon.features.heat import heat_panel
from sinew_addon.features.measure import battery, joint_figures, limits, metrics, motion_range, suggestion
from sinew_addon.features.suggest import recommendation
from sinew_addon.skinning.engines import METHODS
from sinew_addon.skinning.vertex_data import PROVIDERS
from sinew_addon.ui import menus

ADDON = Path(sinew_addon.__file__).parent
# Folders with code that draws.
SHOWING = ("ui", "features")
# Arguments that are texts: for each function, their positions; and keywords of all functions.
ARGUMENTS = {
    "tr": (0,),
    "tip": (0,),
    "counted": (1, 2),
    "draw_text": (2,),
    "report": (1,),
    "poll_message_set": (0,),
    "_for_each": (3,),
}
KEYWORDS = {"text"}
# Names to which code assigns texts before it uses them, and what operators in steps report.
VARIABLES = {"text", "what", "one", "many", "saying", "stopped"}

TYPES = (
    *(bpy.types.Operator, bpy.types.Panel, bpy.types.Menu, bpy.types.PropertyGroup),
    *(bpy.types.UIList, bpy.types.AddonPreferences),
)


def shown() -> list[str]:
    """Each text once."""
    sources = (_of_classes(), _of_data(), _of_lists(), _of_code(), _of_phrases())
    # Texts without letters are the same in all languages.
    return list(dict.fromkeys(text for text in chain(*sources) if any(map(str.isalpha, text))))


def _of_classes() -> Iterator[str]:
    parts = (*registration._parts(), *registration._features())
    for cls in (cls for part in parts for cls in part.classes):
        base = next(each for each in TYPES if issubclass(cls, each))
        rna = cls.bl_rna
        if base is bpy.types.Operator:
            rna = getattr(bpy.ops.sinew, cls.bl_idname.partition(".")[2]).get_rna_type()
            yield rna.name
            yield rna.description
        # For a panel of presets, Blender writes the name of the last chosen one into bl_label.
        if not issubclass(cls, PresetPanel):
            yield getattr(cls, "bl_label", "")
        yield getattr(cls, "bl_description", None) or ""
        for prop in rna.properties:
            if prop.identifier not in base.bl_rna.properties:
                yield from _of_property(prop)


def _of_data() -> Iterator[str]:
    """Properties that Sinew adds to Blender's own types."""
    for cls in bpy.types.ID.__subclasses__():
        for prop in cls.bl_rna.properties:
            if prop.identifier.startswith("sinew"):
                yield from _of_property(prop)


def _of_property(prop: bpy.types.Property) -> Iterator[str]:
    if prop.is_hidden:
        return
    # Without a name it has the name in the code, which is never drawn.
    if prop.name != prop.identifier:
        yield prop.name
    yield prop.description
    for item in prop.enum_items if prop.type == "ENUM" else ():
        yield item.name
        yield item.description


def _of_lists() -> Iterator[str]:
    """Texts that are drawn from lists."""
    yield from _of_each((*METHODS.values(), *sinew.stages()), "label", "description")
    yield from _of_each(METHODS.values(), "group")
    yield from _of_each(metrics.METRICS.values(), "label", "text")
    yield from _of_each(suggestion.CRITERIA, "label", "text", "praise")
    yield from _of_each((*recommendation.METHODS, *recommendation.STAGES), "why")
    yield from (*battery.FIGURE, *motion_range.RANGE, *motion_range.COLUMNS.values())
    yield from joint_figures.Figures._fields
    yield from _of_each(mending.ALL.values(), "label", "description")
    yield from (*CAUSES.values(), *NAMED.values(), NORMALS)
    yield from (*players.PROPERTIES.values(), *(each.note for each in players.PLAYERS.values() if each.note))
    yield from _of_each(PROVIDERS.values(), "what")
    yield from heat_panel._WORST.values()
    yield from _of_each(menus.entries(), "text")
    yield from _of_each(limits.LIMITS.values(), "label", "meaning", "advice", "unit")


def _of_each(owners: Iterable[object], *names: str) -> Iterator[str]:
    return (getattr(owner, name) for owner in owners for name in names)


def _of_code() -> Iterator[str]:
    for path, node in chain(*(_nodes(ADDON / folder) for folder in SHOWING)):
        if "pages" not in path.parts:
            for expression in _shown_by(node):
                yield from _constants(expression)
            if path.stem.endswith("_panel"):
                yield from _row_of(node)


def _of_phrases() -> Iterator[str]:
    """Sentences that are made by code below the panels."""
    for _path, node in _nodes(ADDON):
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "phrase":
            yield from _constants(node.args[0])


def _nodes(folder: Path) -> Iterator[tuple[Path, ast.AST]]:
    """All parts of the code in a folder, with their files."""
    for path in sorted(folder.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            yield path, node


def _shown_by(node: ast.AST) -> Iterator[ast.expr]:
    """The expressions for texts that a statement or call shows."""
    if isinstance(node, ast.Assign):
        names = {target.id for target in node.targets if isinstance(target, ast.Name)}
        if names & VARIABLES:
            yield node.value
    if isinstance(node, ast.FunctionDef) and node.name == "refusal":
        yield from (each.value for each in ast.walk(node) if isinstance(each, ast.Return) and each.value)
    if isinstance(node, ast.Call):
        name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        yield from (node.args[place] for place in ARGUMENTS.get(name, ()) if place < len(node.args))
        yield from (keyword.value for keyword in node.keywords if keyword.arg in KEYWORDS)


def _row_of(node: ast.AST) -> Iterator[str]:
    """For a table in a panel: a name, and how its value is found."""
    if isinstance(node, ast.Tuple) and len(node.elts) == 2 and not isinstance(node.elts[1], ast.Constant):
        yield from _constants(node.elts[0])


def _constants(node: ast.expr) -> Iterator[str]:
    """A string, or one of two strings."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.value
    elif isinstance(node, ast.IfExp):
        yield from _constants(node.body)
        yield from _constants(node.orelse)


def literals() -> set[str]:
    """All strings in the code, to find texts that are made below the panels."""
    constants = (node for _path, node in _nodes(ADDON) if isinstance(node, ast.Constant))
    return {node.value for node in constants if isinstance(node.value, str)}
