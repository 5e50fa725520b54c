# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads and writes PNG and WebP files with Blender itself, so that nothing has to be installed."""

from pathlib import Path

import bpy
import numpy as np

from ...base.errors import SinewError
from ...base.output import write_whole
from ...io.files import telling_line


def read_picture(path: Path) -> np.ndarray:
    """float32 [height, width, 4] in 0..1, from the lowest row up, as stored. Raises SinewError."""
    try:
        image = bpy.data.images.load(str(path))
    except RuntimeError:
        raise SinewError(f"{path}: can not be read as a picture") from None
    try:
        width, height = image.size
        if not width:
            raise SinewError(f"{path}: can not be read as a picture")
        pixels = np.empty(width * height * image.channels, dtype=np.float32)
        # Reads the file: before, only the size is known.
        image.pixels.foreach_get(pixels)
    finally:
        bpy.data.images.remove(image)
    return pixels.reshape(height, width, 4)


def write_picture(path: Path, pixels: np.ndarray) -> None:
    """Writes a PNG or a WebP, by the name's ending, with 8 bits per channel."""
    height, width, _channels = pixels.shape
    image = bpy.data.images.new("Sinew Picture", width, height, alpha=True)
    try:
        image.pixels.foreach_set(np.ascontiguousarray(pixels, dtype=np.float32).ravel())
        image.file_format = path.suffix[1:].upper()

        def write(unfinished: Path) -> None:
            image.filepath_raw = str(unfinished)
            try:
                image.save()
            except RuntimeError as error:
                raise OSError(telling_line(error)) from None

        write_whole(path, write)
    finally:
        bpy.data.images.remove(image)
