# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws every method and stage on bent and twisted limbs, and writes docs/pictures.md with their numbers.

    python tools/pictures/draw_methods.py [--out docs] [--only wrist]

`./dev pictures` runs it. human.blend is found in the folder SINEW_RIGS; without it its pictures are left out.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import bpy
import numpy as np
import sinew
import sinew_addon
from PIL import Image, ImageDraw, ImageFont
from sinew_addon.attach import attach, properties
from sinew_addon.deform import characters
from sinew_addon.features.measure import subjects
from sinew_addon.features.measure.metrics import Measured
from sinew_addon.features.pages import render
from sinew_addon.features.pages.views import View, close_view, seen_extent, whole_view
from sinew_addon.io import files

REPOSITORY = Path(__file__).resolve().parents[2]
sys.path.append(str(REPOSITORY / "tests" / "support"))
import tube as tubes  # noqa: E402 - it is found there

CELL = 240
TITLE = 30
BACKGROUND, TEXT, FAINT = (38, 40, 44), (232, 232, 232), (160, 164, 170)
GROUP = "half of it"
# Where nothing hides them.
ELBOW, FACE = (-1.0, -0.6, 0.2), (0.7, -1.0, -0.1)


@dataclass(frozen=True)
class Variant:
    """A method, with stages by their parameters."""

    method: str
    stages: tuple[tuple[str, tuple[tuple[str, object], ...]], ...] = ()

    @property
    def title(self) -> str:
        labels = {stage.name: stage.label for stage in sinew.stages()}
        names = [labels[name] for name, _values in self.stages]
        return " + ".join([f"{self.method}", *names])


def variants() -> list[Variant]:
    """All methods that do anything with these files, then stages behind some of them."""
    # Files made by MMD alone have what `sdef` reads; elsewhere it is `lbs`.
    methods = [Variant(m.name) for m in sinew.methods() if m.group != "For MMD"]
    limit = ("bulge_limit", (("enabled", True),))
    mush = ("delta_mush", (("iterations", 20), ("enabled", True)))
    mix = ("mix", (("group", GROUP), ("method", "dq")))
    return [
        *methods,
        Variant("lbs", (mix,)),
        Variant("dq", (limit,)),
        Variant("cor", (limit,)),
        Variant("lbs", (mush,)),
        Variant("cor", (mush,)),
        Variant("cor", (limit, mush)),
    ]


@dataclass(frozen=True)
class Case:
    """bones      whose heads are in the picture; none: all of it is
    width      of what is seen around them, as a part of the mesh's diagonal
    direction  towards the camera; none: the one in which least is in front
    """

    name: str
    title: str
    file: str
    frame: int
    bones: tuple[str, ...] = ()
    width: float = 0.2
    direction: tuple[float, ...] = ()


CASES = (
    Case("wrist", "A wrist, twisted by half a turn", "wrist.blend", 24),
    Case("elbow", "An elbow, bent by 150°", "elbow.blend", 24),
    Case("shoulder", "A shoulder, the arm raised and turned", "shoulder.blend", 24),
    Case("human-16", "A character, frame 16", "human.blend", 16),
    Case("human-16-wrist", "Its right wrist, twisted by 170°", "human.blend", 16, ("hand_r",), 0.13),
    Case(
        "human-16-elbow",
        "Its left elbow, bent by 130 degrees",
        "human.blend",
        16,
        ("lowerarm_l",),
        0.2,
        ELBOW,
    ),
    Case("human-32", "The character, frame 32", "human.blend", 32),
    Case("human-32-shoulder", "Its left shoulder, raised", "human.blend", 32, ("upperarm_l",), 0.25),
    Case("human-32-hip", "Its right hip, bent by 95°", "human.blend", 32, ("thigh_r",), 0.3),
    Case(
        "human-32-face",
        "Face and neck, the head turned by 70 degrees",
        "human.blend",
        32,
        ("head",),
        0.2,
        FACE,
    ),
)


