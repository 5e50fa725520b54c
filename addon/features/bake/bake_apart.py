# SPDX-License-Identifier: GPL-3.0-or-later
"""Exports in a second Blender, for use in a window: Blender's exporters process all frames in one call, which
redraws nothing and cannot be stopped. A process can be stopped.

The second Blender opens a copy of the open file, saved beside the output, and runs bake_export there.
"""

import shutil
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy

from ...base.errors import SinewError
from ...base.output import remove, sentence
from ...blender_process import BlenderLost, BlenderProcess, Limits
from ...io import files
from .bake_export import SceneExport


def sample(started: SceneExport) -> Generator[float, None, None]:
    """Replaces started.sample(): yields the progress, 0 to 1, several times a second."""
    task = {
        "command": "export",
        "kind": started.kind,
        "frames": list(started.frames),
        "objects": [obj.name for obj in started.meshes],
    }
    with started.whole_or_nothing():
        yield from follow(task, started.path)


def follow(task: dict, path: Path) -> Generator[float, None, dict]:
    """Has the second Blender do a task that writes `path`; yields the progress, 0 to 1, and returns the
    outcome. If closed, or on an error, it ends that Blender and removes its files."""
    images = [image for image in bpy.data.images if image.source != "VIEWER" and image.users]
    painted = [image.name for image in images if image.is_dirty]
    if painted:
        raise SinewError(f"{', '.join(painted)}: painted and not saved; save or pack it first")
    share, outcome = 0.0, {}
    task |= {
        "scene": bpy.context.scene.name,
        "view_layer": bpy.context.view_layer.name,
        # The same as in this Blender.
        "scripts": not bpy.app.autoexec_fail,
        "target": str(path),
    }
    with _copy(path) as copy:
        blender = BlenderProcess(Limits(), wait=False)
        try:
            for outcome in blender.follow({**task, "source": str(copy)}, Limits()):
                share = (outcome or {}).get("share", share)
                yield share
        except BlenderLost as lost:
            raise SinewError(f"{path}: can not be written: {lost}") from None
        finally:
            # It has finished, or is not wanted any more.
            blender.end()
        if "error" in outcome:
            raise SinewError(outcome["error"])
    return outcome


def open_copy(task: dict, report: Callable[..., None]) -> list[bpy.types.Object]:
    """Runs in the second Blender: opens the copy of follow(); returns the task's objects."""
    report("opening it")
    files.open_file(Path(task["source"]), load_ui=True, scripts=task["scripts"])
    window = bpy.context.window
    window.scene = bpy.data.scenes[task["scene"]]
    window.view_layer = window.scene.view_layers[task["view_layer"]]
    return [bpy.data.objects[name, None] for name in task["objects"]]


def export(task: dict, report: Callable[..., None]) -> dict:
    """Runs in the second Blender: exports the objects of a task of sample(), and reports the progress."""
    meshes = open_copy(task, report)
    started = SceneExport(meshes, task["kind"], task["frames"], Path(task["target"]))
    started.report_progress = lambda share: report("exporting it", share=share)
    for share in started.sample():
        started.report_progress(share)
    return {}


@contextmanager
def _copy(path: Path) -> Iterator[Path]:
    """Context with a copy of the open file as it is now, saved beside the output."""
    copy = path.with_name(f".{path.stem}.unfinished.blend")
    files.save_beside(None, path, copy)
    link = copy.with_name(f"blendcache_{copy.stem}")
    try:
        _link_caches(link)
        yield copy
    finally:
        _remove_caches(link)
        remove(copy)


def _link_caches(link: Path) -> None:
    """Makes the disk caches of simulations available to the copy: they are found by the name of the file."""
    if not bpy.data.filepath:
        # The file was imported, and never saved.
        return
    source = Path(bpy.data.filepath)
    caches = source.with_name(f"blendcache_{source.stem}").absolute()
    if not caches.is_dir():
        return
    try:
        link.symlink_to(caches, target_is_directory=True)
    except OSError:
        # On Windows, few users may create links.
        try:
            shutil.copytree(caches, link)
        except OSError as error:
            raise SinewError(f"{caches}: a copy of the file can not use it: {sentence(error)}") from None


def _remove_caches(link: Path) -> None:
    if link.is_dir() and not link.is_symlink():
        shutil.rmtree(link, ignore_errors=True)
    else:
        remove(link)
