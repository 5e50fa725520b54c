# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes a file for engines with Blender's own exporters, and verifies what it plays: for `sinew export`, and
for the panel in a second Blender, as it changes the open file."""

from __future__ import annotations

import errno
import io
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, redirect_stderr
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import addon_utils
import bpy

from ...attach import attach, properties
from ...base.errors import SinewError
from ...base.output import write_whole
from ...deform import characters
from ...io import files
from ..bake import bake_apart, bake_bones
from ..bake.bake_export import TEXTURES_STAY
from ..bake.baked_files import is_whole
from ..bake.segment_bones import SegmentReport
from . import engine_weights, export, usd_scales, verify
from .export_check import FRAMES, Check, ExportOptions, plain, spread_frames
from .players import SHOWN

# What the add-on for VRM writes of a vertex.
_VRM_INFLUENCES = 4


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


def write(
    path: Path,
    skinned: list[bpy.types.Object],
    options: ExportOptions,
    report: Callable[[float], None] = lambda _share: None,
) -> Written:
    """Writes the scene; the open file is changed for it.

    skinned  the meshes that Sinew deforms
    report   called with the progress, 0 to 1
    """
    scene, kind = bpy.context.scene, path.suffix.lower()
    is_gltf = kind == ".glb"
    influences = {".glb": options.influences, ".vrm": _VRM_INFLUENCES}.get(kind, 0)
    recording = None
    if options.verify:
        frames, between = spread_frames(scene.frame_start, scene.frame_end, FRAMES)
        if options.frames is not None:
            frames, between = sorted(set(options.frames)), []
        if kind == ".vrm":
            between = []
        recording = verify.Recording(skinned, frames, between, influences, kind, report)
    whole = range(scene.frame_start, scene.frame_end + 1)
    # Nothing would move plain bones of a .vrm in the place of bendy ones.
    bendy, segments, left_out = bake_bones.replace_bendy_bones(
        skinned if kind != ".vrm" else [], whole, influences
    )
    left_out += engine_weights.prepare(skinned, kind)
    rigs = {properties.of(obj).armature.name for obj in skinned}
    if kind == ".usdc":
        _check_names(sorted(rigs))
    if is_gltf:
        scene.sinew_gltf.skinning = True
    else:
        # Exporters know Armature modifiers, and shape keys where there are no others.
        for obj in skinned:
            attach.take_off(obj)
    with tempfile.TemporaryDirectory() as folder:
        alone = Path(folder, "alone.fbx")
        with _known_to_exporters():
            try:
                if recording is not None and kind == ".fbx":
                    # Before the other actions leave values behind.
                    _fbx(str(alone), replace(options, clips=SHOWN))
                write_whole(path, lambda own: left_out.extend(_write(own, options, sorted(rigs))))
            except RuntimeError as error:
                # The exporter's error, with everything that Blender printed.
                raise SinewError(f"{path}: can not be written: {files.telling_line(error)}") from None
        report(0.9)
        checks = []
        if recording is not None:
            checks = recording.verify(path, segments)
            left_out += recording.left_out
            if alone.exists() and not all(check.is_explained for check in checks):
                only = {check.mesh: check for check in recording.verify(alone, segments)}
                checks = [check.without_actions(only[check.mesh]) for check in checks]
    if is_gltf:
        left_out += export.current.left_out
    return Written(bendy, checks, left_out)


def _check_names(rigs: list[str]) -> None:
    """Raises SinewError for bones that USD can not tell apart: all joints are lost then, with no word of the
    exporter's."""
    for rig in rigs:
        known: dict[tuple[str, str], str] = {}
        for bone in bpy.data.objects[rig].data.bones:
            other = known.setdefault((bone.parent.name if bone.parent else "", plain(bone.name)), bone.name)
            if other != bone.name:
                raise SinewError(
                    f"{rig}: the bones {other} and {bone.name} have one name in USD, where only letters, "
                    "digits and underscores count; rename one"
                )


