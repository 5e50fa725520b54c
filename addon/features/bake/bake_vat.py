# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes to vertex animation textures: the final meshes at rest as .glb, with a UV map that says where in the
textures each vertex is."""

from __future__ import annotations

import json
from collections.abc import Generator, Sequence
from pathlib import Path

import bpy
import numpy as np

from ...attach import properties
from ...base.errors import SinewError
from ...base.output import unfinished_path, writing
from ...deform import characters
from ...io import files, mesh_io
from ...skinning.arrays import read
from ...skinning.vectors import transformed
from . import bake_state, baked_files, vat
from .bake_export import carried_by, selected
from .bake_state import Started

UV_MAP = "Sinew VAT"


class VatBake(Started):
    """A bake to NAME.glb, NAME_positions and NAME_normals, and NAME.json beside them.

    meshes  that Sinew deforms, and what their bones carry
    """

    def __init__(
        self,
        meshes: Sequence[bpy.types.Object],
        frames: Sequence[float],
        path: Path,
        overwrite: bool,
        options: vat.VatOptions,
    ) -> None:
        if not hasattr(bpy.types, "EXPORT_SCENE_OT_gltf"):
            raise SinewError("Switch on the add-on glTF 2.0 format in the preferences: it writes the mesh")
        for obj in meshes:
            bake_state.check_on(obj)
        self.meshes = [*meshes, *carried_by(list(meshes))]
        self.armatures = {armature for obj in meshes for armature in properties.of(obj).armatures}
        self.frames, self.path, self.what, self.options = frames, path, str(path), options
        ending = ".png" if options.texels == vat.PNG else ".exr"
        self.textures = [path.with_name(f"{path.stem}_{what}{ending}") for what in ("positions", "normals")]
        for _unfinished, each in self.files:
            files.check_free(each, overwrite)
        self.counts = [len(characters.final_points(obj)) for obj in self.meshes]
        self.layout = vat.Layout.of(sum(self.counts), len(frames))
        baked_files.check_space(path.parent, 24 * self.layout.width * self.layout.height)
        self._points: list[np.ndarray] = []
        self._normals: list[np.ndarray] = []

    @property
    def files(self) -> list[tuple[Path, Path]]:
        paths = self.path, *self.textures, self.path.with_suffix(".json")
        return [(unfinished_path(each), each) for each in paths]

    def sample(self) -> Generator[float, None, None]:
        scene = bpy.context.scene
        with self.whole_or_nothing(), characters.kept_frame(scene):
            for number, frame in enumerate(self.frames):
                characters.set_frame(scene, frame)
                points, normals = self._read()
                self._points.append(points)
                self._normals.append(normals)
                yield (number + 1) / (len(self.frames) + 1)
            for obj in self.meshes:
                if properties.has_sinew(obj):
                    bake_state.check_on(obj)
            characters.set_frame(scene, self.frames[0])
            self._write()
            yield 1.0

    def _read(self) -> tuple[np.ndarray, np.ndarray]:
        """float32 [vertices, 3] twice, in the world: where the final vertices are, and their normals."""
        depsgraph = bpy.context.evaluated_depsgraph_get()
        all_points, all_normals = [], []
        for obj, count in zip(self.meshes, self.counts, strict=True):
            evaluated = obj.evaluated_get(depsgraph)
            world, mesh = np.array(evaluated.matrix_world), evaluated.data
            points = mesh_io.read_points(mesh)
            if len(points) != count:
                raise SinewError(
                    f"{obj.name}: {count:,} vertices at first and {len(points):,} later; textures need one "
                    "number, bake to alembic or usd"
                )
            normals = _vertex_normals(mesh) @ np.linalg.pinv(world[:3, :3])
            lengths = np.linalg.norm(normals, axis=1, keepdims=True)
            all_points.append(transformed(points, world))
            all_normals.append(np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0.0))
        return tuple(np.concatenate(each).astype(np.float32) for each in (all_points, all_normals))

    def _write(self) -> None:
        with writing(self.path):
            self.path.parent.mkdir(parents=True, exist_ok=True)
        with characters.at_rest(self.armatures):
            rest, _normals = self._read()
            uv_map = self._export(self.files[0][0])
        axes, units = self.options.axes, vat.AXES[self.options.axes][1]
        positions = units * vat.in_axes(np.array(self._points, dtype=np.float64), axes)
        render = bpy.context.scene.render
        rate = render.fps / render.fps_base
        about = vat.description(self.layout, self.options, self.frames, rate, positions)
        samples = {
            "positions": positions - units * vat.in_axes(rest.astype(np.float64), axes),
            "normals": vat.in_axes(np.array(self._normals), axes),
        }
        for (unfinished, path), (name, values) in zip(self.files[1:], samples.items(), strict=False):
            data, back = vat.encoded(self.layout.texture(values), self.options.texels)
            about[name] = {"file": path.name, **back}
            with writing(path):
                unfinished.write_bytes(data)
        firsts = np.cumsum([0, *self.counts])
        about |= {
            "mesh": self.path.name,
            "uv_map": uv_map,
            "meshes": [
                {"name": obj.name, "first": int(first), "vertices": count}
                for obj, first, count in zip(self.meshes, firsts, self.counts, strict=False)
            ],
        }
        unfinished, path = self.files[-1]
        with writing(path):
            unfinished.write_text(json.dumps(about, indent=1, ensure_ascii=False), encoding="utf-8")

    def _export(self, path: Path) -> int:
        """Writes the final meshes as they are now; returns the number of the UV map with their places."""
        depsgraph = bpy.context.evaluated_depsgraph_get()
        places = np.split(self.layout.places(), np.cumsum(self.counts)[:-1])
        made = []
        try:
            for obj in self.meshes:
                mesh = bpy.data.meshes.new_from_object(
                    obj.evaluated_get(depsgraph), preserve_all_data_layers=True, depsgraph=depsgraph
                )
                copy = bpy.data.objects.new(f"{obj.name}_VAT", mesh)
                made.append(copy)
                world = obj.evaluated_get(depsgraph).matrix_world
                mesh.transform(world)
                if world.is_negative:
                    mesh.flip_normals()
                bpy.context.scene.collection.objects.link(copy)
            # The same number for all.
            number = max(1, *(len(copy.data.uv_layers) for copy in made))
            for copy, own in zip(made, places, strict=True):
                _add_places(copy.data, own, number)
            with selected(made), writing(self.path):
                bpy.ops.export_scene.gltf(
                    filepath=str(path),
                    export_format="GLB",
                    use_selection=True,
                    export_animations=False,
                    export_skins=False,
                    export_morph=False,
                )
                if not baked_files.is_whole(path, "gltf"):
                    raise OSError("the disk did not take all of it; is it full?")
        except RuntimeError as error:
            raise SinewError(f"{self.path}: can not be written: {files.telling_line(error)}") from None
        finally:
            for copy in made:
                mesh = copy.data
                bpy.data.objects.remove(copy)
                bpy.data.meshes.remove(mesh)
        return number


def _vertex_normals(mesh: bpy.types.Mesh) -> np.ndarray:
    """float [vertices, 3]: one for each vertex, also at a sharp edge."""
    if not mesh.has_custom_normals:
        return read(mesh.vertex_normals, "vector", 3)
    normals = np.zeros((len(mesh.vertices), 3), dtype=np.float32)
    np.add.at(normals, mesh_io.corner_vertices(mesh), mesh_io.corner_normals(mesh))
    return normals


def _add_places(mesh: bpy.types.Mesh, places: np.ndarray, number: int) -> None:
    """Adds the UV map of this number with the places of its vertices, and empty ones before it."""
    while len(mesh.uv_layers) <= number:
        name = UV_MAP if len(mesh.uv_layers) == number else "UVMap"
        if mesh.uv_layers.new(name=name, do_init=False) is None:
            raise SinewError("a mesh has as many UV maps as Blender allows, and needs one more; remove one")
    # Blender's begin at the bottom.
    uvs = places[mesh_io.corner_vertices(mesh)] * (1.0, -1.0) + (0.0, 1.0)
    mesh.uv_layers[number].uv.foreach_set("vector", uvs.astype(np.float32).ravel())
