# SPDX-License-Identifier: GPL-3.0-or-later
"""Opens files, and saves copies so that an existing file is never left half-written."""

import errno
import io
import os
import re
import struct
from collections.abc import Callable, Sequence
from contextlib import redirect_stderr
from pathlib import Path

import bpy
import numpy as np

from ..base.errors import SinewError
from ..base.output import remove, writing
from . import read_only, usd

IMPORTERS = {
    ".glb": lambda path: bpy.ops.import_scene.gltf(filepath=path),
    ".gltf": lambda path: bpy.ops.import_scene.gltf(filepath=path),
    ".fbx": lambda path: bpy.ops.import_scene.fbx(filepath=path),
    **dict.fromkeys(usd.ENDINGS, lambda path: bpy.ops.wm.usd_import(filepath=path)),
}

BLEND_MAGIC = b"BLENDER"
ZSTANDARD_MAGIC = b"\x28\xb5\x2f\xfd"
COMPRESSED_MAGIC = (ZSTANDARD_MAGIC, b"\x1f\x8b")  # the other is gzip, up to Blender 2.93

# Zstandard's seekable format, as Blender writes it: a skippable frame at the end, with two numbers for each
# frame.
SEEK_TABLE_MAGIC = 0x8F92EAB1
SKIPPABLE_HEADER = 8
# Size in bytes of the last block of an uncompressed file: up to Blender 4.5, and since.
LAST_BLOCK = (24, 32)


# Of glTF, which Blender reads by libraries of its own.
_CODECS = ("Draco", "Meshopt")
# What Blender and Python put before the actual message.
_ABOUT_ERROR = re.compile(r"^((Error|OSError): |\[Errno \d+\] )+")


def open_file(path: Path, load_ui: bool = False, scripts: bool = False) -> list[str]:
    """Opens `path`: a .blend, or a .glb, .gltf, .fbx or USD file imported into an empty scene, which gets
    the frame range of its animation. All objects leave the modes that they were saved in, but for Pose Mode,
    and evaluations write no files (read_only.py).

    Returns a sentence for each object that is not as in the file.

    load_ui  also loads the file's windows and workspaces, for a copy that keeps them
    scripts  whether scripts in the file run

    Raises SinewError where it cannot be read.
    """
    check_readable(path, (".blend", *IMPORTERS))
    try:
        importer = IMPORTERS.get(path.suffix.lower())
        with read_only.opening() as sentences:
            if importer is None:
                bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=load_ui, use_scripts=scripts)
            else:
                bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
                _import(importer, path)
                _use_frames_of_animation()
                sentences += usd.lost_in_import(path) if path.suffix.lower() in usd.ENDINGS else []
    except RuntimeError as error:
        # Blender repeats the file name, up to twice, before the reason or behind it.
        before, _path, behind = telling_line(error).rpartition(str(path))
        reason = behind.strip("'\": ,") or before.strip("'\": ,")
        if reason == "not a blend file":
            # It begins like a .blend, and older Blenders report nothing else for files of newer ones.
            reason += f", or of a Blender newer than {bpy.app.version_string}"
        for codec in _CODECS:
            if importer is not None and codec.lower() in reason.lower():
                # bpy as a module comes without these libraries (seen on 4.2 and 5.3; 4.5 has Draco's).
                reason = (
                    f"it is compressed by {codec}, for which this Blender has no library; use a whole "
                    "Blender, or write the file without compression"
                )
        raise SinewError(f"{path}: Blender can not read it: {reason}") from None
    return [*_leave_modes(), *sentences]


def _import(importer: Callable[[str], set[str]], path: Path) -> None:
    """Leaves nothing of a file that can not be read to its end."""
    try:
        # An importer's own traceback, which its error has, too.
        with redirect_stderr(io.StringIO()):
            if importer(str(path)) != {"FINISHED"}:
                raise RuntimeError("its importer gives up")
    except RuntimeError:
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        raise


def _leave_modes() -> list[str]:
    """Returns a sentence for each object that left a mode. Blender opens files with the modes of the visible
    scene and view layer alone. Pose Mode changes nothing that is evaluated."""
    sentences = []
    for obj in bpy.data.objects:
        if obj.mode not in ("OBJECT", "POSE"):
            mode = obj.bl_rna.properties["mode"].enum_items[obj.mode].name
            sentences.append(f"{obj.name}: saved in {mode}, and used as in Object Mode")
    for obj in bpy.data.objects:
        # One call can be for several objects.
        if obj.mode not in ("OBJECT", "POSE"):
            with bpy.context.temp_override(object=obj, active_object=obj):
                bpy.ops.object.mode_set(mode="OBJECT")
    return sentences


