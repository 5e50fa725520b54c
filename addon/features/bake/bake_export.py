# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes by Blender's own exporters: the final meshes, with UVs and materials."""

import errno
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from ...attach import properties
from ...core import bake as core
from ...core.errors import SinewError
from ...core.output import remove, writing
from ...core.spaces import transformed
from ...deform import characters, session
from ...io import files
from . import bake_state, shape_animation, usd_textures
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
        **usd_textures.LEFT_WHERE_THEY_ARE,
    )


SCENES: dict[str, Callable[[str, int, int], None]] = {"alembic": _alembic, "usd": _usd}
GLTF = "gltf"
# Reading the frames is this share of a glTF export.
SAMPLED = 0.5


class _Export(Started):
    """An export to one file: written to `unfinished` first, then moved to `path`.

    meshes   that Sinew deforms
    carried  other meshes that are exported with them, from carried_by()
    """

    kind: str
    meshes: list[bpy.types.Object]
    carried: list[bpy.types.Object]
    path: Path
    unfinished: Path

    def report_progress(self, share: float) -> None:
        """Called with the progress, 0 to 1, where sample() cannot yield: within an exporter's single call.
        Callers may replace it by a function, which must not raise, as Blender ignores exceptions here."""

    @contextmanager
    def whole_in_a_copy(self) -> Iterator[None]:
        """A copy of the file that is saved inside this context has everything that the export needs."""
        yield

    @property
    def what(self) -> str:
        return str(self.path)

    @property
    def files(self) -> list[tuple[Path, Path]]:
        return [(self.unfinished, self.path)]

    def discard(self) -> None:
        remove(self.unfinished)


class SceneExport(_Export):
    """Alembic and USD. The exporter goes through the frames itself, and Sinew deforms as in a render."""

    def __init__(
        self,
        meshes: list[bpy.types.Object],
        kind: str,
        frames: Sequence[float],
        path: Path,
        overwrite: bool,
    ) -> None:
        if not getattr(bpy.app, kind).supported:
            raise SinewError(f"This Blender is built without {kind}; bake to another kind")
        core.check_frames(kind, frames)
        self.meshes, self.kind, self.frames, self.path = meshes, kind, frames, path
        self.carried = carried_by(meshes)
        self.first, self.last = int(frames[0]), int(frames[-1])
        textured = [*meshes, *self.carried] if kind == "usd" else ()
        self.textures = usd_textures.Textures(textured, path, overwrite)
        self.unfinished = _prepare(self, path)

    def sample(self) -> Generator[float, None, None]:
        first, last = self.first, self.last
        with self.whole_or_nothing(), _frames_of_scene(first, last):
            with (
                _selected([*self.meshes, *self.carried]),
                self.textures.on_disk(),
                _reporting_frames(self, 0.0),
            ):
                _export(lambda: SCENES[self.kind](str(self.unfinished), first, last), self)
            for obj in self.meshes:
                bake_state.check_on(obj)
            yield 1.0

    def whole_in_a_copy(self) -> AbstractContextManager[None]:
        return self.textures.on_disk()

    @property
    def files(self) -> list[tuple[Path, Path]]:
        # Textures already have their final names, as the exported file refers to them.
        return [*((path, path) for path in self.textures.written), *super().files]

    def discard(self) -> None:
        super().discard()
        self.textures.discard()


