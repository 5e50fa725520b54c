# SPDX-License-Identifier: GPL-3.0-or-later
"""What methods need computed before their first frame: asked for, and watched while a thread computes it.

In a window it is computed beside the artist's work; the object meanwhile has its Armature modifier's shape,
or the one by data of the mesh as it was. Scripts, commands and renders can not look later: they wait.
"""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path

import bpy
import numpy as np

from ..attach import properties, stage_settings, stored_vertex_data
from ..attach.subscribers import notify, subscribers
from ..attach.updates import is_main_thread
from ..core.errors import SinewError
from ..core.file_cache import FileCache
from ..core.phrases import phrase
from ..core.precompute import Precomputation, precomputations
from ..core.spaces import SAME_SPACE
from ..core.vertex_data import PROVIDERS, VertexData
from ..io import addon_preferences, armature_io
from .method_needs import is_method_animated, methods_of
from .skinned_object import SkinnedObject

VARIABLE = "SINEW_CACHE"
# Of all files in the folder: about a hundred characters of 100,000 vertices under three methods.
CACHE_BYTES = 512 * 2**20
# Of one mesh in the .blend file.
MOST_BYTES_IN_FILE = 16 * 2**20


def request(obj: bpy.types.Object, skinned: SkinnedObject, depsgraph: bpy.types.Depsgraph) -> None:
    """Has what the object's methods need found, or made. Where it is there for the mesh as it was, the
    watcher has it made anew once the artist pauses."""
    is_asked = False
    for armature, data, method in _needed(obj, skinned):
        if data.is_current(method):
            continue
        is_asked = True
        if precomputations.waits or not data.has(method):
            _request(obj, armature, data, method, depsgraph)
    if is_asked and not precomputations.waits and is_main_thread():
        notify(subscribers.precomputation_asked)


def request_outdated(
    obj: bpy.types.Object, skinned: SkinnedObject, depsgraph: bpy.types.Depsgraph, before: float
) -> bool:
    """Starts to make anew what belongs to the mesh as it was. Whether there is such data.

    before  of time.monotonic(): only of meshes that were read before
    """
    is_there = False
    for armature, data, method in _needed(obj, skinned):
        if data.has(method) and not data.is_current(method) and not data.is_stopped(method):
            is_there = True
            if data.read_at < before:
                _request(obj, armature, data, method, depsgraph)
    return is_there


def has_all(obj: bpy.types.Object, skinned: SkinnedObject) -> bool:
    """Whether the data that its methods need is there, of the mesh as it is."""
    return all(data.is_current(method) for _armature, data, method in _needed(obj, skinned))


def take_results(obj: bpy.types.Object, skinned: SkinnedObject) -> bool:
    """Whether what was computed for the object has come to an end."""
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


def running(obj: bpy.types.Object, skinned: SkinnedObject) -> dict[str, Precomputation]:
    """What is computed for the object now, by what people call it."""
    runs = ((PROVIDERS[method].what, data.running(method)) for _arm, data, method in _needed(obj, skinned))
    return {what: run for what, run in runs if run is not None}


def stopped(obj: bpy.types.Object, skinned: SkinnedObject) -> list[str]:
    """What the artist has stopped, as people call it."""
    found = (PROVIDERS[m].what for _armature, data, m in _needed(obj, skinned) if data.is_stopped(m))
    return list(dict.fromkeys(found))


def waits_for(obj: bpy.types.Object, skinned: SkinnedObject | None) -> str:
    """What its methods need and do not have, as a clause for the panel; empty where they have all."""
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
    """Before the file is saved: what objects use goes with their meshes.

    pairs  all objects that have Sinew; None for one of which nothing is known now: its mesh keeps what it has
    """
    of_meshes: dict[bpy.types.Mesh, dict[str, np.ndarray] | None] = {}
    for obj, skinned in pairs:
        mesh = obj.data
        if properties.is_copy(obj):
            # It goes with its comparison, and the mesh is the original's.
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
def waiting() -> Iterator[None]:
    """Inside, whoever needs a result waits for it."""
    before, precomputations.waits = precomputations.waits, True
    try:
        yield
    finally:
        precomputations.waits = before


def forget_stopped() -> None:
    """What the artist stopped may start again."""
    precomputations.stopped.clear()


def begin() -> None:
    """On registration."""
    precomputations.waits = bpy.app.background
    open_cache()


def open_cache() -> None:
    """In the folder that the environment, or else the preferences name."""
    folder = _cache_folder()
    precomputations.cache = None if folder is None else FileCache(folder, CACHE_BYTES)


def end() -> None:
    """Before Blender's data or Blender itself goes: no thread is at work any more."""
    precomputations.cancel_all()


def _needed(obj: bpy.types.Object, skinned: SkinnedObject) -> list[tuple[bpy.types.Object, VertexData, str]]:
    """The armature, the data and the method of each Armature modifier, for methods that keep something."""
    found = []
    methods = methods_of(obj)
    replaced_modifiers = properties.of(obj).replaced_modifiers
    for stage, replaced in zip(skinned.bound.skin_stack.skin_stages, replaced_modifiers, strict=False):
        data = stage.binding.vertex_data
        if data is None or replaced.armature is None or not stage.binding.bones.names:
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
        found = armature_io.bones_from_model(obj.evaluated_get(depsgraph), armature.evaluated_get(depsgraph))
        if found is None:
            # An armature scaled to nothing for a moment.
            return
        space = found
    if data.triangles is not None:
        data.request(method, space)


def _cache_folder() -> Path | None:
    """That of the extension where nobody names one, or of the user where Sinew is a package of Python's; None
    for none."""
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
