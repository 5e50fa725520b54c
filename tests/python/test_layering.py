# SPDX-License-Identifier: GPL-3.0-or-later
"""Who may include and import whom, read from the sources as text."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
LIBRARY = ROOT / "native" / "sinew"

# Folder of native/sinew: those whose headers it may include.
MAY_INCLUDE = {
    "transform": {"transform"},
    "interpolate": {"transform", "interpolate"},
    "skeleton": {"transform", "interpolate", "skeleton"},
    "skinning": {"transform", "interpolate", "skeleton", "skinning"},
    "deform": {"transform", "interpolate", "skeleton", "skinning", "deform"},
    "motion": {"transform", "interpolate", "skeleton", "motion"},
    "ik": {"transform", "interpolate", "skeleton", "ik"},
}

# What nothing in addon/core may import: Blender and what is built on it.
OF_BLENDER = {"aud", "bgl", "blf", "bl_math", "bmesh", "bpy", "bpy_extras", "gpu", "imbuf", "mathutils"}


def sources(folder, *suffixes):
    return sorted(path for path in folder.rglob("*") if path.suffix in suffixes and path.is_file())


def includes(text):
    return re.findall(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', text, re.MULTILINE)


def wrong_includes(folder, text):
    """Headers of Sinew in `text` that a file of native/sinew/`folder` may not include."""
    wrong = []
    for header in includes(text):
        parts = header.split("/")
        if "sinew" in parts[:-1] and header != "sinew/export.h":
            inside = parts[parts.index("sinew") + 1]
            if parts[0] != "sinew" or inside not in MAY_INCLUDE[folder]:
                wrong.append(header)
        elif header.startswith(".") or (LIBRARY / folder / header).exists():
            wrong.append(header)  # by a path from native/, so that this test can read the folder
    return wrong


def python_headers(text):
    return [
        header
        for header in includes(text)
        if header.startswith(("pybind11", "nanobind", "numpy")) or Path(header).name == "Python.h"
    ]


def imports(text):
    """Dotted names that `text` imports anywhere, functions included; a leading dot for each level up."""
    names = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            prefix = "." * node.level + (node.module or "")
            joint = "." if node.module else ""
            names += [prefix + joint + alias.name for alias in node.names]
    return names


def wrong_in_core(text, depth=0):
    """Imports in `text`, a module `depth` folders below addon/core, that core may not have."""
    wrong = []
    for name in imports(text):
        level = len(name) - len(name.lstrip("."))
        parts = name.lstrip(".").split(".")
        if level > 0:
            above_core = level - depth - 1
            is_wrong = above_core > 1 or (above_core == 1 and parts[0] == "blender")
        else:
            of_extension = parts[0] in {"addon", "sinew_addon", "bl_ext"}
            is_wrong = parts[0] in OF_BLENDER or (of_extension and "blender" in parts)
        if is_wrong:
            wrong.append(name)
    return wrong


LIBRARY_FILES = sources(LIBRARY, ".h", ".cpp")


def test_there_is_something_to_read():
    folders = {path.relative_to(LIBRARY).parts[0] for path in LIBRARY_FILES}
    assert {"transform", "skeleton", "skinning", "deform"} <= folders
    assert folders <= set(MAY_INCLUDE), "a new folder of native/sinew needs its row in MAY_INCLUDE"


@pytest.mark.parametrize("path", LIBRARY_FILES, ids=lambda path: path.relative_to(LIBRARY).as_posix())
def test_native_layers_include_only_those_below(path):
    folder = path.relative_to(LIBRARY).parts[0]
    assert wrong_includes(folder, path.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize("path", LIBRARY_FILES, ids=lambda path: path.relative_to(LIBRARY).as_posix())
def test_library_knows_nothing_of_python(path):
    assert python_headers(path.read_text(encoding="utf-8")) == []


def test_only_bindings_include_pybind11():
    suffixes = (".h", ".hpp", ".cpp", ".cc")
    folders = ("native", "tests", "bench", "experiments")
    files = [path for folder in folders for path in sources(ROOT / folder, *suffixes)]
    users = {path for path in files if python_headers(path.read_text(encoding="utf-8"))}
    bindings = ROOT / "native" / "bindings"
    assert users
    assert {path for path in users if bindings not in path.parents} == set()


def test_package_sinew_imports_nothing_of_blender_or_the_extension():
    files = sources(ROOT / "native" / "python" / "sinew", ".py", ".pyi")
    assert files
    for path in files:
        roots = {name.split(".")[0] for name in imports(path.read_text(encoding="utf-8"))}
        assert roots & (OF_BLENDER | {"addon", "sinew_addon"}) == set(), path


@pytest.mark.parametrize("folder", ["core", "batch"])
def test_core_and_batch_import_nothing_of_blender(folder):
    folder = ROOT / "addon" / folder
    wrong = {}
    for path in sources(folder, ".py"):
        depth = len(path.relative_to(folder).parts) - 1
        found = wrong_in_core(path.read_text(encoding="utf-8"), depth)
        if found:
            wrong[path.relative_to(ROOT).as_posix()] = found
    assert wrong == {}


# The tests above only ever see good sources: these show that they would see bad ones.
@pytest.mark.parametrize(
    ("folder", "line"),
    [
        ("transform", '#include "sinew/skeleton/skeleton.h"'),
        ("skeleton", '#include "sinew/skinning/lbs.h"'),
        ("skinning", '#include "sinew/deform/deformer.h"'),
        ("skinning", "  #  include <sinew/deform/deformer.h>"),
        ("transform", '#include "../skeleton/skeleton.h"'),
        ("transform", '#include "quat.h"'),
        ("deform", '#include "native/sinew/transform/quat.h"'),
    ],
)
def test_a_wrong_include_is_seen(folder, line):
    assert len(wrong_includes(folder, f"#pragma once\n{line}\n")) == 1


@pytest.mark.parametrize("header", ["pybind11/numpy.h", "Python.h", "python3.11/Python.h"])
def test_a_python_header_is_seen(header):
    assert python_headers(f"#include <{header}>\n") == [header]


@pytest.mark.parametrize(
    "text",
    [
        "import bpy",
        "import numpy, bpy.types as t",
        "from mathutils import Matrix",
        "def f():\n    import bmesh",
        "from ..blender import mesh_io",
        "from ..blender.mesh_io import read",
        "from .. import blender",
        "from ... import other",
        "import sinew_addon.deform.handlers",
        "from addon.blender import panels",
    ],
)
def test_a_wrong_import_in_core_is_seen(text):
    assert len(wrong_in_core(text)) == 1


@pytest.mark.parametrize(
    "text", ["import sinew", "from . import rig", "from .rig import Rig", "from .. import cli"]
)
def test_a_right_import_in_core_is_let_through(text):
    assert wrong_in_core(text) == []


def test_imports_count_from_the_folder_of_the_module():
    assert wrong_in_core("from ..blender import mesh_io", depth=1) == []
    assert len(wrong_in_core("from ...blender import mesh_io", depth=1)) == 1
