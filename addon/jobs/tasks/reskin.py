# SPDX-License-Identifier: GPL-3.0-or-later
"""A batch's task for one file: puts Sinew on its meshes, or takes it off, saves a copy, and returns the
outcome."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import bpy
import numpy as np

from ...attach import attach, properties, stack
from ...attach.updates import updates_suspended
from ...base.errors import SinewError
from ...base.frames import parse_frames
from ...base.names import fits
from ...deform import characters, lifecycle, session, survey
from ...features.compare import comparison
from ...features.pages import render
from ...features.pages.views import seen_extent, whole_view
from ...io import files
from ...skinning import parameters

# Twice the size in the report.
PICTURE_SIZE = 720
# The number of frames that are compared if none are given.
SAMPLES = 9


class _Clock:
    """Reports what is being done, and records how long it took."""

    def __init__(self, report: Callable[[str], None]) -> None:
        self.seconds: dict[str, float] = {}
        self._report = report

    @contextmanager
    def doing(self, name: str) -> Iterator[None]:
        self._report(f"{name} it")
        started = time.perf_counter()
        yield
        self.seconds[name] = round(time.perf_counter() - started, 6)


def reskin(task: dict, report: Callable[[str], None]) -> dict:
    """Saves a copy in which Sinew deforms the meshes selected by the settings, then compares both files.

    task  "source", "target" and "unfinished" (where to save): paths; "settings" as from
          jobs.job_file.Settings; "frames" to compare at ("auto", "none", or as typed); "pictures": the
          beginning of two pictures' paths, or None; "engine" to draw them, found out where it is missing

    Raises SinewError, and saves nothing, where Sinew can deform no mesh.
    """
    source, settings, clock = Path(task["source"]), task["settings"], _Clock(report)
    notes = _open(source, clock)
    with clock.doing("deforming"):
        skinned, left_out = _use_sinew(_meant(settings, source), settings)
    notes += characters.sentences()
    if not skinned:
        raise SinewError(f"{source}: {left_out.pop()}; nothing written")
    with clock.doing("saving"), updates_suspended():
        files.save_beside(source, Path(task["target"]), Path(task["unfinished"]))
    outcome = {
        "meshes": [mesh for _obj, mesh in skinned],
        "left_out": left_out,
        "notes": notes,
        "seconds": clock.seconds,
    }
    if task["frames"] != "none":
        _compare(task, skinned, outcome, clock)
    return outcome


def restore(task: dict, report: Callable[[str], None]) -> dict:
    """Saves a copy without Sinew, with its original Armature modifiers. Takes the same task as reskin().

    Raises SinewError, and saves nothing, where no mesh has Sinew.
    """
    source, settings, clock = Path(task["source"]), task["settings"], _Clock(report)
    notes = _open(source, clock)
    with clock.doing("restoring"):
        comparison.end(bpy.context)
        skinned = [obj for obj in bpy.data.objects if properties.has_sinew(obj) and _is_meant(obj, settings)]
        meshes, left_out = [], []
        for obj in skinned:
            if not obj.is_editable:
                left_out.append(f"{obj.name} is linked from another file; restore that one")
                continue
            method = properties.of(obj).method
            try:
                attach.remove(obj)
            except SinewError as error:
                left_out.append(str(error))
                continue
            meshes.append({"object": obj.name, "method": method, "warnings": []})
    if not meshes:
        reason = left_out.pop() if left_out else "no mesh is deformed by Sinew"
        raise SinewError(f"{source}: {reason}; nothing written")
    with clock.doing("saving"):
        files.save_beside(source, Path(task["target"]), Path(task["unfinished"]))
    return {"meshes": meshes, "left_out": left_out, "notes": notes, "seconds": clock.seconds}


def _use_sinew(
    objects: list[bpy.types.Object], settings: dict
) -> tuple[list[tuple[bpy.types.Object, dict]], list[str]]:
    """Puts Sinew on meshes. Returns each with its facts for the report, and why others were not changed."""
    before = [(_described(obj), properties.has_sinew(obj)) for obj in objects]
    wanted = [(obj, _setting_of(obj, settings, "method")) for obj in objects]
    scales = {obj: _setting_of(obj, settings, "scale") for obj in objects}
    values = {obj: _parameters_of(obj, settings) for obj in objects}
    skinned, left_out = [], []
    for (obj, _method), (way, had_sinew), error in zip(
        wanted, before, characters.use_methods_for_file(wanted, scales, values), strict=True
    ):
        if error is not None:
            left_out.append(str(error))
            if properties.has_sinew(obj) and not had_sinew:
                attach.remove(obj)
            continue
        state = session.skinned_of(obj)
        mesh = {
            "object": obj.name,
            "vertices": len(obj.data.vertices),
            "before": way,
            "method": properties.of(obj).method,
            "scale": properties.of(obj).scale_rule,
            "warnings": [
                *(survey.facts_of(obj, state).warnings if state is not None else ()),
                # What else deforms the mesh than Sinew, and what was found switched off.
                *(*session.plan_of(obj).view_reasons, *attach.notes(obj)),
            ],
        }
        skinned.append((obj, mesh))
    return skinned, left_out


def _meant(settings: dict, source: Path) -> list[bpy.types.Object]:
    """Returns the file's armature-deformed meshes that the settings select. Raises SinewError where there are
    none."""
    # The originals of library overrides are in the file as well, linked, and do not matter.
    overridden = {obj.override_library.reference for obj in bpy.data.objects if obj.override_library}
    deformed = attach.deformed_meshes([obj for obj in bpy.data.objects if obj not in overridden])
    if not deformed:
        raise SinewError(f"{source}: no mesh is deformed by an armature; nothing written")
    meant = [obj for obj in deformed if _is_meant(obj, settings)]
    if not meant:
        raise SinewError(
            f"{source}: none of its {len(deformed)} armature-deformed meshes is included; nothing written"
        )
    return meant


def _is_meant(obj: bpy.types.Object, settings: dict) -> bool:
    """Whether it is included, or nothing is, and not excluded: by its own name, or that of a collection that
    it is in."""
    include, exclude = settings["include"], settings["exclude"]
    if not include and not exclude:
        return True
    names = [obj.name, *(c.name for c in bpy.data.collections if obj in c.all_objects[:])]

    def is_one_of(patterns: list[str]) -> bool:
        return any(fits(name, pattern) for name in names for pattern in patterns)

    return (not include or is_one_of(include)) and not is_one_of(exclude)


def _setting_of(obj: bpy.types.Object, settings: dict, key: str) -> str | None:
    """Returns the value in the last rule for the object, or else in the settings for all."""
    rules = settings["objects"]
    said = [rule[key] for rule in rules if key in rule and fits(obj.name, rule["match"])]
    return said[-1] if said else settings[key]


def _parameters_of(obj: bpy.types.Object, settings: dict) -> dict[str, parameters.Value]:
    """Returns the parameters for all, and those of each rule for the object; later ones override earlier
    ones."""
    rules = [rule["set"] for rule in settings["objects"] if "set" in rule and fits(obj.name, rule["match"])]
    return parameters.parse(text for texts in (settings["set"], *rules) for text in texts)


def _described(obj: bpy.types.Object) -> str:
    """Returns how a mesh was deformed before."""
    if properties.has_sinew(obj):
        return f"Sinew, {properties.of(obj).method}"
    modifiers = stack.armature_modifiers(obj)
    if not modifiers:
        return f"parent {obj.parent.name}, linear blend"
    ways = ("linear blend", "Preserve Volume")
    return "; ".join(f"{m.name}, {ways[m.use_deform_preserve_volume]}" for m in modifiers)


def _open(source: Path, clock: _Clock) -> list[str]:
    """Opens the file. Returns notes about it for the user of the copy."""
    with clock.doing("opening"):
        notes = files.open_file(source, load_ui=True)
    # The third number of a file's version is that of its format, not of a release.
    written, running = tuple(bpy.data.version)[:2], bpy.app.version[:2]
    if written != running:
        age = "a newer" if written > running else "an older"
        notes.append(
            f"written by {age} Blender, {_dotted(written)}; the copy is one of {_dotted(running)}: features "
            "that only the other knows may be lost"
        )
    notes += [
        f"library {library.filepath} is missing: what it links stays linked, and is not shown"
        for library in bpy.data.libraries
        # All are relative to the open file, also those that a library links.
        if not Path(bpy.path.abspath(library.filepath)).exists()
    ]
    return notes


def _dotted(version: tuple[int, ...]) -> str:
    return ".".join(map(str, version))


def _compare(task: dict, skinned: list[tuple[bpy.types.Object, dict]], outcome: dict, clock: _Clock) -> None:
    """Adds to the outcome how far each mesh is from its Armature modifier's shape at most, and a picture of
    both at the worst frame. The open file must not be used afterwards: the copy is saved by now."""
    scene = bpy.context.scene
    shown = [(obj, mesh) for obj, mesh in skinned if obj in scene.objects[:]]
    if not shown:
        outcome["notes"].append(f"no mesh is in the scene {scene.name}: nothing compared")
        return
    objects = [obj for obj, _mesh in shown]
    with clock.doing("comparing"):
        lifecycle.resume_after_save(bpy.context)
        characters.show(objects)
        frames = _frames(task["frames"], scene)
        ours = [_points(scene, objects, frame) for frame in frames]
        characters.use_methods([(obj, characters.BLENDER) for obj in objects])
        theirs = [_points(scene, objects, frame) for frame in frames]
        worst = max(
            _deviation(mesh, frames, [p[i] for p in ours], [p[i] for p in theirs])
            for i, (_obj, mesh) in enumerate(shown)
        )[1]
    if task["pictures"] is not None:
        with clock.doing("drawing"):
            engine = task.get("engine") or _engine()
            outcome["pictures"] = _draw(scene, shown, worst, engine, Path(task["pictures"]))


def _deviation(
    mesh: dict, frames: list[float], ours: list[np.ndarray], theirs: list[np.ndarray]
) -> tuple[float, float]:
    """Adds to a mesh's facts how far `ours` is from `theirs` at most, given as points for each frame. Returns
    that as a share of the mesh's diagonal, and the frame."""
    if any(a.shape != b.shape for a, b in zip(ours, theirs, strict=True)):
        mesh["warnings"].append("a modifier behind changes the number of vertices: not compared")
        return 0.0, frames[0]
    between = [a - b for a, b in zip(ours, theirs, strict=True)]
    distances = [float(np.sqrt(np.einsum("ij,ij->i", d, d).max(initial=0.0))) for d in between]
    index = int(np.argmax(distances))
    diagonal = float(np.linalg.norm(np.ptp(theirs[index], axis=0))) if len(theirs[index]) else 0.0
    part = distances[index] / diagonal if diagonal else 0.0
    mesh.update(deviation=distances[index], deviation_part=part, frame=frames[index])
    return part, frames[index]


