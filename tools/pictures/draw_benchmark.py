# SPDX-License-Identifier: GPL-3.0-or-later
"""Bends every joint of free rigs under all methods, and writes docs/benchmark.md with tables and pictures.

    python tools/pictures/draw_benchmark.py [--out docs] [--only Fox]

`./dev benchmark` runs it. Rigs that are not of this repository are found in the folder SINEW_RIGS and in
"corpus" beside it; without them they are left out.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import sinew
from draw_methods import CELL, REPOSITORY, Case, view_of, write_grid
from mathutils import Matrix
from sinew_addon.attach import attach
from sinew_addon.base.steps import result_of
from sinew_addon.deform import characters
from sinew_addon.features.flex import flex
from sinew_addon.features.flex.verdict import OWN
from sinew_addon.features.measure.battery import JOINTS, SWING, TWIST, Move
from sinew_addon.features.measure.limits import LIMITS, Limit, Table
from sinew_addon.features.pages import render
from sinew_addon.io import files
from sinew_addon.prepare import leave_blender, prepare_blender
from sinew_addon.skinning.parameters import PRESETS

MEASURES = tuple(limit for limit in LIMITS.values() if limit.posed)
# Of bones that nothing is known of, Flex's own poses are too mild to tell methods apart.
FAR = tuple(Move("other", action, degrees) for action, degrees in (("swing", SWING), ("twist", TWIST)))
TABLE = Table(joints={**JOINTS, "other": FAR})
AS_IT_IS = "as it is"
Found = dict[str, dict[str, Any]]
"""What values_of() returns, by method."""
DRAWN = ("lbs", "qv", "dq", "cor", "ddm", "log", *PRESETS)


@dataclass(frozen=True)
class Rig:
    """joint, pose, width: what is in the picture, see draw_methods.Case"""

    title: str
    file: str
    licence: str
    joint: str
    pose: str
    width: float

    @property
    def name(self) -> str:
        return Path(self.file).stem

    @property
    def path(self) -> Path | None:
        rigs = [Path(folder) for folder in filter(None, [os.environ.get("SINEW_RIGS")])]
        folders = [REPOSITORY / "blend_files", *rigs, *(folder.parent / "corpus" for folder in rigs)]
        return next((folder / self.file for folder in folders if (folder / self.file).exists()), None)


CC_BY = "[CC BY 4.0](https://creativecommons.org/licenses/by/4.0/)"
OURS = "made by `blend_files/make_rigs.py`, GPL-3.0-or-later"
RIGS = (
    Rig(
        "A human",
        "human.blend",
        "MakeHuman's base mesh with the game engine rig, CC0",
        "thigh_l",
        "Squat",
        0.45,
    ),
    Rig(
        "CesiumMan",
        "CesiumMan.glb",
        f"glTF sample model of Cesium, {CC_BY} with trademark limitations; drawn in clay",
        "",
        "",
        0.45,
    ),
    Rig(
        "Fox",
        "Fox.glb",
        f"glTF sample model of PixelMannen, tomkranis and AsoboStudio, CC0 and {CC_BY}; drawn in clay",
        "",
        "",
        0.5,
    ),
    Rig(
        "RobotExpressive",
        "RobotExpressive.blend",
        "by Tomás Laulhé and Don McCurdy, CC0",
        "",
        "",
        0.5,
    ),
    Rig("An elbow", "elbow.blend", OURS, "", "", 0.5),
    Rig("A shoulder", "shoulder.blend", OURS, "", "", 1.0),
    Rig("A wrist", "wrist.blend", OURS, "", "", 0.4),
    Rig("A tentacle", "tentacle.blend", OURS, "", "", 0.3),
)


def bend(meshes: Sequence[bpy.types.Object], methods: Sequence[str], own: str | None) -> flex.Result:
    return result_of(flex.flex(meshes, methods, TABLE, dict.fromkeys(meshes, own)))


def values_of(result: flex.Result, method: str) -> dict[str, Any]:
    """The means over all joints of their worst values, by measure, and how many joints pass."""
    joints = [joint for joint in result.verdict.joints if method in joint.values]
    found: dict[str, Any] = {"joints": len(result.verdict.joints)}
    for limit in MEASURES:
        values = [
            joint.values[method][limit.name][0] for joint in joints if limit.name in joint.values[method]
        ]
        found[limit.name] = float(np.mean(values)) if values else None
    bad = 0
    for joint in result.verdict.joints:
        own, posed = joint.values.get(OWN, {}), joint.values.get(method, {})
        still = {name: each for name, each in own.items() if not LIMITS[name].posed}
        bad += any(LIMITS[name].is_beyond(value) for name, (value, _pose) in {**posed, **still}.items())
    return {**found, "passed": len(result.verdict.joints) - bad}


def measure(rig: Rig, path: Path, out: Path) -> Found:
    """Writes the picture; the values of each method by its name."""
    files.open_file(path)
    meshes, _left_out = characters.deformable_meshes(bpy.context.scene, path, ["dq"])
    methods = [method.name for method in sinew.methods()]
    result = bend(meshes, methods, "blender")
    found = {AS_IT_IS: values_of(result, OWN), **{name: values_of(result, name) for name in methods}}
    for preset in PRESETS:
        characters.use_method_on(meshes, preset)
        said = characters.sentences()[-1].partition(": ")[2]
        found[preset] = {**values_of(bend(meshes, [], None), OWN), "said": said}
    draw(rig, meshes, result, out)
    return found


def draw(rig: Rig, meshes: list[bpy.types.Object], result: flex.Result, out: Path) -> None:
    """The joint and pose of the rig, or those in which linear blending loses most volume."""
    joint, pose = rig.joint, rig.pose
    if not pose:
        losses = [
            (each.values["lbs"]["volume_loss"][0], each.name, each.values["lbs"])
            for each in result.verdict.joints
            if "volume_loss" in each.values.get("lbs", {}) and rig.joint in ("", each.name)
        ]
        _most, joint, values = max(losses, key=lambda each: each[0])
        pose = values["volume_loss"][1]
    armature = next(a for a in map(attach.armature_of, meshes) if (a.name, joint, pose) in result.poses)
    rotations = result.poses[armature.name, joint, pose]
    armature.animation_data_clear()
    pictures, shapes = [], []
    studio = render.Studio(bpy.context.scene, meshes, render.chosen_engine("auto"), 2 * CELL)
    with tempfile.TemporaryDirectory() as folder:
        for number, name in enumerate(DRAWN * 2):
            characters.use_method_on(meshes, name)
            for bone in armature.pose.bones:
                axes = np.array(bone.bone.matrix_local)[:3, :3]
                rotation = np.linalg.inv(axes) @ rotations.get(bone.name, np.eye(3)) @ axes
                bone.matrix_basis = Matrix(rotation.tolist()).to_4x4()
            bpy.context.view_layer.update()
            if number < len(DRAWN):
                # All shapes first: they are seen from one place.
                shapes.append(characters.world_points(meshes))
                continue
            bones = () if rig.width >= 1.0 else (joint,)
            pictures.append(Path(folder) / f"{number}.png")
            studio.picture(view_of(Case("", "", "", 0, bones, rig.width), meshes, shapes), pictures[-1])
        titles = [f"{joint}, {pose}: {DRAWN[0]}", *DRAWN[1:]]
        write_grid(Case("", "", "", 0), titles, pictures, out / f"benchmark-{rig.name}.webp")


def number(limit: Limit, value: float | None) -> str:
    if value is None:
        return "none"
    return f"{100.0 * value:.1f}" if limit.unit == "%" else f"{value:.2f}"


def of_all(numbers: Mapping[str, Found]) -> Found:
    """Joints of all rigs, and means of the rigs' means."""
    found: Found = {}
    for method in next(iter(numbers.values())):
        rows = [each[method] for each in numbers.values()]
        found[method] = {name: sum(row[name] for row in rows) for name in ("joints", "passed")}
        for limit in MEASURES:
            values = [row[limit.name] for row in rows if row[limit.name] is not None]
            found[method][limit.name] = float(np.mean(values))
    return found


