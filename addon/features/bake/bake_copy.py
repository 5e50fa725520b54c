# SPDX-License-Identifier: GPL-3.0-or-later
"""The bakes that a batch writes beside a re-skinned copy."""

from dataclasses import asdict
from pathlib import Path

import bpy

from ...attach import properties
from ...core.bake import EXPORTS, KINDS, bake_path
from ...core.errors import SinewError
from ...core.frames import parse_frames
from ...core.names import fits
from ...deform import characters
from ...io import files
from . import bake
from .bake_bones import BoneBake
from .bake_state import Started


def bake_copy(task: dict, copy: Path, meshes: set[str]) -> dict:
    """Opens a copy that is saved beside its target, and bakes those `meshes` that the settings select:
    exports to files of their own, everything else to one .blend with its caches.

    task  as for reskin.reskin; "overwrite": whether existing files may be replaced; "ours": paths that may
          always be

    Returns "bakes": the kind and the objects of each; "beside": where each file is, and where it has to be
    moved. Raises SinewError, and removes all files, if one fails.
    """
    source, target, settings = Path(task["source"]), Path(task["target"]), task["settings"]
    files.open_file(copy, load_ui=True)
    scene = bpy.context.scene
    typed = settings["bake_frames"]
    frames = sorted(set(parse_frames(typed))) if typed else range(scene.frame_start, scene.frame_end + 1)
    beside: list[tuple[Path, Path]] = []
    started: list[Started] = []
    in_file: list[Started] = []
    bakes = []
    try:
        wanted = _wanted(settings, meshes)
        with characters.shown([obj for objects in wanted.values() for obj in objects]):
            for kind, objects in wanted.items():
                path = bake_path(target, kind)
                names = [obj.name for obj in objects]
                bakes.append({"to": kind, "objects": names, "frames": len(frames), "file": path.name})
                overwrite = task["overwrite"] or bool(task["ours"])
                one = bake.start(objects, kind, frames, path, overwrite)
                started.append(one)
                _check_free(one.files, task)
                for _part in one.sample():
                    pass
                if isinstance(one, BoneBake):
                    bakes[-1]["bones"] = [asdict(report) for report in one.reports]
                beside += one.files
                if kind not in EXPORTS:
                    in_file.append(one)
        if in_file:
            path = bake_path(target, "shape-keys")
            pair = (copy.with_name(copy.name.replace(".unfinished", "-baked.unfinished", 1)), path)
            _check_free([pair], task)
            for one in in_file:
                one.place()
            files.save_beside(source, path, pair[0])
            beside.append(pair)
    except SinewError as error:
        for one in started:
            one.discard()
        raise SinewError(f"{source}: bake: {error}; nothing written") from None
    return {"bakes": bakes, "beside": [[str(unfinished), str(path)] for unfinished, path in beside]}


def _wanted(settings: dict, meshes: set[str]) -> dict[str, list[bpy.types.Object]]:
    """Returns the objects for each kind of bake in the settings."""
    there = [obj for obj in bpy.data.objects if obj.name in meshes and properties.has_sinew(obj)]
    wanted = {kind: [obj for obj in there if kind in _kinds_of(obj, settings)] for kind in KINDS}
    in_scene = set(bpy.context.scene.objects)
    for objects in wanted.values():
        for obj in objects:
            if obj not in in_scene:
                raise SinewError(f"{obj.name} is not in the scene {bpy.context.scene.name}")
    return {kind: objects for kind, objects in wanted.items() if objects}


def _kinds_of(obj: bpy.types.Object, settings: dict) -> list[str]:
    said = [r["bake"] for r in settings["objects"] if "bake" in r and fits(obj.name, r["match"])]
    return list(said[-1] if said else settings["bake"])


def _check_free(pairs: list[tuple[Path, Path]], task: dict) -> None:
    for _unfinished, path in pairs:
        files.check_free(path, task["overwrite"] or str(path) in task["ours"])
