# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures playback and live posing in Blender's window, with the Armature modifier and with Sinew.

Both alternate in one file:

    blender --factory-startup --python bench/window.py -- --zip dist/sinew-VERSION.zip [--file RIG]

Blender itself plays and draws as fast as it can; each round switches Sinew on and off and measures

play  frames per second of Blender's own playback
step  milliseconds of one change of frame without drawing
draw  milliseconds of drawing the window when nothing changed
pose  milliseconds from rotating a bone until the 3D view that shows it is drawn
late  how many of these drawings did not show it yet
paint  milliseconds of one step of a brush stroke in weight paint, evaluated and not drawn
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
import traceback
from collections.abc import Iterator
from pathlib import Path

import addon_utils
import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
import common
import frames

CANDIDATES = {"modifier": False, "sinew": True}


def in_view3d(**more):
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    region = next(region for region in area.regions if region.type == "WINDOW")
    return bpy.context.temp_override(window=window, area=area, region=region, **more)


def shown_point(obj: bpy.types.Object, vertex: int) -> np.ndarray:
    mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    return np.array(mesh.vertices[vertex].co)


def farthest_vertex(obj: bpy.types.Object) -> int:
    """A vertex that moves when a bone in the middle rotates: the one farthest from the object's origin."""
    points = np.empty((len(obj.data.vertices), 3), dtype=np.float32)
    obj.data.vertices.foreach_get("co", points.ravel())
    return int((points**2).sum(axis=1).argmax())


