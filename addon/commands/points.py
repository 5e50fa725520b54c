# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew points`: writes the deformed vertices of chosen frames, as numpy arrays."""

import argparse
import zipfile
from collections import Counter
from pathlib import Path

import numpy as np

from ..base.errors import SinewError, about
from ..base.names import as_file_name
from ..base.output import write_whole
from ..skinning.parameters import PRESETS
from ..skinning.variants import BLENDER
from .arguments import add_file, add_frames, add_method, add_object, add_set, file_named
from .console import Console
from .outcome import use_method

SUMMARY = "write the deformed vertices of chosen frames"
HELP = (
    "Writes an .npz: for each armature-deformed mesh one float32 array [frames, vertices, "
    "3], its key the object's name (with %2F for /): the vertices of the final evaluated mesh in object "
    "space; and an array `frames`."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_file(parser)
    text = "a method of `sinew methods`, or blender for the Armature modifier"
    add_method(parser, text, required=True, read=str)
    add_frames(parser, required=True)
    add_object(parser)
    parser.add_argument("--out", required=True, type=file_named(".npz"), metavar="POINTS.npz")
    add_set(parser)


def run(args: argparse.Namespace, console: Console) -> int:
    import bpy

    from ..deform import characters
    from ..io import files

    frames = args.frames
    if args.method not in PRESETS:
        characters.check_methods([args.method])
    characters.set_parameters(args.set)
    console.note_on(args.file, files.open_file(args.file))
    with about(args.file):
        meshes = characters.deformed_meshes(bpy.context.scene, args.object)

    taken, left_out = use_method(meshes, args.method)
    for reason in left_out:
        console.complain(f"{args.file}: left out: {reason}")
    console.note_on(args.file, characters.sentences())
    if not taken:
        raise SinewError(f"{args.file}: no mesh that Sinew can deform")

    if "frames" in (obj.name for obj in taken):
        raise SinewError(f"{args.file}: an object is called frames, as the array of frames is; rename it")
    # A linked object can have the same name as one of the file's own.
    names = Counter(obj.name for obj in taken)
    keys = {obj: obj.name if names[obj.name] == 1 else obj.name_full for obj in taken}
    points: dict[str, list[np.ndarray]] = {key: [] for key in keys.values()}
    for frame in console.progress(frames, len(frames), f"Deforming {args.file.name}"):
        characters.set_frame(bpy.context.scene, frame)
        for obj in taken:
            if args.method != BLENDER and not obj.sinew.enabled:
                raise SinewError(f"{args.file}: frame {frame}: {obj.sinew.error}")
            points[keys[obj]].append(characters.final_points(obj))
    arrays = {name: _stack(name, per_frame, frames) for name, per_frame in points.items()}
    _write(args.out, {**arrays, "frames": np.array(frames)})
    for name, array in arrays.items():
        console.note(f"{name}: {array.shape[1]:,} vertices")
    console.say(str(args.out))
    return 1 if left_out else 0


def _stack(name: str, per_frame: list[np.ndarray], frames: list[float]) -> np.ndarray:
    for frame, points in zip(frames, per_frame, strict=True):
        if points.shape != per_frame[0].shape:
            raise SinewError(
                f"{name}: {len(points)} vertices at frame {frame} but {len(per_frame[0])} at frame "
                f"{frames[0]}; a modifier changes the topology, ask for these frames one by one"
            )
    return np.stack(per_frame)


def _write(path: Path, arrays: dict[str, np.ndarray]) -> None:
    def write(unfinished: Path) -> None:
        # Not np.savez: an object could have the name of one of its arguments.
        with zipfile.ZipFile(unfinished, "w") as archive:
            for name, array in arrays.items():
                with archive.open(f"{as_file_name(name)}.npy", "w", force_zip64=True) as member:
                    np.lib.format.write_array(member, np.ascontiguousarray(array))

    write_whole(path, write)
