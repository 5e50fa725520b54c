# SPDX-License-Identifier: GPL-3.0-or-later
"""An export in a second Blender, for the window: Blender's exporters take all frames in one call, which draws
nothing and can not be stopped. A process can be.

It opens a copy of the open file, saved beside what is written, and does there what bake_export does here.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy

from ...blender_process import BlenderLost, BlenderProcess, Limits
from ...core.errors import SinewError
from ...core.output import remove, sentence
from ...io import files
from . import bake, bake_export

Export = bake_export.SceneExport | bake_export.MorphExport


def sample(started: Export) -> Generator[float, None, None]:
    """In the place of started.sample(): how much is done, 0 to 1, several times a second. Closed or failing,
    it ends the second Blender and leaves nothing behind."""
    images = [image for image in bpy.data.images if image.source != "VIEWER" and image.users]
    painted = [image.name for image in images if image.is_dirty]
    if painted:
        raise SinewError(f"{', '.join(painted)}: painted and not saved; save or pack it first")
    share, outcome = 0.0, None
    try:
        with _copy(started) as copy:
            blender = BlenderProcess(Limits(), wait=False)
            try:
                for outcome in blender.follow(_task(started, copy), Limits()):
                    share = (outcome or {}).get("share", share)
                    yield share
            finally:
                # Its work is done or not wanted.
                blender.end()
        if "error" in outcome:
            raise SinewError(outcome["error"])
    except BlenderLost as lost:
        started.discard()
        raise SinewError(f"{started.path}: can not be written: {lost}") from None
    except BaseException:
        started.discard()
        raise


def export(task: dict, report: Callable[..., None]) -> dict:
    """In the second Blender: exports the objects of a task of _task(), and tells how far it is."""
    report("opening it")
    files.open_file(Path(task["source"]), load_ui=True, scripts=task["scripts"])
    window = bpy.context.window
    window.scene = bpy.data.scenes[task["scene"]]
    window.view_layer = window.scene.view_layers[task["view_layer"]]
    meshes = [bpy.data.objects[name, None] for name in task["objects"]]
    started = bake.start(meshes, task["kind"], task["frames"], Path(task["target"]), overwrite=True)
    started.told = lambda share: report("exporting it", share=share)
    for share in started.sample():
        started.told(share)
    return {}


def _task(started: Export, copy: Path) -> dict:
    return {
        "command": "export",
        "source": str(copy),
        "target": str(started.path),
        "kind": started.kind,
        "frames": list(started.frames),
        "objects": [obj.name for obj in started.meshes],
        "scene": bpy.context.scene.name,
        "view_layer": bpy.context.view_layer.name,
        # As they do here.
        "scripts": not bpy.app.autoexec_fail,
    }


@contextmanager
def _copy(started: Export) -> Iterator[Path]:
    """The open file as it is now, saved beside what is written."""
    copy = started.unfinished.with_suffix(".blend")
    with started.whole_in_a_copy():
        files.save_beside(None, started.path, copy)
    link = copy.with_name(f"blendcache_{copy.stem}")
    try:
        _link_caches(link)
        yield copy
    finally:
        _remove_caches(link)
        remove(copy)


def _link_caches(link: Path) -> None:
    """Simulations look for their caches on disk by the name of the file."""
    if not bpy.data.filepath:
        # Imported, and never saved.
        return
    source = Path(bpy.data.filepath)
    caches = source.with_name(f"blendcache_{source.stem}").absolute()
    if not caches.is_dir():
        return
    try:
        link.symlink_to(caches, target_is_directory=True)
    except OSError:
        # Windows lets few users make links.
        try:
            shutil.copytree(caches, link)
        except OSError as error:
            raise SinewError(f"{caches}: a copy of the file can not use it: {sentence(error)}") from None


def _remove_caches(link: Path) -> None:
    if link.is_dir() and not link.is_symlink():
        shutil.rmtree(link, ignore_errors=True)
    else:
        remove(link)
