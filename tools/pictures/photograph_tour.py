# SPDX-License-Identifier: GPL-3.0-or-later
"""The photographs of docs/tour.md: human.blend in clothes, from the first click to a rendered comparison.

    blender --factory-startup --enable-event-simulate human.blend --python tools/pictures/photograph_tour.py -- sinew.zip FOLDER

The window has 1280 x 800 pixels; places are those of its picture.
"""  # noqa: E501

from __future__ import annotations

import sys
from collections.abc import Collection, Iterator
from pathlib import Path

import bmesh
import bpy

sys.path.insert(0, str(Path(__file__).parent))
import window

ZIP, FOLDER = window.arguments()
FRAME = 32
# Of each piece of clothes, the starts of its bones' names, its thickness and its colour.
CLOTHES = {
    "Shirt": (("spine", "clavicle", "upperarm"), 0.012, (0.10, 0.22, 0.45, 1.0)),
    "Trousers": (("pelvis", "thigh", "calf"), 0.010, (0.09, 0.09, 0.10, 1.0)),
    "Shoes": (("foot", "ball"), 0.014, (0.35, 0.12, 0.06, 1.0)),
}
SKIN = (0.80, 0.56, 0.44, 1.0)
VIEW, ADD, METHOD = (400, 500), (880, 125), (930, 128)
STAGES, MESHES = (790, 204), (790, 231)
# Panels' headers while all are closed.
HEADERS = {
    name: (850, 97 + 28 * number)
    for number, name in enumerate(
        ("Sinew", "Variants", "Suggest", "Range of Motion", "Flex", "Heat Map", "Diagnostics")
    )
}


def photograph(name: str) -> None:
    window.photograph(FOLDER / f"tour-{name}.webp")


def main_bones(obj: bpy.types.Object) -> list[str]:
    """The group that weighs most at each vertex."""
    names = [group.name for group in obj.vertex_groups]
    return [
        names[max(vertex.groups, key=lambda each: each.weight).group] if vertex.groups else ""
        for vertex in obj.data.vertices
    ]


def dress(body: bpy.types.Object) -> None:
    bones = main_bones(body)
    _colour(body, SKIN)
    for name, (starts, thickness, colour) in CLOTHES.items():
        piece = body.copy()
        piece.data = body.data.copy()
        piece.name = name
        bpy.context.scene.collection.objects.link(piece)
        _keep(piece.data, {index for index, bone in enumerate(bones) if bone.startswith(starts)})
        solidify = piece.modifiers.new("Solidify", "SOLIDIFY")
        solidify.thickness, solidify.offset = thickness, 1.0
        _colour(piece, colour)


def _keep(mesh: bpy.types.Mesh, vertices: Collection[int]) -> None:
    edited = bmesh.new()
    edited.from_mesh(mesh)
    lost = [face for face in edited.faces if not all(v.index in vertices for v in face.verts)]
    bmesh.ops.delete(edited, geom=lost, context="FACES")
    edited.to_mesh(mesh)
    edited.free()


def _colour(obj: bpy.types.Object, colour: tuple[float, ...]) -> None:
    material = bpy.data.materials.new(obj.name)
    material.diffuse_color = colour
    obj.data.materials.clear()
    obj.data.materials.append(material)


def start() -> Iterator[None]:
    window.install(ZIP)
    dress(bpy.data.objects["Human"])
    bpy.context.scene.frame_set(FRAME)
    with window.in_view3d():
        shading = bpy.context.space_data.shading
        shading.color_type, shading.light = "MATERIAL", "STUDIO"
        bpy.context.space_data.overlay.show_cursor = False
    window.select_only(bpy.data.objects["Human"])
    window.open_sidebar()
    window.look_from_front((0.35, 0.0, 0.0), 2.6)
    yield from window.wait()
    window.choose_tab()
    yield from window.wait()


