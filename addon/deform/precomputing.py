# SPDX-License-Identifier: GPL-3.0-or-later
"""Requests what methods need computed before their first frame, and takes the results.

In a window it is computed while the artist works; meanwhile the object has its Armature modifier's shape, or
the shape from the data of the mesh before it changed. Scripts, commands and renders wait for it instead.
"""

import contextlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path

import bpy
import numpy as np
import sinew

from ..attach import properties, stage_settings, stored_vertex_data
from ..attach.subscribers import notify, subscribers
from ..attach.updates import is_main_thread
from ..base.errors import SinewError
from ..base.file_cache import FileCache
from ..base.phrases import phrase
from ..io import addon_preferences, spaces
from ..skinning.precompute import precomputations
from ..skinning.vectors import SAME_SPACE
from ..skinning.vertex_data import PROVIDERS, VertexData
from .bound import is_method_animated, methods_of
from .skinned_object import SkinnedObject

VARIABLE = "SINEW_CACHE"
# For all files in the folder: about a hundred characters of 100,000 vertices under three methods.
CACHE_BYTES = 512 * 2**20
# For one mesh in the .blend file.
MOST_BYTES_IN_FILE = 16 * 2**20


def request(obj: bpy.types.Object, skinned: SkinnedObject, depsgraph: bpy.types.Depsgraph) -> None:
    """Loads or computes what the object's methods need. Where there is data of the mesh before it changed,
    the watcher has it computed again once the artist pauses."""
    is_requested = False
    for armature, data, method in _needed(obj, skinned):
        if data.is_current(method):
            continue
        is_requested = True
        if precomputations.blocks or not data.has(method):
            _request(obj, armature, data, method, depsgraph)
    if is_requested and not precomputations.blocks and is_main_thread():
        notify(subscribers.precomputation_requested)


def request_outdated(
    obj: bpy.types.Object, skinned: SkinnedObject, depsgraph: bpy.types.Depsgraph, before: float
) -> bool:
    """Starts to compute again the data that belongs to the mesh before it changed. Returns whether there is
    any.

    before  time.monotonic(): only for meshes that were read before it
    """
    is_there = False
    for armature, data, method in _needed(obj, skinned):
        if data.has(method) and not data.is_current(method) and not data.is_stopped(method):
            is_there = True
            if data.read_at < before:
                _request(obj, armature, data, method, depsgraph)
    return is_there


def has_all(obj: bpy.types.Object, skinned: SkinnedObject) -> bool:
    """Whether the data that its methods need is there, for the mesh as it is now."""
    return all(data.is_current(method) for _armature, data, method in _needed(obj, skinned))


def take_results(obj: bpy.types.Object, skinned: SkinnedObject) -> bool:
    """Takes finished results. Returns whether a computation for the object has ended."""
    has_ended = False
    for _armature, data, method in _needed(obj, skinned):
        try:
            has_ended |= data.take_result(method)
        except Exception as error:
            what = phrase(PROVIDERS[method].what)
            skinned.evaluation.user_error = SinewError(
                f"{obj.name}: its {what} can not be found: {type(error).__name__}: {error}; press Rebind, or "
                "Remove"
            )
            has_ended = True
    return has_ended


def running(obj: bpy.types.Object, skinned: SkinnedObject) -> dict[str, sinew.Precomputation]:
    """Returns what is being computed for the object now, by its name in the panel."""
    runs = ((PROVIDERS[method].what, data.running(method)) for _arm, data, method in _needed(obj, skinned))
    return {what: run for what, run in runs if run is not None}


def stopped(obj: bpy.types.Object, skinned: SkinnedObject) -> list[str]:
    """Returns what the artist has stopped, by its name in the panel."""
    found = (PROVIDERS[m].what for _armature, data, m in _needed(obj, skinned) if data.is_stopped(m))
    return list(dict.fromkeys(found))


