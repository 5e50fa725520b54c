# SPDX-License-Identifier: GPL-3.0-or-later
"""Everything in the open file: every property of every datablock, read through RNA, to compare files."""

from __future__ import annotations

import os
import re
import warnings

import bpy
import numpy as np
import scenes

# From this number of items on, numbers of a collection are read by foreach_get: a mesh has hundreds of
# thousands.
MANY = 32
ELEMENT_TYPES = {"FLOAT": np.float32, "INT": np.int32, "BOOLEAN": np.bool_}

# Properties of this process, or computed from others; not stored in files.
VOLATILE = {
    "bl_rna",
    "corner_normals",
    "depsgraph",
    "edge_selection",  # see below
    "execution_time",
    "id_data",
    "is_evaluated",
    "is_event_handling_break",
    "is_runtime_data",
    "keyconfigs",
    "loop_triangle_polygons",
    "loop_triangles",
    "original",
    "pin",  # see below
    "polygon_normals",
    "rna_type",
    "session_uid",
    "spaces",  # 4.2 crashes when an editor's content is read
    "tag",
    "token",  # of Sinew's settings: a session_uid, while its driver is there
    "undo_stack",
    "uv_sculpt",  # and when its brush is read
    "vertex_normals",
    # Of a UV map, like edge_selection and pin. Reading one creates an attribute and so moves the map, whose
    # old memory is read for the next. Stored values are read as attributes of the mesh.
    "vertex_selection",
}


class Column:
    """One property of all items of a collection, [items, ...]. Equal if all bits are."""

    def __init__(self, values: np.ndarray) -> None:
        self.values = values

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Column) or self.values.shape != other.values.shape:
            return False
        return self.values.tobytes() == other.values.tobytes()

    def __hash__(self) -> int:
        return hash(self.values.tobytes())

    def __repr__(self) -> str:
        return f"{self.values.shape} {self.values.dtype}"

    def differences(self, path: str, other: object) -> list[str]:
        """A line for each item that differs; `path` has [*] in the position of its number."""
        if not isinstance(other, Column) or self.values.shape != other.values.shape:
            return [f"{path}: {self!r} -> {other!r}"]
        start, _star, end = path.rpartition("[*]")
        rows = (array.values.reshape(len(array.values), -1) for array in (self, other))
        pairs = enumerate(zip(*rows, strict=True))
        return [
            f"{start}[{i}]{end}: {mine} -> {theirs}"
            for i, (mine, theirs) in pairs
            if mine.tobytes() != theirs.tobytes()
        ]


# Undo changes these as well: settings that Sinew has read, with their defaults; what no window shows (5.3).
BY_UNDO = r"\bsinew\b|layer_collection\.is_visible"


def of_open_file(only: str = "", named: str = "") -> dict[str, object]:
    """Path of each value -> the value.

    only   the name of the one kind of datablocks to read
    named  the name of a kind of which only names and numbers of users are read
    """
    found: dict[str, object] = {}
    collections = [p.identifier for p in bpy.data.bl_rna.properties if p.type == "COLLECTION"]
    with warnings.catch_warnings(action="ignore", category=DeprecationWarning):
        # 5.0 lists all of them twice.
        for kind in [only] if only else [each for each in collections if each != "all_ids"]:
            for item in getattr(bpy.data, kind):
                # The last render belongs to this process.
                is_render = isinstance(item, bpy.types.Image) and item.source == "VIEWER"
                if isinstance(item, bpy.types.ID) and not is_render:
                    path = f"{kind}[{item.name_full}]"
                    found[path] = item.users
                    if kind == named:
                        continue
                    _Walk(found, item).struct(item, path)
    return found


def content(named: str = "") -> dict[str, object]:
    """The open file once it is evaluated, which fills in bounds and caches, and read, which makes Blender 5.2
    expand attributes with a single value. named: as of of_open_file()"""
    bpy.context.scene.frame_set(bpy.context.scene.frame_current)
    of_open_file("meshes")
    return of_open_file(named=named)


def assert_same(before: dict[str, object], but: str = "") -> None:
    """Asserts that all is as it was when content() returned this. but: a property that may differ"""
    changed = [
        each for each in differences(before, content()) if not (but and re.search(rf"\b{but}\b", each))
    ]
    assert not changed, "\n".join(changed)


def evaluated(frames: list[int]) -> dict[str, object]:
    """The final points of every mesh of every scene's view layer at these frames."""
    found = {}
    for frame in frames:
        bpy.context.scene.frame_set(frame)
        for obj in bpy.context.view_layer.objects:
            if obj.type == "MESH":
                found[f"{obj.name_full} at {frame}"] = scenes.final_points(obj).tobytes()
    return found