class MorphExport(_Export):
    """glTF: the final meshes of the first frame, with the points of the other frames as morph targets."""

    def __init__(self, meshes: list[bpy.types.Object], frames: Sequence[float], path: Path) -> None:
        core.check_frames(GLTF, frames)
        self.meshes, self.kind, self.frames, self.path = meshes, GLTF, frames, path
        self.carried = carried_by(meshes)
        self.unfinished = _prepare(self, path)
        self.made: list[bpy.types.Object] = []
        self.samples: dict[bpy.types.Object, list[np.ndarray]] = {obj: [] for obj in (*meshes, *self.carried)}
        self.spaces: dict[bpy.types.Object, Matrix] = {}

    def sample(self) -> Generator[float, None, None]:
        scene = bpy.context.scene
        with self.whole_or_nothing(), characters.kept_frame(scene), self._removing():
            for number, frame in enumerate(self.frames):
                characters.set_frame(scene, frame)
                for obj in self.meshes:
                    bake_state.check_on(obj)
                for obj, samples in self.samples.items():
                    points = self._in_first_space(obj)
                    if samples and len(points) != len(samples[0]):
                        raise SinewError(
                            f"{obj.name}: {len(samples[0]):,} vertices at first and {len(points):,} at frame "
                            f"{frame:g}; morph targets need one number, bake to alembic or usd"
                        )
                    samples.append(points)
                yield SAMPLED * (number + 1) / len(self.frames)
            characters.set_frame(scene, self.frames[0])
            self._make()
            with _unstretched(scene), _selected(self.made):
                for made, samples in zip(self.made, self.samples.values(), strict=True):
                    shape_animation.add(made, self.frames, samples)
                with _frames_of_scene(self.frames[0], self.frames[-1]), _reporting_frames(self, SAMPLED):
                    _export(self._write, self)
        yield 1.0

    def _in_first_space(self, obj: bpy.types.Object) -> np.ndarray:
        """Returns the final points in the object's space of the first frame, as only morph targets are
        animated."""
        points = characters.final_points(obj)
        world = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).matrix_world.copy()
        first = self.spaces.setdefault(obj, world)
        if world == first:
            return points
        if not first.determinant():
            raise SinewError(
                f"{obj.name} is scaled to nothing at the first frame, and not later; begin at another frame"
            )
        first_from_now = np.linalg.inv(np.array(first, dtype=np.float64)) @ np.array(world, dtype=np.float64)
        return transformed(points, first_from_now).astype(np.float32)

    def _make(self) -> None:
        depsgraph = bpy.context.evaluated_depsgraph_get()
        for obj in self.samples:
            evaluated = obj.evaluated_get(depsgraph)
            mesh = bpy.data.meshes.new_from_object(evaluated, depsgraph=depsgraph)
            # The exporter has to compute the normals of each shape.
            state = session.state_of(obj)
            if state is not None:
                state.take_off_normals(mesh)
            mesh.name = f"{obj.data.name} baked"
            made = bpy.data.objects.new(f"{obj.name} baked", mesh)
            made.matrix_world = self.spaces[obj]
            bpy.context.scene.collection.objects.link(made)
            self.made.append(made)

    def _write(self) -> None:
        bpy.ops.export_scene.gltf(
            filepath=str(self.unfinished),
            check_existing=False,
            export_format="GLB",
            use_selection=True,
            # Other scenes have their own selections.
            use_active_scene=True,
            export_animations=True,
            # One animation for all meshes, as players play only one.
            export_animation_mode="ACTIVE_ACTIONS",
            export_morph=True,
            export_morph_animation=True,
            export_skins=False,
            export_frame_range=True,
        )

    @contextmanager
    def _removing(self) -> Iterator[None]:
        """Context after which the copies are gone."""
        try:
            yield
        finally:
            for made in self.made:
                keys = made.data.shape_keys
                action = keys.animation_data.action if keys is not None and keys.animation_data else None
                bpy.data.meshes.remove(made.data)
                if action is not None:
                    bpy.data.actions.remove(action)
            self.made.clear()


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


def _prepare(export: SceneExport | MorphExport, path: Path) -> Path:
    """Returns the temporary path of the export; raises SinewError where the disk has no room for it."""
    for obj in export.meshes:
        bake_state.check_on(obj)
    vertices = sum(len(characters.final_points(obj)) for obj in (*export.meshes, *export.carried))
    # Points and normals.
    core.check_space(path.parent, 24 * vertices * len(export.frames))
    unfinished = path.with_name(f".{path.stem}.unfinished{path.suffix}")
    remove(unfinished)
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        # Finds errors before the frames are read, and without an exporter's traceback.
        unfinished.touch()
        unfinished.unlink()
    return unfinished


def _export(write: Callable[[], None], export: SceneExport | MorphExport) -> None:
    try:
        write()
    except RuntimeError as error:
        raise SinewError(f"{export.path}: can not be written: {files.telling_line(error)}") from None
    if not export.unfinished.exists():
        raise SinewError(f"{export.path}: can not be written: Blender's exporter made no file")
    with writing(export.path):
        if not core.is_whole(export.unfinished, export.kind):
            raise OSError(errno.ENOSPC, "the disk did not take all of it; is it full?")


@contextmanager
def _reporting_frames(export: SceneExport | MorphExport, start: float) -> Iterator[None]:
    """Context that reports each frame that an exporter goes to, from the progress `start` on."""
    done = 0

    def on_frame(_scene: bpy.types.Scene, _depsgraph: bpy.types.Depsgraph) -> None:
        nonlocal done
        # At its end an exporter returns to the frame where it started.
        done = min(done + 1, len(export.frames))
        export.report_progress(start + (1.0 - start) * done / len(export.frames))

    bpy.app.handlers.frame_change_post.append(on_frame)
    try:
        yield
    finally:
        bpy.app.handlers.frame_change_post.remove(on_frame)


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
def _unstretched(scene: bpy.types.Scene) -> Iterator[None]:
    """Context without the scene's time remapping, which the glTF exporter ignores."""
    render = scene.render
    before = render.frame_map_old, render.frame_map_new
    render.frame_map_old = render.frame_map_new = 100
    try:
        yield
    finally:
        render.frame_map_old, render.frame_map_new = before


@contextmanager
def _selected(objects: list[bpy.types.Object]) -> Iterator[None]:
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