def _use_frames_of_animation() -> None:
    """Sets the scene's frame range to that of all actions, since importers leave it at 1 to 250."""
    players = [obj.animation_data for obj in bpy.data.objects]
    players += [keys.animation_data for keys in bpy.data.shape_keys]
    played = [each.action for each in players if each is not None and each.action is not None]
    if played:
        ranges = np.array([action.frame_range for action in played])
        scene = bpy.context.scene
        scene.frame_start, scene.frame_end = max(0, round(ranges[:, 0].min())), round(ranges[:, 1].max())


def save_copy(source: Path, target: Path, name_others: Callable[[], None] = lambda: None) -> None:
    """Saves the open file as `target`, compressed if `source` was; first under another name beside it, then
    renamed.

    name_others  renames the files that it refers to, once the copy is complete
    """
    unfinished = target.with_name(f".{target.stem}.unfinished.blend")
    save_beside(source, target, unfinished)
    try:
        with writing(target):
            name_others()
            os.replace(unfinished, target)
    finally:
        remove(unfinished)


def save_beside(source: Path | None, target: Path, unfinished: Path) -> None:
    """Saves the open file for `target`, compressed if `source` was, under the name `unfinished` beside it."""
    compress = source is not None and _is_compressed(source)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        bpy.ops.wm.save_as_mainfile(
            filepath=str(unfinished), copy=True, check_existing=False, compress=compress
        )
        if not unfinished.exists() or not _is_whole(unfinished):
            raise OSError(errno.ENOSPC, "the disk did not take all of it; is it full?")
    except (OSError, RuntimeError) as error:
        remove(unfinished)
        raise SinewError(f"{target}: can not be written: {telling_line(error)}") from None


def check_free(path: Path, overwrite: bool) -> None:
    """Raises SinewError where a file at `path` exists that may not be replaced."""
    if path.exists() and not overwrite:
        raise SinewError(f"{path}: is there already; choose to overwrite it, or another folder")


def check_readable(path: Path, readable: Sequence[str]) -> None:
    """Raises SinewError where `path` is not a file with one of these extensions, or not really a .blend."""
    if not path.exists():
        raise SinewError(f"{path}: no such file")
    if path.is_dir():
        raise SinewError(f"{path}: is a folder, expected a file")
    if not path.is_file():
        raise SinewError(f"{path}: is a device or a pipe, expected a file")
    if path.suffix.lower() not in readable:
        raise SinewError(f"{path}: expected a file ending in {', '.join(readable)}")
    try:
        with path.open("rb") as file:
            magic = file.read(len(BLEND_MAGIC))
    except OSError as error:
        raise SinewError(f"{path}: can not be read: {error.strerror}") from None
    if not magic:
        raise SinewError(f"{path}: is empty")
    if path.suffix.lower() == ".blend" and magic != BLEND_MAGIC and not magic.startswith(COMPRESSED_MAGIC):
        raise SinewError(f"{path}: is not a .blend file")


def _is_whole(path: Path) -> bool:
    """Whether a file contains everything that Blender wrote: for compressed files Blender does not notice a
    full disk (seen on 4.2 and 5.2; it drops the error of its Zstandard writer)."""
    with path.open("rb") as file:
        is_compressed = file.read(4) == ZSTANDARD_MAGIC
        size = file.seek(0, os.SEEK_END)
        if not is_compressed:
            file.seek(-min(size, max(LAST_BLOCK)), os.SEEK_END)
            end = file.read()
            return any(end[-length:].startswith(b"ENDB") for length in LAST_BLOCK)
        # A table at the end lists the sizes of all frames, as they were meant to be written.
        footer = struct.Struct("<IBI")
        if size < footer.size:
            return False
        file.seek(-footer.size, os.SEEK_END)
        frames, _flags, magic = footer.unpack(file.read())
        table = footer.size + 8 * frames
        if magic != SEEK_TABLE_MAGIC or size < table:
            return False
        file.seek(-table, os.SEEK_END)
        listed = struct.unpack(f"<{2 * frames}I", file.read(8 * frames))
        return sum(listed[::2]) + SKIPPABLE_HEADER + table == size


def _is_compressed(path: Path) -> bool:
    if path.suffix.lower() != ".blend":
        return True
    with path.open("rb") as file:
        return file.read(4).startswith(COMPRESSED_MAGIC)


def telling_line(error: Exception) -> str:
    """Returns the line that says what was wrong, from everything that Blender printed."""
    text = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    lines = [_ABOUT_ERROR.sub("", line.strip()) for line in text.splitlines()]
    # The position in Blender's own code is of no use to readers.
    lines = [line for line in lines if line and not line.startswith("Location: ")]
    if not lines:
        return type(error).__name__
    # Importers written in Python pass on their whole traceback: its last line says what was wrong.
    return lines[-1] if "Traceback" in lines[0] else lines[0]
