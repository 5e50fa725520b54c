# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew export`: writes a file for engines with Blender's own exporters, and verifies what it plays."""

from __future__ import annotations

import argparse
import errno
import io
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from ..core.bake import is_whole
from ..core.errors import SinewError, WrongUse
from ..core.export_check import Check, spread_frames
from ..core.frames import parse_frames
from ..core.output import file_to_write, write_whole
from ..core.segment_bones import SegmentReport
from .arguments import add_file, add_json, add_method, add_set, count, percent
from .console import Console

if TYPE_CHECKING:
    import bpy

SUMMARY = "write a .glb, .usdc or .fbx for engines, and say how far it plays from what is seen"
HELP = """\
Writes a .glb by Blender's own exporter: bones, weights and actions as ever, and in an extension and
attributes of each mesh that an armature deforms what an engine needs to skin it as Sinew does. A .usdc or
.fbx has bones, weights and animation alone. Plain bones replace bendy ones.

--verify reads the file again, without Blender's importers, plays it as an engine does, by linear blending,
and prints how far it is from what was seen; then each cause alone. The exit status is 1 where a difference
has no known cause, or is larger than --at-most."""

# So many frames are verified, unless they are chosen.
_FRAMES = 25


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_file(parser)
    parser.add_argument(
        "--out", required=True, type=partial(file_to_write, endings=tuple(_WRITERS)), metavar="OUT.glb"
    )
    add_method(parser, "a method of `sinew methods`, for all meshes (default: each as the file has it)")
    parser.add_argument(
        "--influences", type=count, default=4, metavar="N", help=".glb: of a vertex, at most (default: 4)"
    )
    parser.add_argument("--verify", action="store_true", help="say how far the file plays from what is seen")
    parser.add_argument("--frames", help=f"to verify, such as 1,12 (default: {_FRAMES} of the scene's)")
    parser.add_argument(
        "--at-most",
        type=percent,
        metavar="PERCENT",
        help="with --verify: exit with 1 where a vertex is farther off, in percent of its mesh's diagonal",
    )
    add_json(parser)
    add_set(parser)


def run(args: argparse.Namespace, console: Console) -> int:
    import bpy

    from ..attach import attach
    from ..deform import characters
    from ..io import files

    if not args.verify and (args.frames is not None or args.at_most is not None):
        raise WrongUse("--frames and --at-most go with --verify")
    console.note_on(args.file, files.open_file(args.file))
    meshes = attach.deformed_meshes(list(bpy.context.scene.objects))
    # Blender does not evaluate hidden objects.
    with characters.shown(meshes):
        left_out, skinned = _skinned(args, meshes, console)
        written = _export(args, skinned, console)
    left_out += written.left_out
    for sentence in left_out:
        console.complain(f"{args.file}: {sentence}")
    unit = characters.length_unit(bpy.context.scene)
    if args.json:
        said: dict[str, object] = {"file": str(args.out), "unit": unit, "errors": left_out}
        said |= {"bendy": [asdict(each) for each in written.bendy]}
        said |= {"meshes": [{**asdict(c), "explained": c.is_explained} for c in written.checks]}
        console.say(json.dumps(said, indent=2, ensure_ascii=False))
    else:
        for check in written.checks:
            for sentence in check.sentences(unit):
                console.say(sentence)
        console.say(str(args.out))
    return 1 if left_out or any(_is_too_far(check, args.at_most) for check in written.checks) else 0


@dataclass
class _Written:
    """
    bendy     of each armature with bendy bones
    checks    of each mesh that is verified
    left_out  a sentence for each mesh that the file does not have as it should
    """

    bendy: list[SegmentReport]
    checks: list[Check]
    left_out: list[str]


def _skinned(
    args: argparse.Namespace, meshes: list[bpy.types.Object], console: Console
) -> tuple[list[str], list[bpy.types.Object]]:
    """Has the meshes deformed by the method chosen. Returns a sentence for each that is not, and those that
    Sinew deforms."""
    from ..attach import properties
    from ..deform import characters

    left_out: list[str] = []
    if args.method is not None:
        characters.set_parameters(args.set)
        errors = characters.use_methods([(obj, args.method) for obj in meshes])
        left_out = [str(error) for error in errors if error is not None]
        for sentence in characters.sentences():
            console.note(f"{args.file}: {sentence}")
    skinned = [obj for obj in meshes if properties.has_sinew(obj) and properties.of(obj).enabled]
    if not skinned:
        reason = left_out[0] if left_out else "no mesh has Sinew; choose a method by --method"
        raise SinewError(f"{args.file}: {reason}")
    return left_out, skinned


def _export(args: argparse.Namespace, skinned: list[bpy.types.Object], console: Console) -> _Written:
    import bpy

    from ..attach import attach
    from ..deform import characters
    from ..features.bake import bake_bones
    from ..features.gltf import export, verify
    from ..io import files

    scene, kind = bpy.context.scene, args.out.suffix.lower()
    is_gltf = kind == ".glb"
    influences = args.influences if is_gltf else 0
    recording = None
    if args.verify:
        frames, between = spread_frames(scene.frame_start, scene.frame_end, _FRAMES)
        if args.frames is not None:
            frames, between = sorted(set(parse_frames(args.frames))), []
        recording = verify.Recording(skinned, frames, between, influences, kind)
    whole = range(scene.frame_start, scene.frame_end + 1)
    bendy, segments, left_out = bake_bones.replace_bendy_bones(skinned, whole, influences)
    for report in bendy:
        console.note(f"{args.file}: {report.sentence(characters.length_unit(scene))}")
    if is_gltf:
        scene.sinew_gltf.skinning = True
    else:
        # Exporters know Armature modifiers, and shape keys where there are no others.
        for obj in skinned:
            attach.take_off(obj)
    with _known_to_exporters():
        try:
            write_whole(args.out, lambda path: _write(path, args.influences))
        except RuntimeError as error:
            # The exporter's error, with everything that Blender printed.
            raise SinewError(f"{args.out}: can not be written: {files.telling_line(error)}") from None
    checks = []
    if recording is not None:
        checks = recording.verify(args.out, segments)
        left_out += recording.left_out
    if is_gltf:
        left_out += export.left_out()
        for name, content in export.written().items():
            mixed = f", mixed with {content['mix']}" if "mix" in content else ""
            console.note(f"{name}: {content['method']}{mixed}")
    return _Written(bendy, checks, left_out)


def _is_too_far(check: Check, percent_of_diagonal: float | None) -> bool:
    if percent_of_diagonal is None:
        return not check.is_explained
    return not check.is_explained or check.total.largest > percent_of_diagonal / 100.0 * check.diagonal


def _write(path: Path, influences: int) -> None:
    # If the exporter fails, Blender prints a traceback and raises it as an error.
    with redirect_stderr(io.StringIO()):
        _WRITERS[path.suffix.lower()](str(path), influences)
    kind = {".glb": "gltf", ".usdc": "usd"}.get(path.suffix.lower())
    if kind is not None and not is_whole(path, kind):
        raise OSError(errno.ENOSPC, "the disk did not take all of it; is it full?")


def _gltf(path: str, influences: int) -> None:
    import bpy

    bpy.ops.export_scene.gltf(filepath=path, export_format="GLB", export_influence_nb=influences)


def _usd(path: str, _influences: int) -> None:
    import bpy

    from ..features.bake.bake_export import TEXTURES_STAY

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
    import bpy

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
    import bpy

    module = __package__.rpartition(".")[0]
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