def _frames(wanted: str, scene: bpy.types.Scene) -> list[float]:
    if wanted != "auto":
        return parse_frames(wanted)
    return sorted({round(f) for f in np.linspace(scene.frame_start, scene.frame_end, SAMPLES)})


def _points(scene: bpy.types.Scene, objects: list[bpy.types.Object], frame: float) -> list[np.ndarray]:
    characters.set_frame(scene, frame)
    return [characters.final_points(obj) for obj in objects]


def _draw(
    scene: bpy.types.Scene,
    shown: list[tuple[bpy.types.Object, dict]],
    frame: float,
    engine: str,
    stem: Path,
) -> dict:
    """Draws the meshes under their Armature modifiers, which deform now, and under Sinew."""
    objects = [obj for obj, _mesh in shown]
    characters.set_frame(scene, frame)
    before = characters.world_points(objects)
    characters.use_methods([(obj, mesh["method"]) for obj, mesh in shown])
    view = whole_view([seen_extent(before), seen_extent(characters.world_points(objects))])
    stem.parent.mkdir(parents=True, exist_ok=True)
    paths = {name: stem.with_name(f"{stem.name}-{name}.png") for name in ("after", "before")}
    studio = render.Studio(scene, objects, engine, PICTURE_SIZE, halved=True)
    studio.picture(view, paths["after"])
    characters.use_methods([(obj, characters.BLENDER) for obj in objects])
    studio.picture(view, paths["before"])
    return {"frame": frame, **{name: path.name for name, path in paths.items()}}


@cache
def _engine() -> str:
    return render.chosen_engine("auto")
