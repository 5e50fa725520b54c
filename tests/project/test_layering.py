# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects the layers: which files may include and import which."""

import ast
import re
from pathlib import Path

import pytest
import without_blender
from without_blender import ADDON, OF_BLENDER, files_of, runs_without_blender

ROOT = Path(__file__).resolve().parents[2]
LIBRARY = ROOT / "native" / "sinew"

# Folder of native/sinew: the folders whose headers it may include. "" has the public headers on top. What
# these declare is defined in the folders that may include them.
TRANSFORMS = {"transform", "interpolate"}
MAY_INCLUDE = {
    "base": {"base"},
    "transform": {"transform"},
    "interpolate": {"transform", "interpolate"},
    "mesh": {"base", *TRANSFORMS, "mesh", ""},
    "pose": {"base", *TRANSFORMS, "mesh", "pose"},
    "lanes": {"base", *TRANSFORMS, "mesh", "pose", "lanes"},
    "methods": {"base", *TRANSFORMS, "mesh", "pose", "lanes", "methods", ""},
    "stages": {"base", *TRANSFORMS, "mesh", "pose", "lanes", "methods", "stages", ""},
    "normals": {"base", *TRANSFORMS, "mesh", "pose", "lanes", "normals", ""},
}
MAY_INCLUDE[""] = set(MAY_INCLUDE) | {""}

# The rooms of addon/, lowest first: a file may import from its own room and from those before it. Files
# directly in addon/ that start a process may be imported by all.
ROOMS = ("base", "skinning", "io", "attach", "deform", "ui", "features", "jobs", "commands")
FOR_ALL = {"native", "blender_process"}
FOR_COMMANDS = {"prepare", "worker"}


def sources(folder, *suffixes):
    return sorted(path for path in folder.rglob("*") if path.suffix in suffixes and path.is_file())


