# SPDX-License-Identifier: GPL-3.0-or-later
"""Textures of an export to USD.

Blender's exporter copies them into one folder `textures`, where textures of several exports can have the same
name, and the first one stays. So files on disk are referred to where they are, and images that are only in
the .blend go into a separate folder for the export.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

import bpy

from ...core.names import as_file_name
from ...core.output import remove, write_whole
from ...io import files

LEFT_WHERE_THEY_ARE = (
    {"export_textures_mode": "KEEP"} if bpy.app.version >= (4, 4) else {"export_textures": False}
)


class Textures:
    """The textures of `objects` that are only in the open file, for an export to `path`.

    written  their files, after on_disk() has started
    """

    def __init__(self, objects: Sequence[bpy.types.Object], path: Path, overwrite: bool) -> None:
        self.folder = path.with_name(f"{path.stem}_textures")
        self.written: list[Path] = []
        self._objects, self._overwrite = objects, overwrite

    @contextmanager
    def on_disk(self) -> Iterator[None]:
        """Context in which materials use files, as the exporter takes only those. Raises SinewError where one
        cannot be written."""
        replaced_images: list[tuple[bpy.types.Image, bpy.types.Image]] = []
        try:
            for image in _only_in_file(self._objects):
                replaced = bpy.data.images.load(str(self._write(image)))
                replaced.colorspace_settings.name = image.colorspace_settings.name
                replaced.alpha_mode = image.alpha_mode
                replaced_images.append((image, replaced))
                image.user_remap(replaced)
            yield
        finally:
            for image, replaced in replaced_images:
                replaced.user_remap(image)
                bpy.data.images.remove(replaced)

    def discard(self) -> None:
        for path in self.written:
            remove(path)
        with suppress(OSError):
            self.folder.rmdir()

    def _write(self, image: bpy.types.Image) -> Path:
        name = Path(bpy.path.basename(image.filepath) or image.name)
        stem, suffix = as_file_name(bpy.path.clean_name(name.stem)), name.suffix
        if image.packed_file is None or not suffix:
            suffix = ".png"
        path, number = self.folder / f"{stem}{suffix}", 1
        while path in self.written:
            number += 1
            path = self.folder / f"{stem}_{number}{suffix}"
        files.check_free(path, self._overwrite)
        write_whole(path, lambda unfinished: _save(image, unfinished))
        self.written.append(path)
        return path


def _save(image: bpy.types.Image, path: Path) -> None:
    if image.packed_file is not None:
        path.write_bytes(image.packed_file.data)
        return
    copy = image.copy()
    copy.filepath_raw, copy.file_format = str(path), "PNG"
    try:
        copy.save()
    except RuntimeError as error:
        raise OSError(files.telling_line(error)) from None
    finally:
        bpy.data.images.remove(copy)


def _only_in_file(objects: Sequence[bpy.types.Object]) -> list[bpy.types.Image]:
    """Returns the images of the objects' materials that are packed or made by Blender. Images of several
    files, such as tiles, are ignored."""
    materials = {slot.material for obj in objects for slot in obj.material_slots if slot.material}
    seen: set[bpy.types.NodeTree] = set()
    images: dict[bpy.types.Image, None] = {}
    trees = [material.node_tree for material in materials if material.node_tree is not None]
    while trees:
        tree = trees.pop()
        if tree in seen:
            continue
        seen.add(tree)
        trees += [node.node_tree for node in tree.nodes if node.type == "GROUP" and node.node_tree]
        images |= {node.image: None for node in tree.nodes if node.type == "TEX_IMAGE" and node.image}
    return sorted(
        (i for i in images if i.source == "GENERATED" or (i.source == "FILE" and i.packed_file)),
        key=lambda image: image.name_full,
    )
