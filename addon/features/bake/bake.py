# SPDX-License-Identifier: GPL-3.0-or-later
"""Sinew's deformation as data that plays without Sinew: shape keys, point caches and exported files."""

from collections.abc import Generator, Sequence
from pathlib import Path

import bpy
import numpy as np

from ...attach import attach, stack, upstream_proxy
from ...base.errors import SinewError
from ...base.names import as_file_name
from ...base.phrases import Phrase, phrase
from ...deform import characters
from ...io import files
from ...io.actions import curves_of
from . import bake_export, bake_state, baked_files, kept, shape_animation
from .bake_bones import BoneBake
from .bake_state import Started, skinned_now, take_off
from .bake_vat import VatBake
from .helper_bones import DEFAULT_HELPERS, HelperOptions
from .vat import DEFAULT_VAT, VatOptions

SHAPE_KEYS = "shape-keys"


class ShapeKeys:
    """One shape key per frame. It replaces the mesh's own keys, which are part of the baked shapes."""

    def __init__(self, obj: bpy.types.Object, frames: Sequence[float]) -> None:
        if obj.override_library is not None:
            raise SinewError(
                f"{obj.name}: a library override can not have shape keys of its own; bake a cache"
            )
        upstream_proxy.check_not_needed(obj, "where shape keys can not follow; bake to mdd or pc2")
        baked_files.check_space(
            Path(bpy.data.filepath or ".").parent, 12 * len(obj.data.vertices) * len(frames)
        )
        self.obj, self.frames = obj, frames
        self.samples: list[np.ndarray] = []

    def take(self, points: np.ndarray) -> None:
        # The next frame is written to the same array.
        self.samples.append(points.copy())

    def end(self) -> None:
        """Does nothing, as nothing is in files."""

    def place(self) -> None:
        obj, shapes = self.obj, self.samples
        _take_off(obj)
        mesh = bake_state.use_copy_of_mesh(obj)
        obj.show_only_shape_key = False
        if mesh.shape_keys is not None:
            obj.shape_key_clear()
        shape_animation.add(obj, self.frames, shapes)

    @property
    def sentence(self) -> Phrase:
        return phrase("{count} shape keys, one a frame", count=len(self.frames))

    files = ()

    def discard(self) -> None:
        self.samples.clear()


class Cache:
    """A point cache, and a Mesh Cache modifier in place of Sinew's that plays it."""

    def __init__(self, obj: bpy.types.Object, frames: Sequence[float], path: Path, kind: str) -> None:
        vertices = len(skinned_now(obj).points)
        baked_files.check_space(path.parent, 12 * vertices * len(frames))
        render = bpy.context.scene.render
        self.obj, self.frames, self.kind, self.vertices = obj, frames, kind, vertices
        self.file = baked_files.PointCache(path, kind, frames, vertices, render.fps / render.fps_base)

    def take(self, points: np.ndarray) -> None:
        if len(points) != self.vertices:
            raise SinewError(
                f"{self.obj.name}: {self.vertices:,} vertices come to the armature at first and "
                f"{len(points):,} later; a point cache needs one number, bake to alembic or usd"
            )
        self.file.write(points)

    def end(self) -> None:
        self.file.close()

    def place(self) -> None:
        obj = self.obj
        nodes, place = stack.sinew_modifier(obj), obj.modifiers.find(stack.armature_modifier(obj).name)
        shown = nodes.show_viewport, nodes.show_render
        _take_off(obj)
        modifier = obj.modifiers.new("Sinew Cache", "MESH_CACHE")
        obj.modifiers.move(len(obj.modifiers) - 1, place)
        modifier.show_viewport, modifier.show_render = shown
        modifier.cache_format = self.kind.upper()
        modifier.filepath = _beside(self.file.path)
        modifier.interpolation, modifier.deform_mode, modifier.time_mode = "LINEAR", "OVERWRITE", "FRAME"
        # Blender's own axes, so nothing is converted.
        modifier.forward_axis, modifier.up_axis = "POS_Y", "POS_Z"
        times = shape_animation.key_times(self.frames)
        if baked_files.is_even(times, 1):
            modifier.frame_start = times[0]
            return
        modifier.play_mode = "CUSTOM"
        path = f'modifiers["{bpy.utils.escape_identifier(modifier.name)}"].eval_frame'
        for sample, time in enumerate(times):
            modifier.eval_frame = sample
            obj.keyframe_insert(path, frame=time)
        shape_animation.make_straight(obj, path)

    @property
    def sentence(self) -> Phrase:
        return phrase("{name}: {count} frames", name=self.file.path.name, count=len(self.frames))

    @property
    def files(self) -> list[tuple[Path, Path]]:
        return [(self.file.unfinished, self.file.path)]

    def discard(self) -> None:
        self.file.discard()


