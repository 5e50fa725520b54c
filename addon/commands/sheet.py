# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew compare --out SHEET.png`: draws one picture of a frame under several methods."""

import argparse

import numpy as np

from ..core.errors import WrongUse
from ..core.frames import parse_frames
from ..core.scratch import scratch_folder
from ..core.sheet import Column, require_pillow, write_sheet
from ..core.views import close_view, most_different_vertex
from .console import Console

# Extensions of pictures; other paths are folders.
PICTURES = {".png", ".jpg", ".jpeg", ".webp", ".gif", ".svg", ".pdf"}


def run(args: argparse.Namespace, methods: list[str], console: Console) -> int:
    """Draws a column for each method, with the same camera for all, a close-up of the vertex at which the
    methods differ most, and the volume relative to the rest pose."""
    import bpy

    from ..attach import properties
    from ..deform import characters
    from ..features.pages import measure, render
    from ..io import files

    require_pillow()
    if len(args.files) != 1:
        raise WrongUse(f"{args.out}: a sheet shows one file, got {len(args.files)}; give a folder for pages")
    frames = parse_frames(args.frames or "")
    if len(frames) != 1:
        raise WrongUse(f"frame: expected one frame, got {args.frames!r}")
    (path,), (frame,) = args.files, frames
    console.note_on(path, files.open_file(path))
    scene = bpy.context.scene
    characters.set_frame(scene, frame)
    meshes, left_out = characters.deformable_meshes(scene, path, methods, args.object)
    for reason in left_out:
        console.complain(f"{path}: left out: {reason}")

    subject = measure.gather(scene, meshes)
    shapes = measure.shapes_at(subject, methods, frame)
    rest = subject.gauge.rest.volume
    volumes = {method: subject.gauge.measure(points).shape.volume for method, points in shapes.items()}
    views = [("Whole", characters.whole_views(meshes, methods, [frame])[0])]
    vertex = most_different_vertex(list(shapes.values()))
    if vertex is not None:
        positions = np.stack([points[vertex] for points in shapes.values()])
        character = subject.character_of(vertex, shapes[methods[0]])
        views.append(("Where the methods differ most", close_view(character, positions)))

    studio = render.Studio(scene, meshes, render.chosen_engine(args.engine), args.size or 640)
    columns = []
    with scratch_folder() as folder:
        for method in console.progress(methods, len(methods), f"Drawing {path.name}"):
            characters.use_method_on(meshes, method)
            pictures = []
            for index, (_title, view) in enumerate(views):
                pictures.append(folder / f"{method}-{index}.png")
                studio.picture(view, pictures[-1])
            note = f"volume {100 * volumes[method] / rest:.1f} % of rest" if rest else "no volume"
            columns.append(Column(f"{properties.method_label(method)} ({method})", note, pictures))
        names = ", ".join(obj.name for obj in meshes)
        title = f"{path.name}: {names}, frame {frame}"
        write_sheet(title, columns, [name for name, _view in views], args.out)
    console.say(str(args.out))
    return 1 if left_out else 0
