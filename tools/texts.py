# SPDX-License-Identifier: GPL-3.0-or-later
"""Collects all texts that Sinew shows, for tools/translations.py: those registered in Blender, and those
in code."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import bpy
import sinew
import sinew_addon
from bl_ui.utils import PresetPanel
from sinew_addon import registration
from sinew_addon.core import battery, metrics, recommendation, suggestion
from sinew_addon.core.engines import METHODS
from sinew_addon.core.export_check import CAUSES, NORMALS
from sinew_addon.core.flex import limits
from sinew_addon.core.vertex_data import PROVIDERS
from sinew_addon.features.diagnose import mending
from sinew_addon.features.heat import heat_panel
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


def shown() -> dict[str, str]:
    """Each text, and one position in the code where it occurs."""
    found: dict[str, str] = {}
    for source in (_of_classes(), _of_data(), _of_lists(), _of_limits(), _of_code(), _of_phrases()):
        for text, where in source:
            # Texts without letters are the same in all languages.
            if any(letter.isalpha() for letter in text):
                found.setdefault(text, where)
    return found


def _of_classes() -> Iterator[tuple[str, str]]:
    parts = (*registration._parts(), *registration._features())
    for cls in (cls for part in parts for cls in part.classes):
        base = next(each for each in TYPES if issubclass(cls, each))
        rna = cls.bl_rna
        if base is bpy.types.Operator:
            rna = getattr(bpy.ops.sinew, cls.bl_idname.partition(".")[2]).get_rna_type()
            yield rna.name, cls.__name__
            yield rna.description, cls.__name__
        # For a panel of presets, Blender writes the name of the last chosen one into bl_label.
        if not issubclass(cls, PresetPanel):
            yield getattr(cls, "bl_label", ""), cls.__name__
        yield getattr(cls, "bl_description", None) or "", cls.__name__
        for prop in rna.properties:
            if prop.identifier not in base.bl_rna.properties:
                yield from _of_property(prop, f"{cls.__name__}.{prop.identifier}")


def _of_data() -> Iterator[tuple[str, str]]:
    """Properties that Sinew adds to Blender's own types."""
    for cls in bpy.types.ID.__subclasses__():
        for prop in cls.bl_rna.properties:
            if prop.identifier.startswith("sinew"):
                yield from _of_property(prop, f"{cls.__name__}.{prop.identifier}")


def _of_property(prop: bpy.types.Property, where: str) -> Iterator[tuple[str, str]]:
    if prop.is_hidden:
        return
    # Without a name it has the name in the code, which is never drawn.
    if prop.name != prop.identifier:
        yield prop.name, where
    yield prop.description, where
    for item in prop.enum_items if prop.type == "ENUM" else ():
        yield item.name, where
        yield item.description, where


def _of_lists() -> Iterator[tuple[str, str]]:
    """Texts that are drawn from lists."""
    for owner in (*METHODS.values(), *sinew.stages()):
        yield owner.label, owner.name
        yield owner.description, owner.name
    for method in METHODS.values():
        yield method.group, method.name
    for metric in metrics.METRICS.values():
        yield metric.label, "METRICS"
        yield metric.text, "METRICS"
    for criterion in suggestion.CRITERIA:
        yield criterion.label, "CRITERIA"
        yield criterion.text, "CRITERIA"
        yield criterion.praise, "CRITERIA"
    for candidate in (*recommendation.METHODS, *recommendation.STAGES):
        yield candidate.why, "recommendation"
    for pose in battery.FIGURE:
        yield pose, "battery"
    for mend in mending.ALL.values():
        yield mend.label, "mending"
        yield mend.description, "mending"
    for cause in (*CAUSES.values(), NORMALS):
        yield cause, "CAUSES"
    for provider in PROVIDERS.values():
        yield provider.what, "PROVIDERS"
    for text in heat_panel._WORST.values():
        yield text, "heat_panel"
    for entry in menus.entries():
        yield entry.text, "menus"


def _of_limits() -> Iterator[tuple[str, str]]:
    for limit in limits.LIMITS.values():
        for text in (limit.label, limit.meaning, limit.advice, limit.unit):
            yield text, "LIMITS"


def _of_code() -> Iterator[tuple[str, str]]:
    for path, node in _drawing_code():
        for shown in _shown_by(node):
            for text in _constants(shown):
                yield text, f"{path.relative_to(ADDON)}:{node.lineno}"
        if path.stem.endswith("_panel"):
            for text in _row_of(node):
                yield text, f"{path.relative_to(ADDON)}:{node.lineno}"


def _of_phrases() -> Iterator[tuple[str, str]]:
    """Sentences that are made by code below the panels."""
    for path in sorted(ADDON.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "phrase":
                for text in _constants(node.args[0]):
                    yield text, f"{path.relative_to(ADDON)}:{node.lineno}"


def _drawing_code() -> Iterator[tuple[Path, ast.AST]]:
    for folder in SHOWING:
        for path in sorted((ADDON / folder).rglob("*.py")):
            if "pages" not in path.parts:
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
    found = set()
    for path in ADDON.rglob("*.py"):
        tree = ast.parse(path.read_text())
        found |= {
            node.value
            for node in ast.walk(tree)
            if isinstance(node, ast.Constant) and isinstance(node.value, str)
        }
    return found
