# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes a file for engines with Blender's own exporters, and verifies what it plays: for `sinew export`, and
for the panel in a second Blender, as it changes the open file."""

from __future__ import annotations

import errno
import io
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stderr
from dataclasses import asdict, dataclass
from pathlib import Path

import bpy

from ...attach import attach
from ...core.bake import is_whole
from ...core.errors import SinewError
from ...core.export_check import FRAMES, Check, spread_frames
from ...core.output import write_whole
from ...core.segment_bones import SegmentReport
from ...deform import characters
from ...io import files
from ..bake import bake_apart, bake_bones
from ..bake.bake_export import TEXTURES_STAY
from . import export, verify


@dataclass(frozen=True)
class ExportOptions:
    """
    influences  .glb: of a vertex, at most
    verify      say how far the file plays from what is seen
    frames      to verify; None for some of the scene's
    """

    influences: int = 4
    verify: bool = False
    frames: Sequence[float] | None = None


@dataclass
class Written:
    """
    bendy     of each armature with bendy bones
    checks    of each mesh that is verified
    left_out  a sentence for each mesh that the file does not have as it should
    """

    bendy: list[SegmentReport]
    checks: list[Check]
    left_out: list[str]


def _no_report(_share: float) -> None:
    pass


def write(
    path: Path,
    skinned: list[bpy.types.Object],
    options: ExportOptions,
    report: Callable[[float], None] = _no_report,
) -> Written:
    """Writes the scene; the open file is changed for it.

    skinned  the meshes that Sinew deforms
    report   called with the progress, 0 to 1
    """
    scene, kind = bpy.context.scene, path.suffix.lower()
    is_gltf = kind == ".glb"
    influences = options.influences if is_gltf else 0
    recording = None
    if options.verify:
        frames, between = spread_frames(scene.frame_start, scene.frame_end, FRAMES)
        if options.frames is not None:
            frames, between = sorted(set(options.frames)), []
        recording = verify.Recording(skinned, frames, between, influences, kind, report)
    whole = range(scene.frame_start, scene.frame_end + 1)
    bendy, segments, left_out = bake_bones.replace_bendy_bones(skinned, whole, influences)
    if is_gltf:
        scene.sinew_gltf.skinning = True
    else:
        # Exporters know Armature modifiers, and shape keys where there are no others.
        for obj in skinned:
            attach.take_off(obj)
    with _known_to_exporters():
        try:
            write_whole(path, lambda unfinished: _write(unfinished, options.influences))
        except RuntimeError as error:
            # The exporter's error, with everything that Blender printed.
            raise SinewError(f"{path}: can not be written: {files.telling_line(error)}") from None
    report(0.9)
    checks = []
    if recording is not None:
        checks = recording.verify(path, segments)
        left_out += recording.left_out
    if is_gltf:
        left_out += export.left_out()
    return Written(bendy, checks, left_out)


def write_apart(task: dict, report: Callable[..., None]) -> dict:
    """Runs in the second Blender: the task of the operator."""
    skinned = bake_apart.open_copy(task, report)
    options = ExportOptions(**task["options"])
    # Blender does not evaluate hidden objects.
    with characters.shown(skinned):
        path = Path(task["target"])
        done = write(path, skinned, options, lambda share: report("exporting it", share=share))
    return {
        "bendy": [asdict(each) for each in done.bendy],
        "checks": [asdict(check) for check in done.checks],
        "left_out": done.left_out,
    }


def _write(path: Path, influences: int) -> None:
    # If the exporter fails, Blender prints a traceback and raises it as an error.
    with redirect_stderr(io.StringIO()):
        _WRITERS[path.suffix.lower()](str(path), influences)
    kind = {".glb": "gltf", ".usdc": "usd"}.get(path.suffix.lower())
    if kind is not None and not is_whole(path, kind):
        raise OSError(errno.ENOSPC, "the disk did not take all of it; is it full?")


def _gltf(path: str, influences: int) -> None:
    bpy.ops.export_scene.gltf(filepath=path, export_format="GLB", export_influence_nb=influences)


def _usd(path: str, _influences: int) -> None:
    bpy.ops.wm.usd_export(
        filepath=path,
        check_existing=False,
        export_animation=True,
        export_armatures=True,
        only_deform_bones=False,
        export_shapekeys=True,
        **TEXTURES_STAY,
    )


def _fbx(path: str, _influences: int) -> None:
    bpy.ops.export_scene.fbx(
        filepath=path,
        check_existing=False,
        use_mesh_modifiers=False,
        add_leaf_bones=False,
        bake_anim_simplify_factor=0.0,
    )


_WRITERS: dict[str, Callable[[str, int], None]] = {".glb": _gltf, ".usdc": _usd, ".fbx": _fbx}


@contextmanager
def _known_to_exporters() -> Iterator[None]:
    """Exporters search for extensions among the enabled ones, which do not include Sinew with bpy as a
    module."""
    module = __package__.rpartition(".features")[0]
    addons = bpy.context.preferences.addons
    if module in addons:
        yield
        return
    entry = addons.new()
    entry.module = module
    try:
        yield
    finally:
        addons.remove(entry)
