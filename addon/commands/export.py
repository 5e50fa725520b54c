# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew export`: writes a .glb with Blender's own exporter, with what engines need to skin as Sinew does."""

import argparse
import errno
import io
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr
from functools import partial
from pathlib import Path

from ..core.bake import is_whole
from ..core.errors import SinewError
from ..core.output import file_to_write, write_whole
from .arguments import add_file, add_method, add_set, count
from .console import Console

SUMMARY = "write a .glb whose skins have Sinew's method and centres of rotation"
HELP = (
    "Writes a .glb by Blender's own exporter: bones, weights and actions as ever, and in "
    "extras and attributes of each mesh that an armature deforms what an engine needs to skin it as "
    "Sinew does. Plain bones replace bendy ones."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_file(parser)
    parser.add_argument(
        "--out", required=True, type=partial(file_to_write, endings=(".glb",)), metavar="OUT.glb"
    )
    add_method(parser, "a method of `sinew methods`, for all meshes (default: each as the file has it)")
    parser.add_argument(
        "--influences", type=count, default=4, metavar="N", help="of a vertex, at most (default: 4)"
    )
    add_set(parser)


def run(args: argparse.Namespace, console: Console) -> int:
    import bpy

    from ..attach import attach, properties
    from ..deform import characters
    from ..features.bake import bake_bones
    from ..features.gltf import export
    from ..io import files

    console.note_on(args.file, files.open_file(args.file))
    scene = bpy.context.scene
    meshes = attach.deformed_meshes(list(scene.objects))
    left_out: list[str] = []
    # Blender does not evaluate hidden objects.
    with characters.shown(meshes):
        if args.method is not None:
            characters.set_parameters(args.set)
            errors = characters.use_methods([(obj, args.method) for obj in meshes])
            left_out += [str(error) for error in errors if error is not None]
            for sentence in characters.sentences():
                console.note(f"{args.file}: {sentence}")
        skinned = [obj for obj in meshes if properties.has_sinew(obj) and properties.of(obj).enabled]
        if not skinned:
            reason = left_out[0] if left_out else "no mesh has Sinew; choose a method by --method"
            raise SinewError(f"{args.file}: {reason}")
        frames = range(scene.frame_start, scene.frame_end + 1)
        reports, kept = bake_bones.replace_bendy_bones(skinned, frames, args.influences)
        left_out += kept
        for report in reports:
            console.note(f"{args.file}: {report.sentence(characters.length_unit(scene))}")
        scene.sinew_gltf.skinning = True
        with _known_to_exporters():
            try:
                write_whole(args.out, lambda path: _write(path, args.influences))
            except RuntimeError as error:
                # The exporter's error, with everything that Blender printed.
                raise SinewError(f"{args.out}: can not be written: {files.telling_line(error)}") from None
    left_out += export.left_out()
    for sentence in left_out:
        console.complain(f"{args.file}: {sentence}")
    for name, extras in export.written().items():
        console.note(
            f"{name}: {extras['method']}" + (f", mixed with {extras['mix']}" if "mix" in extras else "")
        )
    console.say(str(args.out))
    return 1 if left_out else 0


def _write(path: Path, influences: int) -> None:
    import bpy

    # If the exporter fails, Blender prints a traceback and raises it as an error.
    with redirect_stderr(io.StringIO()):
        bpy.ops.export_scene.gltf(filepath=str(path), export_format="GLB", export_influence_nb=influences)
    if not is_whole(path, "gltf"):
        raise OSError(errno.ENOSPC, "the disk did not take all of it; is it full?")


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
