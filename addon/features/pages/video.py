# SPDX-License-Identifier: GPL-3.0-or-later
"""Encodes pictures into an mp4, with Blender's built-in FFmpeg."""

import shutil
from collections.abc import Sequence
from pathlib import Path

import bpy

from ...core.errors import SinewError
from ...core.output import write_whole
from ...core.scratch import scratch_folder
from ...io.files import telling_line


def check_can_encode() -> None:
    """Raises SinewError where this Blender has no FFmpeg."""
    if not bpy.app.build_options.codec_ffmpeg:
        raise SinewError("this Blender is built without FFmpeg and can not write videos; leave --video away")


def encode(pictures: Sequence[Path], fps: int, fps_base: float, path: Path) -> None:
    """Writes an mp4 (H.264) of pictures in one folder, one per frame, all with the same even width and
    height.

    fps, fps_base  as in a scene's render settings: fps / fps_base frames per second
    """
    first = bpy.data.images.load(str(pictures[0]))
    size = tuple(first.size)
    bpy.data.images.remove(first)
    scene = bpy.data.scenes.new("Sinew Video")
    try:
        _show_one_after_the_other(scene, pictures)
        _prepare_output(scene, size)
        scene.render.fps, scene.render.fps_base = fps, fps_base

        with scratch_folder() as folder:
            # Not to `path` itself: Blender replaces each # and {} in it.
            encoded = folder / "video.mp4"
            scene.render.filepath = str(encoded)
            try:
                bpy.ops.render.render(animation=True, scene=scene.name)
            except RuntimeError as error:
                raise SinewError(f"{path}: can not be encoded: {telling_line(error)}") from None
            if not _is_whole(encoded):
                raise SinewError(
                    f"{path}: can not be encoded: {folder.parent} did not take all of it; is it full?"
                )
            write_whole(path, lambda unfinished: shutil.copyfile(encoded, unfinished))
    finally:
        bpy.data.scenes.remove(scene)


def _is_whole(path: Path) -> bool:
    """Whether an mp4 exists with all its parts, of which the index is the last."""
    if not path.exists():
        return False
    content, place, kinds = path.read_bytes(), 0, set()
    while 0 <= place <= len(content) - 8:
        size = int.from_bytes(content[place : place + 4], "big")
        kinds.add(content[place + 4 : place + 8])
        if size == 1:
            size = int.from_bytes(content[place + 8 : place + 16], "big")
        if size < 8:
            return False
        place += size
    return place == len(content) and b"moov" in kinds


def _show_one_after_the_other(scene: bpy.types.Scene, pictures: Sequence[Path]) -> None:
    editor = scene.sequence_editor_create()
    # Named sequences up to 4.3.
    strips = editor.strips if hasattr(editor, "strips") else editor.sequences
    strip = strips.new_image("Pictures", str(pictures[0]), channel=1, frame_start=1)
    for picture in pictures[1:]:
        strip.elements.append(picture.name)
    # Appended elements do not make it longer. The property that does was renamed in 5.1.
    duration = "duration" if hasattr(strip, "duration") else "frame_final_duration"
    setattr(strip, duration, len(pictures))
    scene.frame_start, scene.frame_end = 1, len(pictures)


def _prepare_output(scene: bpy.types.Scene, size: tuple[int, int]) -> None:
    render = scene.render
    render.resolution_x, render.resolution_y = size
    render.resolution_percentage = 100
    render.use_sequencer, render.use_compositing = True, False
    # Up to 5.0 the file extension is not taken from the path where frame numbers are added to it.
    render.use_file_extension = False
    scene.view_settings.view_transform = "Standard"
    if hasattr(render.image_settings, "media_type"):
        render.image_settings.media_type = "VIDEO"
    render.image_settings.file_format = "FFMPEG"
    render.image_settings.color_mode = "RGB"
    render.ffmpeg.format = "MPEG4"
    render.ffmpeg.codec = "H264"
    render.ffmpeg.constant_rate_factor = "HIGH"
    render.ffmpeg.audio_codec = "NONE"
