# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures frames in Blender with the Armature modifier and with Sinew, on the same scene in the same run.

One process and one file, in which Sinew is switched off and on alternately for a few frames each, since two
processes differ by some percent even without Sinew. A frame is Scene.frame_set() and then reading the
evaluated mesh, which has Sinew's points. For a drawn frame the normals of all corners are read, too, which
Blender computes if nobody provides them.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path

import bpy
import common
import numpy as np
import sinew

FRAMES = 60
# The number of frames in a row, as in playback, before Sinew is switched; and the number of frames before
# these that are not timed, for binding and caches.
RUN, BEFORE = 24, 4


@dataclass(frozen=True)
class Case:
    """rig: a file in SINEW_RIGS instead of a tube; normals: read as well; subdivision: levels of a
    modifier after it; shading: of a tube, one of SHADINGS."""

    vertices: int = 1080
    method: str = "dq"
    characters: int = 1
    bones: int = 100
    influences: int = 4
    normals: bool = False
    subdivision: int = 0
    rig: str = ""
    shading: str = "smooth"

    @property
    def name(self) -> str:
        many = f"{self.characters} x " if self.characters > 1 else ""
        what = self.rig or f"{many}{self.vertices:,} vertices"
        shading = f", {self.shading}" if self.shading != "smooth" else ""
        normals = ", drawn" if self.normals else ""
        return what + (f", subdivision {self.subdivision}" if self.subdivision else "") + shading + normals


SHADINGS = ("smooth", "sharp", "custom", "flat")
# Who computes the normals, as in the panel.
CHOICES = ("BY_SINEW", "SKINNED", "LEAVE")


def cases(million: bool) -> list[Case]:
    scenes = [Case(size) for size in (1_080, 5_000, 13_380, 100_000)]
    scenes += [Case(1_000_000)] if million else []
    scenes += [Case(characters=count, bones=50) for count in (10, 50)]
    folder = os.environ.get("SINEW_RIGS")
    for name in ("human.blend", "CesiumMan.glb", "Fox.glb") if folder else ():
        if (Path(folder) / name).exists():
            scenes.append(Case(rig=name))
    found = [replace(scene, normals=normals) for scene in scenes for normals in (False, True)]
    found += [Case(100_000, normals=True, shading=shading) for shading in SHADINGS[1:]]
    found.append(Case(13_380, subdivision=1))
    return [replace(case, method=method) for case in found for method in ("dq", "lbs")]