def path_of(name: str) -> Path | None:
    folders = [REPOSITORY / "blend_files", *map(Path, filter(None, [os.environ.get("SINEW_RIGS")]))]
    return next((folder / name for folder in folders if (folder / name).exists()), None)


def choose(meshes: Sequence[bpy.types.Object], variant: Variant) -> None:
    characters.use_method_on(meshes, variant.method)
    for obj in meshes:
        settings = properties.of(obj)
        settings.mix.method = properties.OFF
        settings.bulge_limit.enabled = settings.delta_mush.enabled = False
        for name, values in variant.stages:
            for parameter, value in values:
                setattr(getattr(settings, name), parameter, value)


def view_of(case: Case, meshes: Sequence[bpy.types.Object], points: Sequence[np.ndarray]) -> View:
    """points  the shapes of all variants"""
    if not case.bones:
        return whole_view([seen_extent(each) for each in points])
    rig = attach.armature_of(meshes[0])
    heads = np.array([(rig.matrix_world @ rig.pose.bones[name].head)[:] for name in case.bones])
    view = close_view(points[0], heads)
    width = case.width * float(np.linalg.norm(np.ptp(points[0], axis=0)))
    view = replace(view, width=width, height=width)
    if not case.direction:
        return view
    return replace(view, direction=np.array(case.direction) / np.linalg.norm(case.direction))


def draw(case: Case, path: Path, out: Path) -> dict[str, Measured]:
    """Writes the picture; the measures of each variant by its title, distances to the Armature modifier."""
    files.open_file(path)
    scene = bpy.context.scene
    characters.set_frame(scene, case.frame)
    meshes, _left_out = characters.deformable_meshes(scene, path, ["dq"])
    for obj in meshes:
        obj.vertex_groups.new(name=GROUP).add(range(len(obj.data.vertices)), 0.5, "REPLACE")
    subject = subjects.gather(scene, meshes)
    chosen = variants()
    shapes, found = [], {}
    for variant in chosen:
        choose(meshes, variant)
        points = subjects.shapes_at(subject, [variant.method], case.frame)[variant.method]
        found[variant.title] = subject.gauge.measure(points, points)
        shapes.append(points)
    view = view_of(case, meshes, shapes)
    studio = render.Studio(scene, meshes, render.chosen_engine("auto"), 2 * CELL)
    with tempfile.TemporaryDirectory() as folder:
        pictures = []
        for number, variant in enumerate(chosen):
            choose(meshes, variant)
            characters.set_frame(scene, case.frame)
            pictures.append(Path(folder) / f"{number}.png")
            studio.picture(view, pictures[-1])
        write_grid(case, [variant.title for variant in chosen], pictures, out / f"pictures-{case.name}.webp")
    return found


