# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures 3.6 to 3.11: pictures of deformed meshes, and what can be measured of them.

The files are opened one after the other, in place of the open one.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
import sinew
from sinew_addon.attach import attach
from sinew_addon.deform import characters
from sinew_addon.features.pages.render import Studio
from sinew_addon.features.pages.views import View, seen_extent, whole_view
from sinew_addon.io import armature_io, files, mesh_io

from . import meshes
from .model import Figure, Picture

LINKS, MESH = "report_links.blend", "report_mesh.blend"
# Keyframes of LINKS, and the frames of MESH where it is bent and where it is twisted most.
FIRST_KEY, SECOND_KEY = 12, 36
BENT, TWISTED = 16, 40


def figures(
    folder: Path, engine: str, size: int, scratch: Path, step: Callable[[str], None]
) -> tuple[Figure, ...]:
    """Returns all six figures.

    folder   with LINKS and MESH
    engine   "workbench" or "cycles"
    size     pixels of a picture
    scratch  a folder for temporary pictures
    step     called with a description before each step

    Raises SinewError where a file cannot be read.
    """
    step("Drawing Figures 3.6 to 3.8")
    hierarchies = _hierarchies(folder / LINKS, engine, size, scratch)
    step("Drawing Figures 3.9 to 3.11")
    return (*hierarchies, *_skins(folder / MESH, engine, size, scratch))


def _open(path: Path) -> bpy.types.Object:
    files.open_file(path)
    return characters.deformed_meshes(bpy.context.scene)[0]


def _studio(mesh: bpy.types.Object, engine: str, size: int) -> Studio:
    studio = Studio(bpy.context.scene, [mesh], engine, size)
    # In its own colours, if the engine shows them: they make twists visible.
    studio.scene.display.shading.color_type = "MATERIAL"
    return studio


def _draw(studio: Studio, view: View, scratch: Path) -> bytes:
    path = scratch / "picture.png"
    studio.picture(view, path)
    return path.read_bytes()


def _parents(armature: bpy.types.Object, bones: armature_io.Bones) -> np.ndarray:
    """int32 [bones]: the index of each bone's parent, -1 without one."""
    return np.array(
        [bones.names.index(bone.parent.name) if bone.parent else -1 for bone in armature.data.bones], np.int32
    )


def _pose(armature: bpy.types.Object, bones: armature_io.Bones, frame: int) -> np.ndarray:
    """float64 [bones, 4, 4] at a frame, to which the scene is set."""
    characters.set_frame(bpy.context.scene, frame)
    evaluated = armature.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return armature_io.read_pose(evaluated, bones).astype(np.float64)


def read_chain(mesh: bpy.types.Object) -> meshes.Chain:
    """Reads the links of an open LINKS at its two keyframes. Mesh and armature have the same origin."""
    armature = attach.armature_of(mesh)
    bones = armature_io.read_bones(armature)
    # Each vertex has one group, which is what these figures are about.
    group_of = mesh_io.read_group_weights(mesh.data).groups
    return meshes.Chain(
        points=mesh_io.read_points(mesh.data).astype(np.float64),
        triangles=mesh_io.read_surface(mesh.data).triangles,
        bones=bones.of_groups([group.name for group in mesh.vertex_groups])[group_of],
        parents=_parents(armature, bones),
        rest=bones.rest.astype(np.float64),
        first=_pose(armature, bones, FIRST_KEY),
        second=_pose(armature, bones, SECOND_KEY),
    )


def _hierarchies(path: Path, engine: str, size: int, scratch: Path) -> tuple[Figure, ...]:
    mesh = _open(path)
    chain = read_chain(mesh)
    shapes = {method: [chain.between(t, method) for t in meshes.TIMES] for method in meshes.HIERARCHIES}
    mesh.modifiers.clear()
    studio = _studio(mesh, engine, size)
    view = whole_view([seen_extent(shape) for row in shapes.values() for shape in row])
    drawn = []
    for row in shapes.values():
        for t, shape in zip(meshes.TIMES, row, strict=True):
            mesh.data.vertices.foreach_set("co", shape.astype(np.float32).ravel())
            mesh.data.update()
            drawn.append(Picture(f"t = {t:g}", _draw(studio, view, scratch)))
    # All at once, so that the three figures have the same scale.
    drawn = iter(meshes.trimmed(drawn))
    pictures = {method: [next(drawn) for _ in row] for method, row in shapes.items()}
    return meshes.hierarchy_figures(chain, shapes, pictures)


def _skins(path: Path, engine: str, size: int, scratch: Path) -> tuple[Figure, ...]:
    mesh = _open(path)
    scene = bpy.context.scene
    characters.set_frame(scene, scene.frame_start)
    rest = characters.world_points([mesh])
    triangles = mesh_io.read_surface(mesh.data).triangles
    groups = mesh_io.read_group_weights(mesh.data)
    skin = meshes.Skin(
        rest=rest,
        rest_volume=meshes.volume(rest, triangles),
        triangles=triangles,
        counts=groups.counts,
        groups=groups.groups,
        weights=groups.weights,
    )
    shapes: dict[int, dict[str, np.ndarray]] = {BENT: {}, TWISTED: {}}
    degrees = {}
    armature = attach.armature_of(mesh)
    bones = armature_io.read_bones(armature)
    at_rest = bones.rest.astype(np.float64)
    for frame, of_methods in shapes.items():
        posed = _pose(armature, bones, frame)
        degrees[frame] = meshes.joint_degrees(_parents(armature, bones), at_rest, at_rest, posed)
        for method in meshes.SKINS:
            characters.use_method(mesh, method)
            of_methods[method] = characters.world_points([mesh])
    studio = _studio(mesh, engine, size)
    pictures: dict[int, list[Picture]] = {}
    labels = {method.name: method.label for method in sinew.methods()}
    for frame, of_methods in shapes.items():
        characters.set_frame(scene, frame)
        view = whole_view([seen_extent(shape) for shape in of_methods.values()])
        pictures[frame] = []
        for number, method in enumerate(meshes.SKINS):
            characters.use_method(mesh, method)
            letter = f"({'abc'[number]}) " if number < 3 else ""
            pictures[frame].append(Picture(letter + labels[method], _draw(studio, view, scratch)))
        pictures[frame] = meshes.trimmed(pictures[frame])
    characters.set_frame(scene, scene.frame_start)
    view = whole_view([seen_extent(rest)])
    drawn = Picture("At rest: links, each with a bone", _draw(studio, view, scratch))
    return (
        meshes.figure_3_9(skin, *meshes.trimmed([drawn])),
        meshes.figure_3_10(skin, shapes[BENT], pictures[BENT], degrees[BENT]),
        meshes.figure_3_11(skin, shapes[TWISTED], pictures[TWISTED], degrees[TWISTED]),
    )