class Bench:
    def __init__(self, arguments: argparse.Namespace) -> None:
        self.arguments = arguments
        self.found = {who: {} for who in CANDIDATES}
        self.late = dict.fromkeys(CANDIDATES, 0)
        addon_utils.enable("bl_pkg")
        bpy.ops.extensions.package_install_files(
            filepath=str(arguments.zip), repo="user_default", enable_on_install=True
        )
        self.case = frames.Case(arguments.vertices, arguments.method, arguments.characters)
        if arguments.file is not None:
            self.meshes = frames.open_rig(arguments.file)
        else:
            for obj in list(bpy.data.objects):
                bpy.data.objects.remove(obj)
            self.meshes = [frames.make_tube(self.case, i) for i in range(arguments.characters)]
        modifiers = [m for obj in self.meshes for m in obj.modifiers if m.type == "ARMATURE"]
        for modifier in modifiers:
            modifier.use_deform_preserve_volume = arguments.method == "dq"
        self.armature = modifiers[0].object
        scene = bpy.context.scene
        scene.frame_start, scene.frame_end = 1, frames.FRAMES
        # As fast as possible, without skipping frames.
        scene.sync_mode, scene.render.fps = "NONE", 1000
        for obj in self.meshes:
            with in_view3d(active_object=obj, object=obj, selected_objects=[obj]):
                bpy.ops.sinew.add()
            obj.sinew.method = arguments.method
        with in_view3d():
            space = bpy.context.space_data
            # Software rendering is slow: draw no more than shows the mesh.
            space.overlay.show_overlays, space.shading.light = False, "FLAT"
            bpy.ops.view3d.view_all()

    def add(self, who: str, what: str, value: float) -> None:
        self.found[who].setdefault(what, []).append(value)

    def steps(self) -> Iterator[float]:
        """Yields how many seconds to wait while Blender works."""
        yield 1.0
        for _round in range(self.arguments.turns):
            for who, on in CANDIDATES.items():
                for obj in self.meshes:
                    obj.sinew.enabled = on
                yield 0.5
                yield from self.play(who)
                self.redraw(who, "step", "ANIM_STEP", 30)
                self.redraw(who, "draw", "DRAW_WIN_SWAP", 10)
                yield 0.1
                yield from self.pose(who)
                yield from self.paint(who)

    def play(self, who: str) -> Iterator[float]:
        times: list[float] = []

        def count(*_arguments) -> None:
            times.append(time.perf_counter())

        with in_view3d():
            bpy.ops.screen.animation_play()
        yield 0.3
        bpy.app.handlers.frame_change_post.append(count)
        yield 3.0
        bpy.app.handlers.frame_change_post.remove(count)
        with in_view3d():
            bpy.ops.screen.animation_cancel(restore_frame=False)
        if len(times) < 2:
            raise RuntimeError("playback shows less than a frame a second: use a smaller window")
        self.add(who, "play", (len(times) - 1) / (times[-1] - times[0]))
        yield 0.1

    def redraw(self, who: str, what: str, kind: str, iterations: int) -> None:
        with in_view3d():
            bpy.ops.wm.redraw_timer(type=kind, iterations=2)
            start = time.perf_counter()
            bpy.ops.wm.redraw_timer(type=kind, iterations=iterations)
        self.add(who, what, 1e3 * (time.perf_counter() - start) / iterations)

    def pose(self, who: str) -> Iterator[float]:
        obj, vertex = self.meshes[0], farthest_vertex(self.meshes[0])
        bones = self.armature.pose.bones
        bone = bones[len(bones) // 2] if self.arguments.file is None else bones[0]
        drawn: list[tuple[float, np.ndarray]] = []

        def note() -> None:
            drawn.append((time.perf_counter(), shown_point(obj, vertex)))

        handle = bpy.types.SpaceView3D.draw_handler_add(note, (), "WINDOW", "POST_PIXEL")
        original = bone.rotation_quaternion.copy()
        for number in range(10):
            before = shown_point(obj, vertex)
            drawn.clear()
            start = time.perf_counter()
            bone.rotation_quaternion = (1.0, 0.02 * (number + 1), 0.0, 0.01)
            yield 0.1
            while not drawn:
                yield 0.1
            settled = shown_point(obj, vertex)
            if np.array_equal(settled, before):
                raise RuntimeError("the rotated bone moves nothing")
            shows = [np.array_equal(point, settled) for _time, point in drawn]
            if True not in shows:
                raise RuntimeError("what is drawn is not the pose")
            self.late[who] += shows.index(True)
            self.add(who, "pose", 1e3 * (drawn[shows.index(True)][0] - start))
        bpy.types.SpaceView3D.draw_handler_remove(handle, "WINDOW")
        bone.rotation_quaternion = original
        yield 0.1

    def paint(self, who: str) -> Iterator[float]:
        obj = self.meshes[0]
        bpy.context.view_layer.objects.active = obj
        with in_view3d():
            bpy.ops.object.mode_set(mode="WEIGHT_PAINT")
        yield 0.5
        with in_view3d():
            bpy.ops.wm.tool_set_by_id(name="builtin.brush")
        yield 0.5
        step = {"name": "", "pressure": 1.0, "size": 40.0, "time": 0.0, "is_start": True}
        step |= {"location": (0.0, 0.0, 0.0), "x_tilt": 0.0, "y_tilt": 0.0}
        with in_view3d():
            region = bpy.context.region
            for number in range(20):
                place = (region.width * (0.4 + 0.01 * number), region.height * 0.5)
                start = time.perf_counter()
                bpy.ops.paint.weight_paint(stroke=[step | {"mouse": place, "mouse_event": place}])
                bpy.context.view_layer.update()
                self.add(who, "paint", 1e3 * (time.perf_counter() - start))
            bpy.ops.object.mode_set(mode="OBJECT")
        yield 0.1

    def report(self) -> None:
        what = self.arguments.file.name if self.arguments.file else self.case.name
        facts = {"blender": bpy.app.version_string, "case": f"{what} {self.case.method}"}
        facts["vertices"] = sum(len(obj.data.vertices) for obj in self.meshes)
        facts = common.begin("window", **facts)
        print(f"{'':14}{'modifier':>10}{'sinew':>10}{'ratio':>10}")
        for name, unit in (
            ("play", "frames/s"),
            ("step", "ms"),
            ("draw", "ms"),
            ("pose", "ms"),
            ("paint", "ms"),
        ):
            modifier, sinew = (statistics.median(of[name]) for of in self.found.values())
            ratio = sinew / modifier if name == "play" else modifier / sinew
            print(f"{name:6}{unit:8}{modifier:10.2f}{sinew:10.2f}{ratio:8.2f} x")
        print(f"late         {self.late['modifier']:11}{self.late['sinew']:10}")
        spreads = {who: {k: common.spread(v) for k, v in of.items()} for who, of in self.found.items()}
        common.write(self.arguments.name, machine=facts, late=self.late, found=spreads)


def run(arguments: argparse.Namespace) -> Iterator[float]:
    bench = Bench(arguments)
    yield from bench.steps()
    bench.report()


def main() -> None:
    parser = argparse.ArgumentParser(prog="window.py", description=__doc__.splitlines()[0])
    parser.add_argument("--zip", type=lambda text: Path(text).resolve(), required=True)
    parser.add_argument("--file", type=lambda text: Path(text).resolve(), help="a rig instead of tubes")
    parser.add_argument("--vertices", type=int, default=13_380, help="of each tube")
    parser.add_argument("--characters", type=int, default=1)
    parser.add_argument("--method", choices=("dq", "lbs"), default="dq")
    parser.add_argument("--turns", type=int, default=5)
    parser.add_argument("--name", default="window", help="of the file in bench/results")
    arguments = parser.parse_args(sys.argv[sys.argv.index("--") + 1 :])
    program = run(arguments)

    def tick() -> float | None:
        try:
            return next(program)
        except StopIteration:
            pass
        except BaseException:
            traceback.print_exc()
        sys.stdout.flush()
        bpy.ops.wm.quit_blender()
        return None

    bpy.context.preferences.view.show_splash = False
    # Without this, opening a file ends timers.
    bpy.app.timers.register(tick, first_interval=2.0, persistent=True)


if __name__ == "__main__":
    main()