def make_tube(case: Case, index: int) -> bpy.types.Object:
    """A tube along Y with one unit for each bone, and keys on each bone that bend and twist it."""
    collection = bpy.context.scene.collection.objects
    armature = bpy.data.objects.new(f"Rig {index}", bpy.data.armatures.new(f"Rig {index}"))
    collection.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    parent = None
    for bone_index in range(case.bones):
        bone = armature.data.edit_bones.new(f"bone.{bone_index}")
        bone.head, bone.tail = (0, bone_index, 0), (0, bone_index + 1, 0)
        bone.parent, bone.use_connect = parent, parent is not None
        parent = bone
    bpy.ops.object.mode_set(mode="OBJECT")

    sides = max(4, round((case.vertices / 4) ** 0.5))
    rings = max(2, case.vertices // sides)
    ring, side = np.divmod(np.arange(rings * sides), sides)
    along = ring / (rings - 1) * case.bones
    angle = side / sides * 2 * np.pi
    mesh = bpy.data.meshes.new(f"Tube {index}")
    mesh.vertices.add(len(along))
    mesh.vertices.foreach_set("co", np.stack([np.cos(angle), along, np.sin(angle)], axis=1).ravel())
    here = (np.arange(rings - 1)[:, None] * sides + np.arange(sides)).ravel()
    beside = (np.arange(rings - 1)[:, None] * sides + (np.arange(sides) + 1) % sides).ravel()
    corners = np.stack([here, beside, beside + sides, here + sides], axis=1)
    mesh.loops.add(corners.size)
    mesh.loops.foreach_set("vertex_index", corners.ravel())
    mesh.polygons.add(len(corners))
    mesh.polygons.foreach_set("loop_start", np.arange(0, corners.size, 4))
    mesh.update(calc_edges=True)
    mesh.polygons.foreach_set("use_smooth", np.ones(len(corners), dtype=bool))
    shade(mesh, case.shading)
    obj = bpy.data.objects.new(f"Tube {index}", mesh)
    collection.link(obj)

    first = np.clip(np.floor(along) - (case.influences - 1) // 2, 0, case.bones - case.influences).astype(int)
    groups = [obj.vertex_groups.new(name=f"bone.{bone}") for bone in range(case.bones)]
    for k in range(case.influences):
        weights = np.exp(-((first + k + 0.5 - along) ** 2)) + 0.02
        for ring_start in range(0, len(along), sides):
            group = groups[first[ring_start] + k]
            group.add(list(range(ring_start, ring_start + sides)), float(weights[ring_start]), "REPLACE")
    for bone in armature.pose.bones:
        bone.rotation_mode = "QUATERNION"
        bone.keyframe_insert("rotation_quaternion", frame=1)
        bone.rotation_quaternion = (1.0, 0.02, 0.05, 0.01)
        bone.keyframe_insert("rotation_quaternion", frame=FRAMES)
    obj.modifiers.new("Armature", "ARMATURE").object = armature
    if case.subdivision:
        obj.modifiers.new("Subdivision", "SUBSURF").levels = case.subdivision
    return obj


def shade(mesh: bpy.types.Mesh, shading: str) -> None:
    """Makes every fiftieth edge sharp, adds custom normals of corners, as imported characters have, or
    makes all flat."""
    rng = np.random.default_rng(1)
    if shading == "flat":
        mesh.shade_flat()
    elif shading == "sharp":
        mesh.edges.foreach_set("use_edge_sharp", rng.random(len(mesh.edges)) < 0.02)
    elif shading == "custom":
        normals = np.empty((len(mesh.loops), 3), dtype=np.float32)
        mesh.corner_normals.foreach_get("vector", normals.ravel())
        normals += rng.normal(0.0, 0.1, normals.shape)
        mesh.normals_split_custom_set((normals / np.linalg.norm(normals, axis=1, keepdims=True)).tolist())
    mesh.update()


def open_rig(path: Path) -> list[bpy.types.Object]:
    """The meshes of a rig that its armature deforms. Every bone is keyed, so that each frame moves all
    bones."""
    if path.suffix == ".blend":
        bpy.ops.wm.open_mainfile(filepath=str(path))
    else:
        bpy.ops.import_scene.gltf(filepath=str(path))
    meshes, armatures = [], set()
    for obj in bpy.context.view_layer.objects:
        modifiers = [m for m in obj.modifiers if m.type == "ARMATURE" and m.object is not None]
        if obj.type == "MESH" and modifiers:
            meshes.append(obj)
            armatures.add(modifiers[0].object)
    for armature in armatures:
        armature.animation_data_clear()
        for bone in armature.pose.bones:
            bone.rotation_mode = "QUATERNION"
            bone.keyframe_insert("rotation_quaternion", frame=1)
            bone.rotation_quaternion = (1.0, 0.1, 0.15, 0.05)
            bone.keyframe_insert("rotation_quaternion", frame=FRAMES)
    return meshes


class Scene:
    """The open file of a case, with Sinew on its meshes."""

    def __init__(self, case: Case, leave_small: bool) -> None:
        self.case = case
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        if case.rig:
            self.meshes = open_rig(Path(os.environ["SINEW_RIGS"]) / case.rig)
        else:
            self.meshes = [make_tube(case, index) for index in range(case.characters)]
        for obj in self.meshes:
            for modifier in obj.modifiers:
                if modifier.type == "ARMATURE":
                    modifier.use_deform_preserve_volume = case.method == "dq"
        self.normals = [np.empty(3 * len(obj.data.loops), dtype=np.float32) for obj in self.meshes]
        bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, FRAMES
        bpy.context.scene.frame_set(1)
        for obj in self.meshes:
            with bpy.context.temp_override(active_object=obj, object=obj, selected_objects=[obj]):
                bpy.ops.sinew.add()
            obj.sinew.method = case.method
            obj.sinew.leave_small = leave_small

    def switch(self, on: bool) -> None:
        for obj in self.meshes:
            obj.sinew.enabled = on

    def frame(self, number: int) -> None:
        bpy.context.scene.frame_set(number)
        depsgraph = bpy.context.evaluated_depsgraph_get()
        for obj, normals in zip(self.meshes, self.normals, strict=True):
            mesh = obj.evaluated_get(depsgraph).data
            if self.case.normals:
                mesh.corner_normals.foreach_get("vector", normals)
            else:
                mesh.vertices[0].co.length  # noqa: B018

    def points(self, number: int) -> np.ndarray:
        """The points of the first mesh, float32 [n, 3], on which both must agree."""
        self.frame(number)
        mesh = self.meshes[0].evaluated_get(bpy.context.evaluated_depsgraph_get()).data
        points = np.empty((len(mesh.vertices), 3), dtype=np.float32)
        mesh.vertices.foreach_get("co", points.ravel())
        return points

    def run(self, numbers: list[int]) -> list[float]:
        times = []
        for number in numbers:
            start = time.perf_counter()
            self.frame(number)
            times.append(time.perf_counter() - start)
        return times

    def handler(self) -> dict:
        """Seconds in Sinew's handler per object, at frames that change it and at frames that do not."""
        moving = self._handler_times([1 + number * 7 % FRAMES for number in range(30)])
        staying = self._handler_times([FRAMES // 2] * 31)[1:]
        return {"moving": common.spread(moving), "staying": common.spread(staying)}

    def _handler_times(self, numbers: list[int]) -> list[float]:
        """Measured by two functions, one before Sinew's handler and one after it."""
        functions = bpy.app.handlers.frame_change_post
        times: list[float] = []

        def before(*_arguments) -> None:
            times.append(-time.perf_counter())

        def behind(*_arguments) -> None:
            times[-1] += time.perf_counter()

        functions.insert(0, before)
        functions.append(behind)
        self.run(numbers)
        functions.remove(before)
        functions.remove(behind)
        return [seconds / len(self.meshes) for seconds in times]


def alternate(scene: Scene, choices: dict[str, Callable[[], None]], seconds: float) -> dict[str, dict]:
    """Spreads of seconds of a frame by name, alternating between the functions that set the scene up."""
    times: dict[str, list[float]] = {name: [] for name in choices}
    number, end = 1, time.perf_counter() + seconds * len(choices)
    while time.perf_counter() < end or any(len(of) < 2 * RUN for of in times.values()):
        numbers = [1 + (number + 7 * i) % FRAMES for i in range(RUN)]
        number += 7 * RUN
        for name, choose in choices.items():
            choose()
            scene.run(numbers[:BEFORE])
            times[name] += scene.run(numbers)
    return {name: common.spread(of) for name, of in times.items()}


def measure(case: Case, seconds: float, leave_small: bool) -> dict:
    scene = Scene(case, leave_small)
    choices = {who: partial(scene.switch, on=who == "sinew") for who in ("modifier", "sinew")}
    points = {}
    for who, choose in choices.items():
        choose()
        points[who] = scene.points(FRAMES // 2)
    spreads = alternate(scene, choices, seconds)
    size = float(np.ptp(points["modifier"], axis=0).max())
    away = float(abs(points["modifier"] - points["sinew"]).max()) / size
    vertices = sum(len(obj.data.vertices) for obj in scene.meshes)
    return asdict(case) | {"vertices": vertices} | spreads | {"away": away, "handler": scene.handler()}


def looks(scene: Scene) -> dict[str, Callable[[], None]]:
    """Functions that set the scene up, by name: the Armature modifier with Preserve Volume and with
    Corrective Smooth after it, every method, and stages after dq."""
    smooths = [obj.modifiers.new("Smooth", "CORRECTIVE_SMOOTH") for obj in scene.meshes]

    def look(method: str | None, stage: str = "") -> Callable[[], None]:
        def choose() -> None:
            for obj, smooth in zip(scene.meshes, smooths, strict=True):
                wanted = method is None and stage == "smooth"
                if smooth.show_viewport != wanted:
                    smooth.show_viewport = wanted
                obj.sinew.enabled = method is not None
                obj.sinew.twist_spread.enabled = stage == "twist_spread"
                obj.sinew.bulge_limit.enabled = stage == "bulge_limit"
                obj.sinew.delta_mush.enabled = stage == "delta_mush"
                obj.sinew.mix.method = "lbs" if stage == "mix" else "OFF"
                obj.sinew.mix.group = obj.vertex_groups[0].name
                if method is not None:
                    obj.sinew.method = method

        return choose

    return {
        "modifier": look(None),
        "modifier, Corrective Smooth": look(None, "smooth"),
        **{method.name: look(method.name) for method in sinew.methods()},
        **{f"dq, {stage.name}": look("dq", stage.name) for stage in sinew.stages()},
    }


def measure_normals(case: Case, seconds: float) -> dict:
    """A drawn frame by the modifier and with each choice of normals."""
    scene = Scene(case, leave_small=False)

    def by(choice: str) -> None:
        scene.switch(on=True)
        for obj in scene.meshes:
            obj.sinew.normals = choice

    choices = {choice: partial(by, choice) for choice in CHOICES}
    return alternate(scene, {"modifier": partial(scene.switch, on=False), **choices}, seconds)


def measure_floor(case: Case, seconds: float) -> dict:
    """A frame by the modifier, by Sinew, and by Sinew without its arithmetic: it writes its first points and
    normals again and again, and all else is done."""
    # In a whole Blender the extension has another name: see window.py.
    from sinew_addon.deform import bound
    from sinew_addon.skinning.skin_stack import SkinStack

    scene = Scene(case, leave_small=False)
    deform, write_normals = SkinStack.deform, bound.Bound.write_normals
    points, normals = {}, {}

    def write_again(stack: SkinStack, rest_points, frames, out, values) -> bool:
        if stack not in points:
            deform(stack, rest_points, frames, out, values)
            points[stack] = out.copy()
        out[:] = points[stack]
        return True

    def write_normals_again(own: bound.Bound, shape, rest_points, given, out) -> None:
        if id(own) not in normals:
            write_normals(own, shape, rest_points, given, out)
            normals[id(own)] = out.copy()
        out[:] = normals[id(own)]

    def by(on: bool, computes: bool) -> None:
        scene.switch(on)
        points.clear()
        normals.clear()
        SkinStack.deform = deform if computes else write_again
        bound.Bound.write_normals = write_normals if computes else write_normals_again

    choices = {"modifier": partial(by, False, True), "sinew": partial(by, True, True)}
    try:
        return alternate(scene, {**choices, "floor": partial(by, True, False)}, seconds)
    finally:
        by(on=True, computes=True)


def measure_methods(case: Case, seconds: float) -> dict:
    """A frame by each of looks()."""
    scene = Scene(case, leave_small=False)
    return alternate(scene, looks(scene), seconds)


@contextmanager
def quiet_blender() -> Iterator[Callable[[str], None]]:
    """A context in which Blender's own output is discarded; gives a function that prints."""
    sys.stdout.flush()
    with os.fdopen(os.dup(1), "w") as stdout, open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), 1)
        try:
            yield lambda text: print(text, file=stdout, flush=True)
        finally:
            os.dup2(stdout.fileno(), 1)


def line(name: str, result: dict) -> str:
    modifier, sinew = result["modifier"]["median"], result["sinew"]["median"]
    text = f"{name:38}{result['method']:4}{modifier * 1e3:9.2f}{sinew * 1e3:9.2f}{modifier / sinew:8.2f} x"
    moving, staying = (result["handler"][when]["median"] for when in ("moving", "staying"))
    return text + f"{moving * 1e6:10.0f}{staying * 1e6:10.1f}{result['away']:10.0e}"


def say_cases(arguments: argparse.Namespace, say: Callable[[str], None]) -> dict[str, dict]:
    results = {}
    for case in cases(arguments.million):
        name = f"{case.name} {case.method}"
        if arguments.k in name:
            seconds = 1.0 if arguments.quick else 2.0
            results[name] = measure(case, seconds, not arguments.all_by_sinew)
            say(line(case.name, results[name]))
    return results


def say_choices(arguments: argparse.Namespace, say: Callable[[str], None]) -> dict[str, dict]:
    results = {}
    for size in (13_380, 100_000):
        for shading in SHADINGS:
            case = Case(size, normals=True, shading=shading)
            name = f"{case.name} choices"
            if arguments.k in name:
                results[name] = measure_normals(case, 1.0 if arguments.quick else 2.0)
                times = (
                    f"{who.lower():>12}{of['median'] * 1e3:7.2f}{of['least'] * 1e3:7.2f}"
                    for who, of in results[name].items()
                )
                say(f"{case.name:34}{''.join(times)}")
    return results


def say_floor(arguments: argparse.Namespace, say: Callable[[str], None]) -> dict[str, dict]:
    drawn = [case for case in cases(arguments.million) if case.method == "dq" and case.normals]
    chosen = {name: case for case in drawn if arguments.k in (name := f"{case.name} floor")}
    if chosen:
        say("\nThe modifier's frame over Sinew's, and over Sinew's without its arithmetic: medians, minima")
    results = {}
    for name, case in chosen.items():
        found = results[name] = measure_floor(case, 1.0 if arguments.quick else 2.0)
        ratios = (
            f"{found['modifier'][kind] / found[who][kind]:8.2f}"
            for who in ("sinew", "floor")
            for kind in ("median", "least")
        )
        say(f"{case.name:38}{''.join(ratios)}")
    return results


def say_methods(arguments: argparse.Namespace, say: Callable[[str], None]) -> dict[str, dict]:
    case = next((c for c in cases(arguments.million) if c.rig == "human.blend"), Case(13_380))
    name = f"{case.name} methods"
    if arguments.k not in name:
        return {}
    say(f"\nAll methods and stages in turns, {case.name}: milliseconds, medians and minima, and")
    say("the medians over that of dq")
    found = measure_methods(case, 2.0 if arguments.quick else 4.0)
    for look, spread in found.items():
        kinds = ("median", "least")
        own = "".join(f"{spread[kind] * 1e3:9.2f}" for kind in kinds)
        ratios = "".join(f"{spread[kind] / found['dq'][kind]:8.2f}" for kind in kinds)
        say(f"{look:30}{own}{ratios}")
    return {name: found}


def main() -> None:
    parser = common.options(__doc__, "frames", "two seconds a case, not four")
    parser.add_argument("--million", action="store_true", help="a million vertices, too")
    parser.add_argument(
        "--all-by-sinew",
        action="store_true",
        help="small meshes too, which use their Armature modifiers otherwise",
    )
    parser.add_argument("-k", default="", help="only cases whose line has this in it")
    arguments = parser.parse_args()
    versions = {"bpy": common.version_of("bpy"), "sinew": common.version_of("sinew-skinning")}
    facts = common.begin("frames in Blender", **versions)
    print("Milliseconds from Scene.frame_set() to the evaluated mesh, medians; microseconds of Sinew's")
    print("handler for each object after the evaluation, where it moves and where it stays; how far the")
    print("points are from the modifier's, as a part of the mesh's size.\n")
    print(f"{'':42}{'modifier':>9}{'sinew':>9}{'':10}{'moving':>10}{'staying':>10}{'away':>10}")
    results: dict[str, dict] = {}
    with quiet_blender() as say:
        for part in (say_cases, say_choices, say_floor, say_methods):
            results |= part(arguments, say)
    common.write(arguments.name, machine=facts, seconds=results)


if __name__ == "__main__":
    with common.registered():
        main()