def lacking(obj: bpy.types.Object, skinned: SkinnedObject | None) -> str:
    """Returns what its methods need and lack, as a clause for the panel; empty where they lack nothing."""
    if skinned is None:
        return ""
    missing = [(data, method) for _armature, data, method in _needed(obj, skinned) if not data.has(method)]
    if not missing:
        return ""
    data, method = missing[0]
    what = phrase(PROVIDERS[method].what)
    if data.is_stopped(method):
        text = "Without its {what} it has the Armature modifier's shape: finding them was stopped"
        return phrase(text, what=what)
    return phrase("It has the Armature modifier's shape until its {what} are found", what=what)


def store_in_meshes(pairs: list[tuple[bpy.types.Object, SkinnedObject | None]]) -> None:
    """Stores the data that objects use in their meshes, before the file is saved.

    pairs  all objects that have Sinew; None where nothing is known of one now: its mesh keeps what it has
    """
    of_meshes: dict[bpy.types.Mesh, dict[str, np.ndarray] | None] = {}
    for obj, skinned in pairs:
        mesh = obj.data
        if properties.is_copy(obj):
            # A copy is removed with its comparison, and its mesh belongs to the original.
            continue
        if skinned is None:
            of_meshes[mesh] = None
        elif of_meshes.setdefault(mesh, {}) is not None:
            for _armature, data, method in _needed(obj, skinned):
                of_meshes[mesh].update([data.made[method]] if method in data.made else [])
    for mesh, made in of_meshes.items():
        if made is not None:
            small = sum(array.nbytes for array in made.values()) <= MOST_BYTES_IN_FILE
            stored_vertex_data.write(mesh, made if small else {})


@contextlib.contextmanager
def blocking() -> Iterator[None]:
    """Context in which results are waited for."""
    before, precomputations.blocks = precomputations.blocks, True
    try:
        yield
    finally:
        precomputations.blocks = before


def begin() -> None:
    """Called on registration."""
    precomputations.blocks = bpy.app.background
    open_cache()


def open_cache() -> None:
    """Opens the cache in the folder that the environment or else the preferences name."""
    folder = _cache_folder()
    precomputations.cache = None if folder is None else FileCache(folder, CACHE_BYTES)


def _needed(obj: bpy.types.Object, skinned: SkinnedObject) -> list[tuple[bpy.types.Object, VertexData, str]]:
    """Returns the armature, the data and the method for each Armature modifier and each method with vertex
    data."""
    found = []
    methods = methods_of(obj)
    replaced_modifiers = properties.of(obj).replaced_modifiers
    for skin, replaced in zip(skinned.bound.skin_stack.skins, replaced_modifiers, strict=False):
        data = skin.deformer.vertex_data
        if data is None or replaced.armature is None or not skin.deformer.bones.names:
            continue
        for name in methods:
            data.take_parameters(name, stage_settings.method_values(properties.of(obj), (name,)))
        names = [*methods, *(data.missed if data.missed and is_method_animated(obj) else ())]
        found += [(replaced.armature, data, name) for name in dict.fromkeys(names) if name in PROVIDERS]
    return found


def _request(
    obj: bpy.types.Object,
    armature: bpy.types.Object,
    data: VertexData,
    method: str,
    depsgraph: bpy.types.Depsgraph,
) -> None:
    space = SAME_SPACE
    if data.weighting.depends_on_points:
        found = spaces.bones_from_model_in(depsgraph, obj, armature)
        if found is None:
            # An armature can be scaled to zero for a moment.
            return
        space = found
    if data.triangles is not None:
        data.request(method, space)


def _cache_folder() -> Path | None:
    """Returns the named folder; else that of the extension, or of the user where Sinew is a Python package;
    None for no cache."""
    given = os.environ.get(VARIABLE)
    if given is not None:
        return Path(given) if given not in ("", "0") else None
    chosen = addon_preferences.value("cache_folder", default="")
    if chosen:
        return Path(bpy.path.abspath(chosen))
    with contextlib.suppress(ValueError, OSError):
        return Path(bpy.utils.extension_path_user(addon_preferences.ADDON, path="cache"))
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA")
    elif sys.platform == "darwin":
        base = str(Path.home() / "Library" / "Caches")
    else:
        base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base) / "sinew" if base else None