def add_and_choose() -> Iterator[None]:
    photograph("1-select")
    yield from window.click(ADD)
    photograph("2-added")
    yield from window.click(METHOD)
    yield from window.wait()
    photograph("3-methods")
    window.press("ESC", METHOD)
    yield from window.wait()
    bpy.context.scene.sinew_character.method = "dq"
    yield from window.click(MESHES)
    yield from window.click(STAGES)
    bpy.context.scene.sinew_character.delta_mush.enabled = True
    yield from window.wait()
    photograph("4-stages-and-meshes")
    bpy.context.scene.sinew_character.delta_mush.enabled = False
    yield from window.wait()


def suggest() -> Iterator[None]:
    with window.in_view3d():
        bpy.context.scene.frame_start, bpy.context.scene.frame_end = 30, 34
        bpy.ops.sinew.suggest("EXEC_DEFAULT", over="SCENE")
        bpy.context.scene.frame_set(FRAME)
    yield from window.wait()
    photograph("5-suggest")
    yield from window.click(HEADERS["Suggest"])


def heat_map() -> Iterator[None]:
    with window.in_view3d():
        bpy.ops.sinew.heat_map("INVOKE_DEFAULT")
    yield from window.click(HEADERS["Heat Map"])
    yield from window.wait()
    photograph("6-heat-map")
    with window.in_view3d():
        bpy.ops.sinew.heat_map("INVOKE_DEFAULT")
    yield from window.click(HEADERS["Heat Map"])


def diagnostics() -> Iterator[None]:
    body = bpy.data.objects["Human"]
    for group in body.vertex_groups:
        group.remove(list(range(3000, 3020)))
    bpy.data.objects["Shirt"].vertex_groups.new(name="Spine_old")
    with window.in_view3d():
        bpy.ops.sinew.check("INVOKE_DEFAULT")
    yield from window.click(HEADERS["Diagnostics"])
    yield from window.wait()
    photograph("7-diagnostics")
    with window.in_view3d():
        bpy.ops.sinew.mend("EXEC_DEFAULT", object="Human", finding="no_weights", how="fill")
        bpy.ops.sinew.mend("EXEC_DEFAULT", object="Shirt", finding="boneless_groups", how="remove")
    yield from window.wait()
    yield from window.click(HEADERS["Diagnostics"])


def pie() -> Iterator[None]:
    window.press("Y", VIEW, alt=True, shift=True)
    yield from window.wait(5)
    photograph("8-pie")
    window.press("ESC", VIEW)
    yield from window.wait()


def compare() -> Iterator[None]:
    window.move(VIEW)
    yield
    with window.in_view3d():
        bpy.ops.sinew.compare("EXEC_DEFAULT", methods={"lbs", "dq"})
    yield from window.wait()
    photograph("9-compare")


def render() -> None:
    scene = bpy.context.scene
    state = scene.sinew_comparison
    state.collection.hide_render = False
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    camera.data.type, camera.data.ortho_scale = "ORTHO", max(3.6 * state.spacing, 3.4)
    camera.location, camera.rotation_euler = (state.spacing, -5.0, 0.0), (1.5707963, 0.0, 0.0)
    scene.render.engine = "BLENDER_WORKBENCH"
    scene.display.shading.color_type = "MATERIAL"
    scene.display.shading.light = "STUDIO"
    scene.render.resolution_x, scene.render.resolution_y = 1280, 720
    scene.render.resolution_percentage = 100
    scene.render.film_transparent = False
    scene.display.shading.background_type = "VIEWPORT"
    scene.display.shading.background_color = (0.05, 0.05, 0.05)
    scene.render.image_settings.file_format = "WEBP"
    scene.render.image_settings.color_mode = "RGB"
    scene.render.image_settings.quality = 80
    scene.render.filepath = str(FOLDER / "tour-10-render.webp")
    bpy.ops.render.render(write_still=True)


def steps() -> Iterator[None]:
    yield from start()
    yield from add_and_choose()
    yield from window.close_panels(HEADERS["Sinew"])
    yield from suggest()
    yield from heat_map()
    yield from diagnostics()
    yield from pie()
    yield from compare()
    render()
    print("TOUR", flush=True)


window.run(steps(), 0.3)