def includes(text):
    return re.findall(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', text, re.MULTILINE)


def folder_of(path):
    return "".join(path.relative_to(LIBRARY).parts[:-1][:1])


def wrong_includes(folder, text):
    """Headers of Sinew in `text` that a file of native/sinew/`folder` may not include."""
    wrong = []
    for header in includes(text):
        parts = header.split("/")
        if "sinew" in parts[:-1] and header != "sinew/export.h":
            inside = "".join(parts[parts.index("sinew") + 1 : -1][:1])
            if parts[0] != "sinew" or inside not in MAY_INCLUDE[folder]:
                wrong.append(header)
        elif header.startswith(".") or (LIBRARY / folder / header).exists():
            wrong.append(header)  # with a path from native/, so that this test can see the folder
    return wrong


def python_headers(text):
    return [
        header
        for header in includes(text)
        if header.startswith(("pybind11", "nanobind", "numpy")) or Path(header).name == "Python.h"
    ]


def imports(text):
    """Dotted names that `text` imports anywhere, also in functions; with a leading dot for each level up."""
    names = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            prefix = "." * node.level + (node.module or "")
            joint = "." if node.module else ""
            names += [prefix + joint + alias.name for alias in node.names]
    return names


def rooms_used(text, path):
    """The rooms and files of addon/ that `text` imports from, if it is the file `path`, relative to
    addon/."""
    used = set()
    for name in imports(text):
        level = len(name) - len(name.lstrip("."))
        parts = name.lstrip(".").split(".")
        if level == len(path.parts):
            used.add(parts[0])
        elif level > len(path.parts):
            used.add("outside")
        elif level == 0 and parts[0] in {"addon", "sinew_addon", "bl_ext"}:
            used.add(parts[1] if len(parts) > 1 else parts[0])
    return used


def wrong_rooms(text, path):
    """The rooms that `text` imports from although it must not."""
    below = set(ROOMS[: ROOMS.index(path.parts[0]) + 1])
    processes = FOR_ALL | FOR_COMMANDS if path.parts[0] == "commands" else FOR_ALL
    return rooms_used(text, path) - below - processes


LIBRARY_FILES = sources(LIBRARY, ".h", ".cpp")


def test_there_is_something_to_read():
    folders = {folder_of(path) for path in LIBRARY_FILES}
    assert {"transform", "pose", "methods", "stages", ""} <= folders
    assert folders <= set(MAY_INCLUDE), "a new folder of native/sinew needs its row in MAY_INCLUDE"


@pytest.mark.parametrize("path", LIBRARY_FILES, ids=lambda path: path.relative_to(LIBRARY).as_posix())
def test_native_layers_include_only_those_below(path):
    assert wrong_includes(folder_of(path), path.read_text(encoding="utf-8")) == []


def test_only_bindings_include_pybind11():
    suffixes = (".h", ".hpp", ".cpp", ".cc")
    folders = ("native", "tests", "bench", "experiments")
    files = [path for folder in folders for path in sources(ROOT / folder, *suffixes)]
    users = {path for path in files if python_headers(path.read_text(encoding="utf-8"))}
    bindings = ROOT / "native" / "bindings"
    assert users
    assert {path for path in users if bindings not in path.parents} == set()


def test_no_quaternion_is_made_of_four_numbers():
    """Of which GLM takes another as w where a program defines GLM_FORCE_QUAT_DATA_XYZW."""
    within = r"(?:[^(){},&]|\([^(){}]*\)|\{[^(){}]*\})+"
    four = re.compile(rf"\b(?:Quat<\w+>|glm::d?quat)[ \w]*[({{]{within}(?:,{within}){{3}}[)}}]")
    assert four.search("return Quat<T>(cos(half), v.x, v.y, v.z);")
    assert four.search("Quat<T> real{T(1), T(0), T(0), T(0)};")
    assert not four.search("Quat<T>(s / T(4), {x, y, z})")
    found = {path: four.findall(path.read_text()) for path in sources(ROOT / "native", ".h", ".cpp")}
    assert {path.name: each for path, each in found.items() if each} == {}


def test_package_sinew_imports_nothing_of_blender_or_the_extension():
    files = sources(ROOT / "native" / "python" / "sinew", ".py", ".pyi")
    assert files
    for path in files:
        roots = {name.split(".")[0] for name in imports(path.read_text(encoding="utf-8"))}
        assert roots & (OF_BLENDER | {"addon", "sinew_addon"}) == set(), path


def room_files(*rooms):
    return [path for room in rooms for path in sources(ROOT / "addon" / room, ".py")]


def test_every_folder_of_the_extension_is_a_room():
    folders = {path.parent.name for path in (ROOT / "addon").glob("*/__init__.py")}
    assert folders == set(ROOMS)


def test_rooms_import_from_those_below_alone():
    wrong = {}
    for path in room_files(*ROOMS):
        relative = path.relative_to(ROOT / "addon")
        found = wrong_rooms(path.read_text(encoding="utf-8"), relative)
        if found:
            wrong[relative.as_posix()] = found
    assert wrong == {}


def files_used(path):
    """The files of addon/ that a file imports, also in functions."""
    return {
        each for node in without_blender.imports(path, in_functions=True) for each in files_of(node, path)
    }


def test_skinning_and_jobs_load_without_blender():
    files = [path for path in room_files("base", "skinning", "jobs") if "tasks" not in path.parts]
    assert files
    assert [path for path in files if not runs_without_blender(path)] == []


def test_what_is_tested_without_blender_loads_without_it():
    """Mathematics of features, above all, which stand beside files that need Blender."""
    used = {file for path in sources(ROOT / "tests" / "python", ".py") for file in files_used(path)}
    assert any("features" in path.parts for path in used)
    assert [path for path in used if not runs_without_blender(path)] == []


def test_jobs_hand_tasks_out_without_importing_them():
    files = [path for path in room_files("jobs") if "tasks" not in path.parts]
    used = {each for path in files for each in files_used(path)}
    assert [path for path in used if not runs_without_blender(path)] == []


def public_files(feature):
    """The files of a feature that others may import: those that its __init__.py names as PUBLIC, or all where
    it adds nothing to Blender itself."""
    folder = ADDON / "features" / feature
    if not (folder / "feature.py").exists():
        return set(folder.glob("*.py"))
    for node in ast.parse((folder / "__init__.py").read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Assign) and node.targets[0].id == "PUBLIC":
            return {folder / f"{name}.py" for name in ast.literal_eval(node.value)}
    return set()


def feature_of(path):
    parts = path.relative_to(ADDON).parts
    return parts[1] if parts[0] == "features" and len(parts) > 2 else ""


def test_features_import_what_others_say_is_public():
    used = {}
    for path in room_files("features"):
        for other in map(feature_of, files_used(path)):
            used.setdefault(other, set())
        for file in files_used(path):
            if feature_of(file) != feature_of(path):
                used.setdefault(feature_of(file), set()).add(file)
    del used[""]
    assert {
        each: files - public_files(each) for each, files in used.items() if files - public_files(each)
    } == {}
    declared = {
        each: public_files(each) for each in used if (ADDON / "features" / each / "feature.py").exists()
    }
    assert {each: files - used[each] for each, files in declared.items() if files - used[each]} == {}


def test_features_import_each_other_one_way():
    """Without a circle of folders."""
    waiting = {path.parent.name: set() for path in (ADDON / "features").glob("*/__init__.py")}
    for path in room_files("features"):
        if feature_of(path):
            waiting[feature_of(path)] |= {feature_of(file) for file in files_used(path)} - {
                feature_of(path),
                "",
            }
    while free := [name for name, needed in waiting.items() if not needed & waiting.keys()]:
        for name in free:
            del waiting[name]
    assert waiting == {}


def walks_of_modifiers(text):
    """Lines that go through a collection of modifiers, or make a list of it: not an F-curve's, a layout's."""
    walk = re.compile(r"(\bfor .* in |\blist\(|\benumerate\()(?!curve\.|now\.)[\w.]+\.modifiers\b(?!\[|\.)")
    return [line.strip() for line in text.splitlines() if walk.search(line)]


def test_only_attach_walks_stacks_of_modifiers():
    """Others are given a Layout, read once for each event. io/read_only.py looks for the caches of all
    objects."""
    assert walks_of_modifiers("for m in obj.modifiers:")
    assert walks_of_modifiers("list(obj.modifiers)[1]")
    assert not walks_of_modifiers("for m in curve.modifiers: obj.modifiers['A'].name")
    files = room_files("deform", "ui", "features", "jobs", "commands")
    found = {path.name: walks_of_modifiers(path.read_text(encoding="utf-8")) for path in files}
    assert {name: lines for name, lines in found.items() if lines} == {}
