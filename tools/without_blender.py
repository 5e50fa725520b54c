# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the files of addon/ that run without Blender, from their imports: tests, linters and other programs
can load them."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ADDON = Path(__file__).resolve().parents[1] / "addon"
# Blender, and what is built on it.
OF_BLENDER = {"aud", "bgl", "blf", "bl_math", "bmesh", "bpy", "bpy_extras", "gpu", "imbuf", "mathutils"}


@cache
def runs_without_blender(path: Path) -> bool:
    """Whether neither a file of addon/ nor what it loads imports Blender; functions may."""
    nodes = list(imports(path, in_functions=False))
    return not any(map(is_of_blender, nodes)) and all(
        runs_without_blender(each) for node in nodes for each in files_of(node, path)
    )


def all_files() -> list[Path]:
    return sorted(path for path in ADDON.rglob("*.py") if "build" not in path.parts)


def imports(path: Path, in_functions: bool) -> Iterator[ast.Import | ast.ImportFrom]:
    """Yields the imports of a file, but for those that only types need."""
    waiting: list[ast.AST] = [ast.parse(path.read_text(encoding="utf-8"))]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.Import | ast.ImportFrom):
            yield node
        for_types = isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
        if not for_types and (in_functions or not isinstance(node, ast.FunctionDef)):
            waiting += ast.iter_child_nodes(node)


def is_of_blender(node: ast.Import | ast.ImportFrom) -> bool:
    names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else [node.module or ""]
    relative = isinstance(node, ast.ImportFrom) and node.level
    return not relative and any(name.split(".")[0] in OF_BLENDER for name in names)


def files_of(node: ast.Import | ast.ImportFrom, path: Path) -> set[Path]:
    """Returns the files of addon/ that an import in the file `path` names; of a name in a file, the file."""
    if isinstance(node, ast.Import):
        return set()
    parts = node.module.split(".") if node.module else []
    if node.level:
        folder = path.parents[node.level - 1].joinpath(*parts)
    elif parts[0] == "sinew_addon":
        folder = ADDON.joinpath(*parts[1:])
    else:
        return set()
    found = {_file(folder / alias.name) or _file(folder) for alias in node.names}
    return {file for file in found if file is not None and file != path}


def _file(of: Path) -> Path | None:
    candidates = (of.with_suffix(".py"), of / "__init__.py")
    return next((each for each in candidates if each.is_file()), None)
