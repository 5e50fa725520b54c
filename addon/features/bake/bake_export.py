# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes by Blender's own exporters: the final meshes, with UVs and materials."""

import errno
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import bpy

from ...attach import node_group, properties, stage_settings
from ...base.errors import SinewError
from ...base.output import remove, unfinished_path, writing
from ...deform import characters
from ...io import files
from . import bake_state, baked_files
from .bake_state import Started


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


# Options of the USD exporter. Copied into one folder `textures`, those of several exports could have the same
# name.
TEXTURES_STAY = {"export_textures_mode": "KEEP"} if bpy.app.version >= (4, 4) else {"export_textures": False}


def _usd(path: str, _first: int, _last: int) -> None:
    # Exports the final points instead of the armature and the shape keys, which do not include Sinew's
    # deformation.
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
        **TEXTURES_STAY,
    )


SCENES: dict[str, Callable[[str, int, int], None]] = {"alembic": _alembic, "usd": _usd}


class SceneExport(Started):
    """An export to one file: written to `unfinished` first, then moved to `path`. The exporter goes through
    the frames itself, and Sinew deforms as in a render.

    meshes   that Sinew deforms
    carried  other meshes that are exported with them, from carried_by()
    """

    def __init__(
        self, meshes: list[bpy.types.Object], kind: str, frames: Sequence[float], path: Path
    ) -> None:
        if not getattr(bpy.app, kind).supported:
            raise SinewError(f"This Blender is built without {kind}; bake to another kind")
        baked_files.check_frames(kind, frames)
        self.meshes, self.kind, self.frames, self.path = meshes, kind, frames, path
        self.what, self.carried = str(path), carried_by(meshes)
        self.unfinished = self._prepare()

    def report_progress(self, share: float) -> None:
        """Called with the progress, 0 to 1, within the exporter's single call, where sample() cannot yield.
        Callers may replace it by a function, which must not raise, as Blender ignores exceptions here."""

    @property
    def files(self) -> list[tuple[Path, Path]]:
        return [(self.unfinished, self.path)]

    def sample(self) -> Generator[float, None, None]:
        first, last = int(self.frames[0]), int(self.frames[-1])
        with self.whole_or_nothing(), _frames_of_scene(first, last), _without_own_groups(self.meshes):
            with selected([*self.meshes, *self.carried]), self._reporting_frames():
                self._export(first, last)
            for obj in self.meshes:
                bake_state.check_on(obj)
            yield 1.0

    def _prepare(self) -> Path:
        """Returns the temporary path; raises SinewError where the disk has no room for it."""
        for obj in self.meshes:
            bake_state.check_on(obj)
        vertices = sum(len(characters.final_points(obj)) for obj in (*self.meshes, *self.carried))
        # Points and normals.
        baked_files.check_space(self.path.parent, 24 * vertices * len(self.frames))
        unfinished = unfinished_path(self.path)
        remove(unfinished)
        with writing(self.path):
            self.path.parent.mkdir(parents=True, exist_ok=True)
            # Finds errors before the frames are read, and without an exporter's traceback.
            unfinished.touch()
            unfinished.unlink()
        return unfinished

    def _export(self, first: int, last: int) -> None:
        try:
            SCENES[self.kind](str(self.unfinished), first, last)
        except RuntimeError as error:
            raise SinewError(f"{self.path}: can not be written: {files.telling_line(error)}") from None
        if not self.unfinished.exists():
            raise SinewError(f"{self.path}: can not be written: Blender's exporter made no file")
        with writing(self.path):
            if not baked_files.is_whole(self.unfinished, self.kind):
                raise OSError(errno.ENOSPC, "the disk did not take all of it; is it full?")

    @contextmanager
    def _reporting_frames(self) -> Iterator[None]:
        """Context that reports each frame that the exporter goes to."""
        done = 0

        def on_frame(_scene: bpy.types.Scene, _depsgraph: bpy.types.Depsgraph) -> None:
            nonlocal done
            # At its end an exporter returns to the frame where it started.
            done = min(done + 1, len(self.frames))
            self.report_progress(done / len(self.frames))

        bpy.app.handlers.frame_change_post.append(on_frame)
        try:
            yield
        finally:
            bpy.app.handlers.frame_change_post.remove(on_frame)


def carried_by(meshes: list[bpy.types.Object]) -> list[bpy.types.Object]:
    """Returns the visible meshes that are parented, directly or not, to a bone of an armature that deforms
    one of `meshes`: eyes, armour, props."""
    armatures = {armature for obj in meshes for armature in properties.of(obj).armatures}

    def hangs_on_bone(obj: bpy.types.Object) -> bool:
        if obj.parent in armatures:
            return obj.parent_type == "BONE"
        return obj.parent is not None and hangs_on_bone(obj.parent)

    return [
        obj
        for obj in bpy.context.view_layer.objects
        if obj.type == "MESH" and obj not in meshes and obj.visible_get() and hangs_on_bone(obj)
    ]


@contextmanager
def _without_own_groups(meshes: list[bpy.types.Object]) -> Iterator[None]:
    """Context in which the final meshes lack the vertex groups of stages, which Alembic has with all others
    from 5.3 on."""
    added = []
    for obj in meshes:
        bones = {bone.name for armature in properties.of(obj).armatures for bone in armature.data.bones}
        names = set(stage_settings.vertex_groups(properties.of(obj)).values()) & set(obj.vertex_groups.keys())
        if names - bones:
            modifier = obj.modifiers.new("Sinew Groups", "NODES")
            modifier.node_group = _removing(sorted(names - bones))
            added.append((obj, modifier, modifier.node_group))
    try:
        yield
    finally:
        for obj, modifier, tree in added:
            obj.modifiers.remove(modifier)
            bpy.data.node_groups.remove(tree)


def _removing(names: list[str]) -> bpy.types.NodeTree:
    """Nodes that remove attributes of these names."""
    tree = bpy.data.node_groups.new("Sinew Groups", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    last = node_group.add(tree, "NodeGroupInput").outputs[0]
    for name in names:
        last = node_group.add(tree, "GeometryNodeRemoveAttribute", {"Geometry": last, "Name": name})
    node_group.add(tree, "NodeGroupOutput", {"Geometry": last})
    return tree


@contextmanager
def _frames_of_scene(first: float, last: float) -> Iterator[None]:
    """Context in which the scene has these frames, as exporters take them; afterwards it is at its own."""
    scene = bpy.context.scene
    before = scene.frame_start, scene.frame_end
    with characters.kept_frame(scene):
        scene.frame_start, scene.frame_end = int(first), int(last)
        try:
            yield
        finally:
            scene.frame_start, scene.frame_end = before


@contextmanager
def selected(objects: list[bpy.types.Object]) -> Iterator[None]:
    """Context in which only these objects are selected; afterwards the selection is as before."""
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