def mirrored(skinned: list[bpy.types.Object]) -> list[str]:
    """A sentence for each mesh of the method `dq` with a bone that is mirrored now: where it blends with
    another, the dual quaternions of UsdSkel draw points together."""
    depsgraph, found = bpy.context.evaluated_depsgraph_get(), []
    for obj in skinned:
        rigs = properties.of(obj).armatures if properties.of(obj).method == "dq" else []
        for rig in rigs:
            bones = rig.evaluated_get(depsgraph).pose.bones
            names = [bone.name for bone in bones if bone.bone.use_deform and bone.matrix.determinant() < 0.0]
            if names:
                found.append(
                    f"{obj.name}: bones of {rig.name} are mirrored, such as {names[0]}: keep the file's "
                    "skinning method classicLinear, as UsdSkel's dualQuaternion collapses there"
                )
    return found


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


def _write(path: Path, options: ExportOptions, rigs: list[str]) -> list[str]:
    """Returns a sentence for each armature that the file does not have as it should."""
    # If the exporter fails, Blender prints a traceback and raises it as an error.
    kind = {".glb": "gltf", ".vrm": "gltf", ".usdc": "usd"}.get(path.suffix.lower())
    recorded = usd_scales.recorded() if kind == "usd" else nullcontext()
    with redirect_stderr(io.StringIO()), recorded as scales:
        if path.suffix.lower() == ".vrm":
            _vrm(str(path), rigs)
        else:
            _WRITERS[path.suffix.lower()](str(path), options)
    if kind is not None:
        _check_whole(path, kind)
    if scales is None:
        return []
    said = scales.write(path)
    _check_whole(path, "usd")
    return said


def _check_whole(path: Path, kind: str) -> None:
    if not is_whole(path, kind):
        raise OSError(errno.ENOSPC, "the disk did not take all of it; is it full?")


def _gltf(path: str, options: ExportOptions) -> None:
    chosen = (
        {"export_influence_nb": options.influences} if options.influences else {"export_all_influences": True}
    )
    bpy.ops.export_scene.gltf(
        filepath=path,
        export_format="GLB",
        export_animation_mode="ACTIVE_ACTIONS" if options.clips == SHOWN else "ACTIONS",
        **chosen,
    )


def _usd(path: str, _options: ExportOptions) -> None:
    bpy.ops.wm.usd_export(
        filepath=path,
        check_existing=False,
        export_animation=True,
        export_armatures=True,
        only_deform_bones=False,
        export_shapekeys=True,
        **TEXTURES_STAY,
    )


def _fbx(path: str, options: ExportOptions) -> None:
    """It goes through all actions, one after the other: a property that only an earlier one keys keeps its
    value in the next."""
    bpy.ops.export_scene.fbx(
        filepath=path,
        check_existing=False,
        use_mesh_modifiers=False,
        add_leaf_bones=False,
        bake_anim_simplify_factor=0.0,
        bake_anim_use_all_actions=options.clips != SHOWN,
        bake_anim_use_nla_strips=options.clips != SHOWN,
    )


def _vrm(path: str, rigs: list[str]) -> None:
    """Writes by the add-on VRM Format, an extension of Blender's platform and a package of PyPI."""
    if len(rigs) > 1:
        raise SinewError(f"a .vrm has one armature, and these are several: {', '.join(rigs)}")
    if not hasattr(bpy.types, "EXPORT_SCENE_OT_vrm"):
        names = [m.__name__ for m in addon_utils.modules() if m.__name__.startswith("bl_ext.")]
        found = [name for name in names if name.endswith(".vrm")] or ["io_scene_vrm"]
        if addon_utils.enable(found[0], default_set=True) is None:
            raise SinewError(
                "a .vrm is written by the add-on VRM Format, which is not installed: Get Extensions has it, "
                "and for bpy `pip install bpy-vrm-format`"
            )
    if bpy.ops.export_scene.vrm(filepath=path, armature_object_name=rigs[0]) != {"FINISHED"}:
        raise SinewError(
            f"{rigs[0]}: the add-on VRM Format does not take it; Validate, in its tab VRM, says why, such as "
            "human bones that are not assigned"
        )


_WRITERS: dict[str, Callable[[str, ExportOptions], None]] = {".glb": _gltf, ".usdc": _usd, ".fbx": _fbx}


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