def differences(before: dict[str, object], after: dict[str, object]) -> list[str]:
    """One line for each value that is not the same."""
    lines = [f"gone: {path} = {before[path]!r}" for path in before if path not in after]
    lines += [f"new: {path} = {after[path]!r}" for path in after if path not in before]
    for path, value in before.items():
        if path not in after or value == after[path]:
            continue
        if isinstance(value, Column):
            lines += value.differences(path, after[path])
        else:
            lines.append(f"{path}: {value!r} -> {after[path]!r}")
    return [line if len(line) < 300 else f"{line[:300]}…" for line in lines]


class _Walk:
    """Reads one datablock: its own data once, and references to other datablocks by name."""

    def __init__(self, found: dict[str, object], owner: bpy.types.ID) -> None:
        self.found = found
        self.owner = owner
        self.seen: dict[tuple[int, str], str] = {}

    def struct(self, data: bpy.types.bpy_struct, path: str) -> None:
        key = (data.as_pointer(), data.bl_rna.identifier)
        if key in self.seen:
            self.found[path] = f"see {self.seen[key]}"
            return
        self.seen[key] = path
        for prop in data.bl_rna.properties:
            if prop.identifier not in VOLATILE:
                self.value(data, prop, f"{path}.{prop.identifier}")
        self.custom(data, path)

    def value(self, data: bpy.types.bpy_struct, prop: bpy.types.Property, path: str) -> None:
        if prop.is_runtime and not data.is_property_set(prop.identifier):
            # Reading a group that an extension registered would create it.
            self.found[path] = "not set"
            return
        try:
            value = getattr(data, prop.identifier)
        except (AttributeError, RuntimeError, ValueError, UnicodeDecodeError) as error:
            self.found[path] = type(error).__name__
            return
        if prop.type == "COLLECTION":
            self.found[path] = len(value)
            if len(value) >= MANY and len({type(item) for item in value}) == 1:
                self.columns(value, path)
            else:
                for index, item in enumerate(value):
                    self.pointer(item, f"{path}[{index}]")
        elif prop.type == "POINTER":
            self.pointer(value, path)
        elif getattr(prop, "is_array", False):
            self.found[path] = _flat(value)
        elif prop.type == "STRING" and isinstance(value, str) and len(value) > 2 and value.startswith("//"):
            # A copy in another folder has another relative path to the same file. Blender keeps //.
            self.found[path] = os.path.normpath(bpy.path.abspath(value, library=self.owner.library))
        else:
            self.found[path] = repr(value)

    def columns(self, items: bpy.types.bpy_prop_collection, path: str) -> None:
        """Many items of one type: numbers of all items at once, other properties one by one."""
        if isinstance(items[0], bpy.types.ID) or items[0].id_data not in (None, self.owner):
            for index, item in enumerate(items):
                self.pointer(item, f"{path}[{index}]")
            return
        single = []
        for prop in items[0].bl_rna.properties:
            if prop.identifier in VOLATILE:
                continue
            # Polygons differ in their number of vertices.
            is_ragged = (items[0].bl_rna.identifier, prop.identifier) == ("MeshPolygon", "vertices")
            if prop.type in ELEMENT_TYPES and not prop.is_runtime and not is_ragged:
                size = max(prop.array_length, 1)
                values = np.empty((len(items), size), ELEMENT_TYPES[prop.type])
                items.foreach_get(prop.identifier, values.ravel())
                self.found[f"{path}[*].{prop.identifier}"] = Column(values)
            else:
                single.append(prop)
        for index, item in enumerate(items):
            for prop in single:
                self.value(item, prop, f"{path}[{index}].{prop.identifier}")
            self.custom(item, f"{path}[{index}]")

    def pointer(self, value: object, path: str) -> None:
        if isinstance(value, bpy.types.ID) and not getattr(value, "is_embedded_data", False):
            self.found[path] = f"{type(value).__name__} {value.name_full}"
        elif isinstance(value, bpy.types.bpy_struct):
            if value.id_data is not None and value.id_data != self.owner and not _embedded(value.id_data):
                self.found[path] = f"{type(value).__name__} in {value.id_data.name_full}"
            else:
                self.struct(value, path)
        else:
            self.found[path] = repr(value)

    def custom(self, data: bpy.types.bpy_struct, path: str) -> None:
        try:
            items = [(key, value) for key, value in data.items() if key != "token"]
        except (AttributeError, TypeError):
            return
        for name, value in items:
            self.found[f"{path}[{name!r}]"] = repr(_plain(value))


def _plain(value: object) -> object:
    """A custom property without the addresses in Blender's text for it."""
    if hasattr(value, "to_dict"):
        return {name: _plain(item) for name, item in value.items() if name != "token"}
    if hasattr(value, "to_list"):
        return value.to_list()
    return [_plain(item) for item in value] if isinstance(value, list) else value


def _embedded(block: bpy.types.ID) -> bool:
    return bool(getattr(block, "is_embedded_data", False))


def _flat(value: object) -> list[object]:
    return [x for row in value for x in _flat(row)] if hasattr(value, "__len__") else [repr(value)]
