# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of meshes in the open file, in clay or as heat maps, without the file's lights, materials and
cameras.

The open file's render settings, visibility and camera are changed: use it only for files that are not saved
afterwards.
"""

import shutil
from collections.abc import Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from ...base.errors import SinewError
from ...base.output import write_whole
from ...base.scratch import scratch_folder
from ...deform import characters
from ...io import read_only
from ...io.files import telling_line
from ..measure.heat_scale import linear
from .opengl import default_engine
from .views import View, camera_axes, of_one_size, seen_extent, whole_view

CLAY = (0.72, 0.66, 0.6)
HEAT = "sinew_heat"
PNG_END = b"IEND\xaeB`\x82"


def chosen_engine(wanted: str) -> str:
    """Returns the engine, "workbench" or "cycles", for a name or "auto".

    Raises SinewError where it cannot render here.
    """
    if wanted == "cycles":
        return wanted
    engine = default_engine(bpy.app.binary_path)
    if wanted not in ("auto", engine):
        raise SinewError("there is no OpenGL here, which Workbench needs; use --engine cycles")
    return engine


def whole_views(
    meshes: list[bpy.types.Object], methods: Iterable[str], frames: Iterable[float]
) -> list[View]:
    """For each frame, a view that contains the final meshes under all methods; all views have one size."""
    extents: dict[float, list[np.ndarray]] = {frame: [] for frame in frames}
    for method in methods:
        characters.use_method_on(meshes, method)
        for frame, own in extents.items():
            characters.set_frame(bpy.context.scene, frame)
            own.append(seen_extent(characters.world_points(meshes)))
    return of_one_size([whole_view(own) for own in extents.values()])


class Studio:
    """Renders only some meshes, on a transparent background."""

    def __init__(
        self,
        scene: bpy.types.Scene,
        meshes: list[bpy.types.Object],
        engine: str,
        size: int,
        halved: bool = False,
    ) -> None:
        """Sets the scene up.

        engine  "workbench" or "cycles"
        size    pixels of a picture's longer side
        halved  pictures are displayed at half their size, which smooths edges: so fewer samples per pixel are
                enough
        """
        self.scene, self.engine, self._size = scene, engine, size
        for obj in scene.objects:
            obj.hide_render = obj not in meshes
        for obj in meshes:
            obj.visible_camera = True
            obj.display_type = "TEXTURED"
        _prepare_output(scene)
        scene.camera = bpy.data.objects.new("Sinew Camera", bpy.data.cameras.new("Sinew Camera"))
        scene.collection.objects.link(scene.camera)
        if engine == "workbench":
            _prepare_workbench(scene, halved)
        else:
            self._clay, self._heat = _prepare_cycles(scene, halved)
        if halved:
            # Dither makes a file larger by half.
            scene.render.dither_intensity = 0.0
        self._show(heat=False)

    def painted(
        self, meshes: Sequence[bpy.types.Object], colours: Sequence[np.ndarray]
    ) -> AbstractContextManager[None]:
        """Context in which painted copies of the meshes, as they are evaluated now, are shown instead.

        colours  for each mesh [vertices, 3], sRGB in 0..1
        """
        copies = [_painted_copy(obj, own) for obj, own in zip(meshes, colours, strict=True)]
        return self._shown_instead(meshes, copies)

    @contextmanager
    def _shown_instead(
        self, meshes: Sequence[bpy.types.Object], copies: Sequence[bpy.types.Object]
    ) -> Iterator[None]:
        for obj, copy in zip(meshes, copies, strict=True):
            obj.hide_render = True
            self.scene.collection.objects.link(copy)
        self._show(heat=True)
        try:
            yield
        finally:
            self._show(heat=False)
            for obj, copy in zip(meshes, copies, strict=True):
                obj.hide_render = False
                mesh = copy.data
                bpy.data.objects.remove(copy)
                bpy.data.meshes.remove(mesh)

    def _show(self, heat: bool) -> None:
        """Shows colours of a heat map, or clay."""
        if self.engine != "workbench":
            for layer in self.scene.view_layers:
                layer.material_override = self._heat if heat else self._clay
            return
        shading = self.scene.display.shading
        # Colours have to be legible, so they get the most even of Blender's lights, without gloss.
        shading.color_type, shading.studio_light = ("VERTEX", "paint.sl") if heat else ("SINGLE", "Default")
        shading.show_specular_highlight = shading.show_cavity = not heat

    def picture(self, view: View, path: Path) -> None:
        """Renders the region of `view` to the PNG `path`."""
        camera = self.scene.camera
        right, up = camera_axes(view.direction)
        matrix = np.identity(4)
        matrix[:3, 0], matrix[:3, 1], matrix[:3, 2] = right, up, view.direction
        matrix[:3, 3] = view.target + view.depth * view.direction
        camera.matrix_world = Matrix(matrix.tolist())
        camera.data.type = "ORTHO"
        camera.data.sensor_fit = "AUTO"
        camera.data.ortho_scale = max(view.width, view.height)
        camera.data.clip_start = 1e-4 * view.depth
        camera.data.clip_end = 2 * view.depth
        render = self.scene.render
        render.resolution_x, render.resolution_y = view.pixels(self._size)
        draw(self.scene, path)


def use_own_look(scene: bpy.types.Scene, path: Path) -> None:
    """Has draw() use the file's own camera and settings. Raises SinewError where it has no camera."""
    if scene.camera is None:
        raise SinewError(f"{path}: has no camera to look through; leave --own-look away for clay pictures")
    _prepare_png(scene)