def write_grid(case: Case, titles: Sequence[str], pictures: Sequence[Path], path: Path) -> None:
    """Methods in the rows above, stages in those below."""
    small = ImageFont.load_default(size=14)
    images = []
    for picture in pictures:
        with Image.open(picture) as opened:
            image = opened.convert("RGBA")
        image.thumbnail((CELL, CELL))
        images.append(image)
    columns = 7
    height = max(image.height for image in images) + TITLE
    rows = -(-len(images) // columns)
    sheet = Image.new("RGB", (columns * CELL, rows * height + 4), BACKGROUND)
    draw_on = ImageDraw.Draw(sheet)
    for number, (title, image) in enumerate(zip(titles, images, strict=True)):
        x, y = CELL * (number % columns), height * (number // columns)
        draw_on.text((x + 6, y + 8), title, font=small, fill=TEXT)
        sheet.paste(image, (x + (CELL - image.width) // 2, y + TITLE), image)
    sheet.save(path, quality=82, method=6)


def table_of(found: dict[str, Measured]) -> list[str]:
    lines = [
        "| | volume | longest edge | bulge | flipped faces |",
        "|---|---:|---:|---:|---:|",
    ]
    for title, measured in found.items():
        own = measured.summary()
        lines.append(
            f"| {title} | {100 * (1 + own.volume_change):.1f} % | {1 + own.stretch_max:.2f} | "
            f"{own.bulge_max:.3f} | {own.flipped_faces} |"
        )
    return lines


def tube_numbers(variant: Variant, tube: tubes.Tube) -> tuple[float, ...]:
    """As tube.numbers()."""
    around = tube.quads
    edges = np.unique(
        np.sort(np.concatenate([around[:, [k, (k + 1) % 4]] for k in range(4)]), axis=1), axis=0
    )
    offsets = np.arange(0, 4 * len(around) + 1, 4)
    mush = sinew.DeltaMush(tube.mesh[0], offsets, around.ravel(), edges, iterations=20)
    ends = np.float32([[0, 0, 0], [0, 0, 2]]), np.float32([[0, 0, 2], [0, 0, 4]])
    limit = sinew.BulgeLimit(sinew.Binding(*tube.mesh), *ends)
    names = [name for name, _values in variant.stages]

    def deformed(axis: Sequence[float], degrees: float) -> tuple[np.ndarray, np.ndarray]:
        points, bones = tube.deformed(variant.method, axis, degrees)
        points = points.astype(np.float32)
        if "mix" in names:
            points = ((points + tube.deformed("dq", axis, degrees)[0]) / 2).astype(np.float32)
        if "bulge_limit" in names:
            points = limit.apply(points, bones)
        if "delta_mush" in names:
            points = mush.apply(points)
        return points.astype(np.float64), bones

    return tubes.numbers(tube, deformed)


def tube_table() -> list[str]:
    lines = [
        "| | volume, bent by 90° | bulge, 90° | bulge, 130° | longest edge, 90° | volume, twisted by 170° | "
        "least radius, 170° |",
        "|---|---:|---:|---:|---:|---:|---:|",
    ]
    tube = tubes.Tube()
    for variant in variants():
        known = tubes.TABLE.get(variant.method) if not variant.stages else None
        numbers = tube_numbers(variant, tube)
        cells = [
            f"{number:.3f}" + (f" ({known[place]:g})" if known else "")
            for place, number in enumerate(numbers)
        ]
        lines.append(f"| {variant.title} | {' | '.join(cells)} |")
    return lines


HEAD = """# Methods and stages in pictures

These pictures show the methods on ten limbs, then stages after some of the methods; [methods.md](methods.md)
says what to see in them. `./dev pictures` draws them. The mix is half `lbs`, half `dq`. Limit Bulge and Delta
Mush have their default settings, except for 20 iterations. `sdef` is left out: without the marks of MMD's
models, which none of these files has, it equals `lbs`. The character is MakeHuman's base mesh with its game
engine rig, CC0.

Volume is relative to the rest pose, the longest edge to its length at rest. The bulge is how much farther a
vertex is from its bones than at rest, in units of the file ([metrics.md](metrics.md)).

## A tube

The tube has length 4, radius 0.5, 81 rings of 32 vertices, two bones, and weights that change over 1 unit.
Bulge and radius are relative to the radius at rest; the radius of `ddm` is 0.26. Numbers in brackets were
computed separately from the library.

"""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=REPOSITORY / "docs")
    parser.add_argument("--only", help="the case of this name alone, without the page")
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    sinew_addon.register()
    page = [HEAD + "\n".join(tube_table())]
    tables: dict[tuple[str, int], list[str]] = {}
    for case in CASES:
        path = path_of(case.file)
        if path is None:
            print(f"left out: {case.name}: {case.file} is not in SINEW_RIGS")
            continue
        if args.only in (None, case.name):
            found = draw(case, path, args.out)
            print(f"pictures-{case.name}.webp", flush=True)
            page.append(f"## {case.title}\n\n![{case.title}](pictures-{case.name}.webp)")
            if (case.file, case.frame) not in tables:
                tables[case.file, case.frame] = table_of(found)
                page.append("\n".join(tables[case.file, case.frame]))
    if args.only is None:
        (args.out / "pictures.md").write_text("\n\n".join(page) + "\n", encoding="utf-8")
    sinew_addon.unregister()
    return 0


if __name__ == "__main__":
    status = main()
    sys.stdout.flush()
    os._exit(status)