def table_of(found: Found) -> list[str]:
    heads = [f"{limit.label.lower()}{', %' if limit.unit == '%' else ''}" for limit in MEASURES]
    lines = [f"| method | joints that pass | {' | '.join(heads)} |", f"|---|{'---:|' * (1 + len(heads))}"]
    best = {}
    for limit in MEASURES:
        values = [row[limit.name] for row in found.values() if row[limit.name] is not None]
        # A limb that grows wider than at rest is no better than one that keeps its radius.
        best[limit.name] = number(
            limit, max(min(v, 1.0) for v in values) if limit.least and values else min(values, default=None)
        )
    for name, row in found.items():
        texts = {limit.name: number(limit, row[limit.name]) for limit in MEASURES}
        cells = [f"**{text}**" if text == best[each] != "none" else text for each, text in texts.items()]
        label = name if name == AS_IT_IS else f"`{name}`"
        lines.append(f"| {label} | {row['passed']} of {row['joints']} | {' | '.join(cells)} |")
    return lines


HEAD = """# Benchmark: free rigs under all methods

This page says what each method makes of rigs that anyone may have. [Flex](flex.md) bends every joint of each
rig, by itself and as people move, and measures the surface around it. A number is the mean over the joints of
the worst value of each joint; the best of a column is bold. Bones that are no figure's swing by 60° and are
twisted by 90°, twice as far and more than Flex does otherwise. A joint passes if all its values are within
Flex's limits; a fault of bones or weights, as that of the human's fingers, fails it under every method. "As
it is" are the file's own Armature modifiers, `recommended` is what Sinew's preset chooses for the rig.

    SINEW_RIGS=rigs ./dev benchmark

computes and draws the page, and writes `build/benchmark.json` with the numbers. human.blend, CesiumMan.glb
and Fox.glb are in the folder `rigs`, RobotExpressive.blend in a folder `corpus` beside it; `blend_files/` has
the others. To measure other rigs in the same way: `sinew flex FILES --methods lbs,dq,cor --json`. The
[measures](metrics.md) are functions of numpy arrays, too.

Methods alone do not decide: volume, radius and bulge depend on them, the longest edge and crossings mostly on
weights and poses. The five methods As in Engines are left out: they are linear blending with [fewer
weights](engines.md#what-an-engine-shows), and `sdef` is `lbs` here, as none of the files is of MikuMikuDance.
"""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=REPOSITORY / "docs")
    parser.add_argument("--only", help="the rig of this name alone, without the page")
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    prepare_blender()
    page: list[str] = []
    numbers: dict[str, Found] = {}
    for rig in RIGS:
        if args.only not in (None, rig.name):
            continue
        if rig.path is None:
            print(f"left out: {rig.file} is not in SINEW_RIGS", flush=True)
            continue
        found = numbers[rig.name] = measure(rig, rig.path, args.out)
        print(f"benchmark-{rig.name}.webp", flush=True)
        said = [f"`{name}` chooses: {row['said']}" for name, row in found.items() if "said" in row]
        picture = f"![{rig.title}](benchmark-{rig.name}.webp)"
        page += [
            f"## {rig.title}",
            f"`{rig.file}`: {rig.licence}.",
            picture,
            "\n".join(table_of(found)),
            *said,
        ]
    Path("build").mkdir(exist_ok=True)
    Path("build/benchmark.json").write_text(json.dumps(numbers, indent=1), encoding="utf-8")
    if args.only is None:
        of_rigs = ["## All of them", "\n".join(table_of(of_all(numbers)))]
        text = "\n\n".join([HEAD.strip(), *of_rigs, *page]) + "\n"
        (args.out / "benchmark.md").write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    status = main()
    sys.stdout.flush()
    leave_blender(status)