def draw(scene: bpy.types.Scene, path: Path) -> None:
    """Renders the current frame to the PNG `path`; raises SinewError where it cannot be written."""
    with scratch_folder() as folder:
        # Not to `path` itself: Blender replaces each # and {} in it.
        drawn = folder / "picture.png"
        scene.render.filepath = str(drawn)
        try:
            bpy.ops.render.render(write_still=True, scene=scene.name)
        except RuntimeError as error:
            raise SinewError(f"{path}: can not be drawn: {telling_line(error)}") from None
        # Up to 5.2 Blender does not notice a full disk.
        if not drawn.exists() or not drawn.read_bytes().endswith(PNG_END):
            raise SinewError(f"{path}: can not be drawn: {folder.parent} did not take all of it; is it full?")
        write_whole(path, lambda unfinished: shutil.copyfile(drawn, unfinished))


def _painted_copy(obj: bpy.types.Object, colours: np.ndarray) -> bpy.types.Object:
    """Returns an object in no scene, with the evaluated mesh of `obj` and the colour attribute HEAT."""
    evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = bpy.data.meshes.new_from_object(evaluated)
    attribute = mesh.color_attributes.new(HEAT, "FLOAT_COLOR", "POINT")
    values = np.ones((len(colours), 4), dtype=np.float32)
    values[:, :3] = linear(colours)
    attribute.data.foreach_set("color", values.ravel())
    index = mesh.color_attributes.find(HEAT)
    mesh.color_attributes.active_color_index = mesh.color_attributes.render_color_index = index
    copy = bpy.data.objects.new(f"{obj.name} Sinew Heat", mesh)
    copy.matrix_world = evaluated.matrix_world
    return copy


def _prepare_output(scene: bpy.types.Scene) -> None:
    render = scene.render
    render.resolution_percentage = 100
    render.pixel_aspect_x = render.pixel_aspect_y = 1.0
    render.film_transparent = True
    render.use_border = render.use_compositing = render.use_sequencer = False
    render.use_freestyle = render.use_multiview = render.use_motion_blur = render.use_stamp = False
    _prepare_png(scene)
    scene.view_settings.view_transform = "Standard"
    scene.view_settings.look = "None"
    scene.view_settings.exposure, scene.view_settings.gamma = 0.0, 1.0


def _prepare_png(scene: bpy.types.Scene) -> None:
    read_only.prepare_render()
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format = "PNG"
    settings.color_mode = "RGBA"
    settings.color_depth = "8"


def _prepare_workbench(scene: bpy.types.Scene, halved: bool) -> None:
    scene.render.engine = "BLENDER_WORKBENCH"
    scene.display.render_aa = "OFF" if halved else "8"
    shading = scene.display.shading
    shading.type = "SOLID"
    shading.light = "STUDIO"
    shading.single_color = CLAY
    # World-space cavity is grainy with a single sample.
    shading.cavity_type = "SCREEN" if halved else "BOTH"
    shading.show_shadows = shading.show_xray = shading.show_object_outline = False
    shading.show_backface_culling = False


def _prepare_cycles(scene: bpy.types.Scene, halved: bool) -> tuple[bpy.types.Material, bpy.types.Material]:
    """Sets up lights and sampling; returns materials for clay and for heat."""
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = 4 if halved else 16
    scene.cycles.use_denoising = False
    scene.world = bpy.data.worlds.new("Sinew World")
    scene.world.color = (0.25, 0.26, 0.28)
    for name, energy, turn in (("Key", 2.0, (0.9, 0.2, 0.5)), ("Fill", 0.6, (1.0, 0.0, -0.9))):
        light = bpy.data.objects.new(f"Sinew {name}", bpy.data.lights.new(f"Sinew {name}", "SUN"))
        light.data.energy = energy
        light.rotation_euler = turn
        scene.collection.objects.link(light)
    clay, _shader = _matt_material("Sinew Clay")
    heat, shader = _matt_material("Sinew Heat")
    shader.inputs["Specular IOR Level"].default_value = 0.0
    colours = heat.node_tree.nodes.new("ShaderNodeVertexColor")
    colours.layer_name = HEAT
    heat.node_tree.links.new(colours.outputs["Color"], shader.inputs["Base Color"])
    return clay, heat


def _matt_material(name: str) -> tuple[bpy.types.Material, bpy.types.ShaderNode]:
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = (*CLAY, 1.0)
    shader.inputs["Roughness"].default_value = 0.6
    return material, shader
