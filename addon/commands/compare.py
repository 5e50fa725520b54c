# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew compare`: one picture of a frame under several methods."""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np

from ..core.compare import Column, close_view, require_pillow, whole_view, write_sheet
from ..core.errors import SinewError
from ..core.frames import parse_frames
from ..core.metrics import volume
from .console import Console


def add_parser(subparsers: argparse._SubParsersAction) -> argparse.ArgumentParser:
    parser = subparsers.add_parser(
        "compare",
        help="draw a frame under several methods, side by side",
        description="Draws one sheet: a column for each method, the same camera for all, framed on the mesh, "
        "with a close-up of the place where the methods differ most and the volume against the rest pose.",
    )
    parser.add_argument("file", type=Path, metavar="FILE", help=".blend, .glb, .gltf or .fbx")
    parser.add_argument(
        "--methods",
        default="lbs,qv,dq",
        help="of `sinew methods`, and blender for the Armature modifier (default: %(default)s)",
    )
    parser.add_argument("--frame", required=True, help="the frame to draw")
    parser.add_argument("--object", metavar="NAME", help="only this mesh")
    parser.add_argument("--size", type=int, default=640, help="pixels of each picture (default: %(default)s)")
    parser.add_argument(
        "--engine",
        choices=("auto", "workbench", "cycles"),
        default="auto",
        help="auto: Workbench, or Cycles where there is no OpenGL",
    )
    parser.add_argument("--out", required=True, type=Path, metavar="SHEET.png")
    return parser


def run(args: argparse.Namespace, console: Console) -> int:
    import bpy

    from ..blender import evaluate, files, render

    require_pillow()
    methods = [name.strip() for name in args.methods.split(",")]
    evaluate.check_methods(methods)
    frames = parse_frames(args.frame)
    if len(frames) != 1:
        raise SinewError(f"frame: expected one frame, got {args.frame!r}")
    if not 64 <= args.size <= 4096:
        raise SinewError(f"size: expected 64 to 4096 pixels, got {args.size}")
    if args.out.suffix.lower() != ".png":
        raise SinewError(f"{args.out}: expected a name ending in .png")
    files.open_file(args.file)
    scene = bpy.context.scene
    try:
        meshes = evaluate.deformed_meshes(scene, args.object)
    except SinewError as error:
        raise SinewError(f"{args.file}: {error}") from None
    evaluate.set_frame(scene, frames[0])

    left_out = []
    for obj in list(meshes):
        try:
            for method in methods:
                evaluate.use_method(obj, method)
        except SinewError as error:
            console.complain(f"{args.file}: left out: {error}")
            left_out.append(obj)
            meshes.remove(obj)
    if not meshes:
        raise SinewError(f"{args.file}: no mesh that Sinew can drive")

    shapes = {}
    for method in methods:
        for obj in meshes:
            evaluate.use_method(obj, method)
        shapes[method] = evaluate.world_points(meshes)
    triangles = evaluate.joined_triangles(meshes)
    rest_volume = _rest_volume(meshes, triangles)
    points = list(shapes.values())
    if any(shape.shape != points[0].shape for shape in points):
        raise SinewError(f"{args.file}: a modifier changes the topology from method to method")
    views = [("Whole", whole_view(np.concatenate(points)))]
    close = close_view(points)
    if close is not None:
        views.append(("Where the methods differ most", close))

    engine = args.engine
    if engine == "auto":
        engine = "workbench" if render.has_opengl() else "cycles"
    render.prepare(scene, meshes, engine, args.size)
    columns = []
    with tempfile.TemporaryDirectory() as folder:
        for method in console.progress(methods, len(methods), f"Drawing {args.file.name}"):
            for obj in meshes:
                evaluate.use_method(obj, method)
            pictures = []
            for index, (_title, view) in enumerate(views):
                pictures.append(Path(folder) / f"{method}-{index}.png")
                render.picture(scene, view, pictures[-1])
            note = f"volume {100 * volume(shapes[method], triangles) / rest_volume:.1f} % of rest"
            columns.append(Column(f"{evaluate.method_label(method)} ({method})", note, pictures))
        names = ", ".join(obj.name for obj in meshes)
        title = f"{args.file.name}: {names}, frame {frames[0]}"
        write_sheet(title, columns, [name for name, _view in views], args.out)
    console.say(str(args.out))
    return 1 if left_out else 0


def _rest_volume(meshes: list, triangles: np.ndarray) -> float:
    """The volume of the meshes with their armatures in rest position."""
    import bpy

    from ..blender import drive, evaluate

    armatures = {drive.armature_of(obj).data for obj in meshes}
    before = {armature: armature.pose_position for armature in armatures}
    for armature in armatures:
        armature.pose_position = "REST"
    bpy.context.view_layer.update()
    rest = volume(evaluate.world_points(meshes), triangles)
    for armature, position in before.items():
        armature.pose_position = position
    bpy.context.view_layer.update()
    return rest if rest != 0.0 else float("nan")
