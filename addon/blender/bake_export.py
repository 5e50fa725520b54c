# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes by Blender's own exporters: the final meshes, with UVs and materials.

Like bake.Bake they go in steps: sample(), place(), publish(), discard().
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np

from ..core import bake as core
from ..core.errors import SinewError
from ..core.output import remove
from . import evaluate, files, shape_animation


def _alembic(path: str, first: int, last: int) -> None:
    bpy.ops.wm.alembic_export(
        filepath=path,
        check_existing=False,
        start=first,
        end=last,
        selected=True,
        uvs=True,
        face_sets=True,
        export_hair=False,
        export_particles=False,
        as_background_job=False,
    )


def _usd(path: str, _first: int, _last: int) -> None:
    # The final points: neither the armature nor the shape keys, which know nothing of Sinew.
    bpy.ops.wm.usd_export(
        filepath=path,
        check_existing=False,
        selected_objects_only=True,
        export_animation=True,
        export_uvmaps=True,
        export_materials=True,
        export_armatures=False,
        export_shapekeys=False,
        export_hair=False,
        export_subdivision="TESSELLATE",
    )


SCENES: dict[str, Callable[[str, int, int], None]] = {"alembic": _alembic, "usd": _usd}
GLTF = "gltf"


class _Export:
    """What ends as one file: written at `unfinished` first, then moved to `path`."""

    path: Path
    unfinished: Path

    @property
    def what(self) -> str:
        return str(self.path)

    @property
    def files(self) -> list[tuple[Path, Path]]:
        """Each that is written, with the name that publish() gives it."""
        return [(self.unfinished, self.path)]

    def place(self) -> None:
        """The open file stays as it is."""

    def publish(self) -> None:
        for unfinished, path in self.files:
            core.publish(unfinished, path)

    def discard(self) -> None:
        remove(self.unfinished)


class SceneExport(_Export):
    """Alembic and USD. The exporter goes through the frames itself, and Sinew follows as in a render."""

    def __init__(
        self, meshes: list[bpy.types.Object], kind: str, frames: Sequence[float], path: Path
    ) -> None:
        core.check_frames(kind, frames)
        self.meshes, self.kind, self.path = meshes, kind, path
        self.first, self.last = int(frames[0]), int(frames[-1])
        self.unfinished = _prepare(meshes, frames, path)

    def sample(self) -> Iterator[float]:
        scene = bpy.context.scene
        before = scene.frame_current_final, scene.frame_start, scene.frame_end
        try:
            with _selected(self.meshes):
                scene.frame_start, scene.frame_end = self.first, self.last
                _export(lambda: SCENES[self.kind](str(self.unfinished), self.first, self.last), self)
            for obj in self.meshes:
                _check_driven(obj)
            yield 1.0
        except BaseException:
            self.discard()
            raise
        finally:
            scene.frame_start, scene.frame_end = before[1:]
            evaluate.set_frame(scene, before[0])


class MorphExport(_Export):
    """glTF: the final meshes of the first frame, and the others' points as morph targets."""

    def __init__(self, meshes: list[bpy.types.Object], frames: Sequence[float], path: Path) -> None:
        core.check_frames(GLTF, frames)
        self.meshes, self.frames, self.path = meshes, frames, path
        self.unfinished = _prepare(meshes, frames, path)
        self.made: list[bpy.types.Object] = []
        self.samples: dict[bpy.types.Object, list[np.ndarray]] = {obj: [] for obj in meshes}

    def sample(self) -> Iterator[float]:
        scene = bpy.context.scene
        before = scene.frame_current_final
        try:
            for number, frame in enumerate(self.frames):
                evaluate.set_frame(scene, frame)
                for obj, samples in self.samples.items():
                    _check_driven(obj)
                    points = evaluate.final_points(obj)
                    if samples and len(points) != len(samples[0]):
                        raise SinewError(
                            f"{obj.name}: {len(samples[0]):,} vertices at first and {len(points):,} at frame "
                            f"{frame:g}; morph targets need one number, bake to alembic or usd"
                        )
                    samples.append(points)
                yield (number + 1) / (len(self.frames) + 1)
            evaluate.set_frame(scene, self.frames[0])
            self._make()
            with _selected(self.made):
                first, last = scene.frame_start, scene.frame_end
                scene.frame_start, scene.frame_end = int(self.frames[0]), int(self.frames[-1])
                try:
                    _export(self._write, self)
                finally:
                    scene.frame_start, scene.frame_end = first, last
        except BaseException:
            self.discard()
            raise
        finally:
            self._remove()
            evaluate.set_frame(scene, before)
        yield 1.0

    def _make(self) -> None:
        depsgraph = bpy.context.evaluated_depsgraph_get()
        for obj, samples in self.samples.items():
            evaluated = obj.evaluated_get(depsgraph)
            mesh = bpy.data.meshes.new_from_object(evaluated, depsgraph=depsgraph)
            mesh.name = f"{obj.data.name} baked"
            made = bpy.data.objects.new(f"{obj.name} baked", mesh)
            made.matrix_world = evaluated.matrix_world
            bpy.context.scene.collection.objects.link(made)
            self.made.append(made)
            shape_animation.add(made, self.frames, samples)

    def _write(self) -> None:
        bpy.ops.export_scene.gltf(
            filepath=str(self.unfinished),
            check_existing=False,
            export_format="GLB",
            use_selection=True,
            export_animations=True,
            export_morph=True,
            export_morph_animation=True,
            export_skins=False,
            export_frame_range=True,
        )

    def _remove(self) -> None:
        for made in self.made:
            keys = made.data.shape_keys
            action = keys.animation_data.action if keys is not None and keys.animation_data else None
            bpy.data.meshes.remove(made.data)
            if action is not None:
                bpy.data.actions.remove(action)
        self.made.clear()


def _prepare(meshes: list[bpy.types.Object], frames: Sequence[float], path: Path) -> Path:
    """Where the export goes at first; raises SinewError where there is no room for it."""
    for obj in meshes:
        _check_driven(obj)
    vertices = sum(len(evaluate.final_points(obj)) for obj in meshes)
    # Points and normals.
    core.check_space(path.parent, 24 * vertices * len(frames))
    unfinished = path.with_name(f".{path.stem}.unfinished{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        # Known before the frames are read, and not from an exporter's traceback.
        unfinished.touch()
        unfinished.unlink()
    except OSError as error:
        raise SinewError(f"{path}: can not be written: {error.strerror}") from None
    return unfinished


def _check_driven(obj: bpy.types.Object) -> None:
    if not obj.sinew.enabled:
        raise SinewError(obj.sinew.error or f"{obj.name}: switch Sinew on to bake what it shows")


def _export(write: Callable[[], None], export: SceneExport | MorphExport) -> None:
    try:
        write()
    except RuntimeError as error:
        raise SinewError(f"{export.path}: can not be written: {files.telling_line(error)}") from None
    if not export.unfinished.exists():
        raise SinewError(f"{export.path}: can not be written: Blender's exporter made no file")


@contextmanager
def _selected(objects: list[bpy.types.Object]) -> Iterator[None]:
    """Selects these alone, and what was selected afterwards."""
    layer = bpy.context.view_layer
    before, active = [o for o in layer.objects if o.select_get()], layer.objects.active
    _select(objects)
    try:
        yield
    finally:
        _select(before)
        layer.objects.active = active


def _select(objects: list[bpy.types.Object]) -> None:
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj in objects)
