# SPDX-License-Identifier: GPL-3.0-or-later
"""Clay pictures of meshes in the open file, without its own lights, materials and cameras.

The open file's render settings, visibility and camera are changed: for files that are opened only to be
looked at.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from ..core.compare import View, camera_axes

CLAY = (0.72, 0.66, 0.6)
_PROBE = (
    "import bpy; s = bpy.context.scene; s.render.engine = 'BLENDER_WORKBENCH'; "
    "s.render.resolution_x = s.render.resolution_y = 8; bpy.ops.render.render()"
)


def has_opengl() -> bool:
    """Whether Workbench can render here. Tried in a process of its own: without OpenGL, Blender aborts."""
    if bpy.app.binary_path:
        command = [bpy.app.binary_path, "--background", "--factory-startup", "--python-expr", _PROBE]
    else:  # bpy as a module
        command = [sys.executable, "-c", _PROBE]
    try:
        probe = subprocess.run(
            command, stdin=subprocess.DEVNULL, capture_output=True, timeout=60, check=False
        )
    except (OSError, subprocess.TimeoutExpired):
        return False
    return probe.returncode == 0


def prepare(scene: bpy.types.Scene, meshes: list[bpy.types.Object], engine: str, size: int) -> None:
    """Makes `scene` render nothing but `meshes`, in clay, `size` pixels square, on a clear background.

    engine  "workbench" or "cycles"
    """
    for obj in scene.objects:
        obj.hide_render = obj not in meshes
    for obj in meshes:
        obj.visible_camera = True
        obj.display_type = "TEXTURED"
    render = scene.render
    render.resolution_x = render.resolution_y = size
    render.resolution_percentage = 100
    render.pixel_aspect_x = render.pixel_aspect_y = 1.0
    render.film_transparent = True
    render.use_border = render.use_compositing = render.use_sequencer = False
    render.use_freestyle = render.use_multiview = render.use_motion_blur = render.use_stamp = False
    if hasattr(render.image_settings, "media_type"):
        render.image_settings.media_type = "IMAGE"
    render.image_settings.file_format = "PNG"
    render.image_settings.color_mode = "RGBA"
    render.image_settings.color_depth = "8"
    scene.view_settings.view_transform = "Standard"
    scene.view_settings.look = "None"
    scene.view_settings.exposure, scene.view_settings.gamma = 0.0, 1.0
    scene.camera = bpy.data.objects.new("Sinew Camera", bpy.data.cameras.new("Sinew Camera"))
    scene.collection.objects.link(scene.camera)
    if engine == "workbench":
        _prepare_workbench(scene)
    else:
        _prepare_cycles(scene)


def picture(scene: bpy.types.Scene, view: View, path: Path) -> None:
    """Renders what `view` sees to the PNG `path`."""
    camera = scene.camera
    right, up = camera_axes(view.direction)
    matrix = np.identity(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2] = right, up, view.direction
    matrix[:3, 3] = view.target + view.depth * view.direction
    camera.matrix_world = Matrix(matrix.tolist())
    camera.data.type = "ORTHO"
    camera.data.ortho_scale = view.size
    camera.data.clip_start = 1e-4 * view.depth
    camera.data.clip_end = 2 * view.depth
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True, scene=scene.name)


def _prepare_workbench(scene: bpy.types.Scene) -> None:
    scene.render.engine = "BLENDER_WORKBENCH"
    scene.display.render_aa = "8"
    shading = scene.display.shading
    shading.type = "SOLID"
    shading.light = "STUDIO"
    shading.color_type = "SINGLE"
    shading.single_color = CLAY
    shading.show_cavity = True
    shading.cavity_type = "BOTH"
    shading.show_shadows = shading.show_xray = shading.show_object_outline = False
    shading.show_backface_culling = False


def _prepare_cycles(scene: bpy.types.Scene) -> None:
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = 16
    scene.cycles.use_denoising = False
    clay = bpy.data.materials.new("Sinew Clay")
    clay.diffuse_color = (*CLAY, 1.0)
    clay.use_nodes = True
    shader = next(node for node in clay.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = (*CLAY, 1.0)
    shader.inputs["Roughness"].default_value = 0.6
    for layer in scene.view_layers:
        layer.material_override = clay
    scene.world = bpy.data.worlds.new("Sinew World")
    scene.world.color = (0.25, 0.26, 0.28)
    for name, energy, turn in (("Key", 2.0, (0.9, 0.2, 0.5)), ("Fill", 0.6, (1.0, 0.0, -0.9))):
        light = bpy.data.objects.new(f"Sinew {name}", bpy.data.lights.new(f"Sinew {name}", "SUN"))
        light.data.energy = energy
        light.rotation_euler = turn
        scene.collection.objects.link(light)