class Bake(Started):
    """A bake of several meshes at once, so that every frame is evaluated once."""

    def __init__(
        self,
        meshes: list[bpy.types.Object],
        kind: str,
        frames: Sequence[float],
        folder: Path,
        overwrite: bool,
    ) -> None:
        self.frames, self.folder, self.made_folder = frames, folder, not folder.exists()
        self.bakes: list[ShapeKeys | Cache] = []
        scene = bpy.context.scene
        names: set[str] = set()
        with self.whole_or_nothing(), characters.kept_frame(scene):
            characters.set_frame(scene, frames[0])
            for obj in meshes:
                skinned_now(obj)
                if kind == SHAPE_KEYS:
                    self.bakes.append(ShapeKeys(obj, frames))
                else:
                    path = folder / f"{_file_name(obj, names)}.{kind}"
                    files.check_free(path, overwrite)
                    self.bakes.append(Cache(obj, frames, path, kind))
        self.what = ", ".join(obj.name for obj in meshes)

    def sample(self) -> Generator[float, None, None]:
        scene = bpy.context.scene
        with self.whole_or_nothing(), characters.kept_frame(scene):
            for number, frame in enumerate(self.frames):
                characters.set_frame(scene, frame)
                for one in self.bakes:
                    one.take(skinned_now(one.obj).points)
                yield (number + 1) / len(self.frames)
            for one in self.bakes:
                one.end()

    def place(self) -> None:
        with self.whole_or_nothing():
            for one in self.bakes:
                # Sinew's own position in the stack while it deforms, not the one while Blender does.
                attach.switch(one.obj, on=True)
                one.place()
                kept.note_sentences(one.obj, [one.sentence])

    @property
    def files(self) -> list[tuple[Path, Path]]:
        return [pair for one in self.bakes for pair in one.files]

    def discard(self) -> None:
        for one in self.bakes:
            one.discard()
        if self.made_folder and self.folder.exists() and not any(self.folder.iterdir()):
            self.folder.rmdir()


def start(
    meshes: list[bpy.types.Object],
    kind: str,
    frames: Sequence[float],
    target: Path,
    overwrite: bool,
    helpers: HelperOptions = DEFAULT_HELPERS,
    vat: VatOptions = DEFAULT_VAT,
) -> Started:
    """Returns a bake of skinned meshes. Caches are written to a folder beside `target`, exports to `target`,
    textures beside it.

    frames     ascending
    overwrite  whether existing files may be replaced
    helpers    for a bake to bones
    vat        for a bake to textures

    Raises SinewError where it is not possible.
    """
    if kind == baked_files.BONES:
        return BoneBake(meshes, frames, helpers)
    if kind == baked_files.VAT:
        return VatBake(meshes, frames, target, overwrite, vat)
    if kind in baked_files.EXPORTS:
        files.check_free(target, overwrite)
        return bake_export.SceneExport(meshes, kind, frames, target)
    return Bake(meshes, kind, frames, target.with_name(f"{target.stem}_cache"), overwrite)


def _take_off(obj: bpy.types.Object) -> None:
    """Takes Sinew off; the Armature modifiers stay, switched off, with their armatures, so that the artist
    can switch them on again."""
    run = [modifier.name for modifier in stack.armature_modifiers(obj)]
    take_off(obj)
    for name in run:
        modifier = obj.modifiers[name]
        modifier.show_viewport = modifier.show_render = False
        if not _mute(obj, f'modifiers["{bpy.utils.escape_identifier(name)}"].show_'):
            modifier.object = None


def _mute(obj: bpy.types.Object, start: str) -> bool:
    """Mutes the curves that set those paths. Returns whether none is left: curves of a linked action stay."""
    found = [curve for curve in curves_of(obj) if curve.data_path.startswith(start)]
    for curve in found:
        if curve.id_data.library is None:
            curve.mute = True
    return all(curve.mute for curve in found)


def _file_name(obj: bpy.types.Object, taken: set[str]) -> str:
    """Returns a name for an object's file, different for each object."""
    start = name = as_file_name(bpy.path.clean_name(obj.name))
    number = 1
    while name.lower() in taken:
        number += 1
        name = f"{start}_{number}"
    taken.add(name.lower())
    return name


def _beside(path: Path) -> str:
    """Returns a path as Blender writes it, relative to the folder of the open file if it has one."""
    try:
        return bpy.path.relpath(str(path.resolve())) if bpy.data.filepath else str(path.resolve())
    except ValueError:
        # On another drive.
        return str(path.resolve())
