# SPDX-License-Identifier: GPL-3.0-or-later
"""Opens what people have, and saves without ever writing over it."""

from __future__ import annotations

import os
from pathlib import Path

import bpy

from ..core.errors import SinewError

IMPORTERS = {
    ".glb": lambda path: bpy.ops.import_scene.gltf(filepath=path),
    ".gltf": lambda path: bpy.ops.import_scene.gltf(filepath=path),
    ".fbx": lambda path: bpy.ops.import_scene.fbx(filepath=path),
}
READABLE = (".blend", *IMPORTERS)

BLEND_MAGIC = b"BLENDER"
COMPRESSED_MAGIC = (b"\x28\xb5\x2f\xfd", b"\x1f\x8b")  # Zstandard, and gzip up to Blender 2.93


def open_file(path: Path) -> None:
    """Makes `path` the open file: a .blend, or a .glb, .gltf or .fbx imported into an empty scene.

    Raises SinewError where it can not be read. Scripts in the file do not run.
    """
    _check_readable(path)
    try:
        importer = IMPORTERS.get(path.suffix.lower())
        if importer is None:
            bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False, use_scripts=False)
        else:
            bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
            importer(str(path))
    except RuntimeError as error:
        raise SinewError(f"{path}: Blender can not read it: {telling_line(error)}") from None


def save_copy(source: Path, target: Path) -> None:
    """Saves the open file as `target`, compressed if `source` was; beside it first, then renamed."""
    unfinished = target.with_name(f".{target.stem}.unfinished.blend")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        bpy.ops.wm.save_as_mainfile(
            filepath=str(unfinished), copy=True, check_existing=False, compress=_is_compressed(source)
        )
        os.replace(unfinished, target)
    except (OSError, RuntimeError) as error:
        unfinished.unlink(missing_ok=True)
        raise SinewError(f"{target}: can not be written: {telling_line(error)}") from None


def check_free(path: Path, overwrite: bool) -> None:
    """Raises SinewError where a file is at `path` that may not be replaced."""
    if path.exists() and not overwrite:
        raise SinewError(f"{path}: is there already; choose to overwrite it, or another folder")


def _check_readable(path: Path) -> None:
    if not path.exists():
        raise SinewError(f"{path}: no such file")
    if path.is_dir():
        raise SinewError(f"{path}: is a folder, expected a file")
    if path.suffix.lower() not in READABLE:
        raise SinewError(f"{path}: expected a file ending in {', '.join(READABLE)}")
    try:
        with path.open("rb") as file:
            magic = file.read(len(BLEND_MAGIC))
    except OSError as error:
        raise SinewError(f"{path}: can not be read: {error.strerror}") from None
    if not magic:
        raise SinewError(f"{path}: is empty")
    if path.suffix.lower() == ".blend" and magic != BLEND_MAGIC and not magic.startswith(COMPRESSED_MAGIC):
        raise SinewError(f"{path}: is not a .blend file")


def _is_compressed(path: Path) -> bool:
    if path.suffix.lower() != ".blend":
        return True
    with path.open("rb") as file:
        return file.read(4).startswith(COMPRESSED_MAGIC)


def telling_line(error: Exception) -> str:
    """What was wrong, of all that Blender wrote."""
    text = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    lines = [line.strip() for line in text.replace("Error: ", "").splitlines() if line.strip()]
    if not lines:
        return type(error).__name__
    # An importer written in Python hands over its whole traceback: the last line says what was wrong.
    return lines[-1] if "Traceback" in lines[0] else lines[0]
