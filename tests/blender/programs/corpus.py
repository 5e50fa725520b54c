# SPDX-License-Identifier: GPL-3.0-or-later
"""Real files of others: what Sinew makes of each, beside Blender's Armature modifier.

    ./dev corpus FOLDER... [--exports] [--json FILE] [--timeout SECONDS]

Every .blend, .glb, .gltf, .fbx and USD file below the folders is opened, described (`sinew info`), checked
(`sinew check`) and deformed: linear blend and dual quaternions must equal the Armature modifier, at frames
and in random poses, and all other methods must be finite. It is saved and opened with Sinew on it, Sinew is
removed, which must leave nothing, and it is exported to glTF, USD and FBX: each difference between what such
a file plays and what was seen must have a known cause. A second table counts the causes. --exports only
exports.

A file is a row of a table, also if it can not be opened, crashes Blender or takes too long. Ctrl-C keeps
what is done. Exit status 1: a file failed. Files are only read.
"""

from __future__ import annotations

import argparse
import io
import json
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from functools import partial
from pathlib import Path

import bpy
import numpy as np
from sinew_addon import cli, worker
from sinew_addon.attach import attach
from sinew_addon.base.errors import SinewError
from sinew_addon.blender_process import Limits
from sinew_addon.commands import info
from sinew_addon.commands.console import Console
from sinew_addon.deform import characters, session
from sinew_addon.features.gltf.export_check import CAUSES
from sinew_addon.io import files
from sinew_addon.jobs import workers
from sinew_addon.jobs.tasks import preflight

sys.path.append(str(Path(__file__).resolve().parents[2] / "support"))
import fuzz_parity
import routes
import scenes
import whole_file

KINDS = (".blend", *files.IMPORTERS)
FRAMES, RANDOM_POSES = 4, 3
EXPORTS = (".glb", ".usdc", ".fbx")
# The shape after saving and opening is computed again from the same numbers.
SAVED_TOLERANCE = 1e-6


def examine(task: dict, report: worker.Report) -> dict:
    """What a Blender of its own finds of the file "source" of a task.

    "vertices", "bones": of the meshes that Sinew deforms; "refused": a sentence for each other one that an
    armature deforms; "notes": what opening the file said; "worst": the largest distance from the Armature
    modifier by method, as a part of the diagonal; "by": routes taken; "exports": by format the largest
    distance of each cause, as a part of the diagonal; "failures": a sentence for each thing that is not as it
    should be
    """
    with tempfile.TemporaryDirectory() as folder:
        one = _File(Path(task["source"]), Path(folder), report)
        one.examine(only_exports=task.get("exports", False))
    return {**one.row, "failures": one.failures}


class _File:
    def __init__(self, source: Path, folder: Path, report: worker.Report) -> None:
        self.source, self.folder, self.report = source, folder, report
        # As Blender saves what it opened or imported.
        self.plain = folder / "plain.blend"
        self.names: list[str] = []
        self.row: dict = {"vertices": 0, "bones": 0, "refused": [], "worst": {}, "by": [], "exports": {}}
        self.failures: list[str] = []

    def examine(self, only_exports: bool) -> None:
        self.row["notes"] = files.open_file(self.source)
        # Saving drops some of it, and opening then more.
        bpy.data.orphans_purge(do_recursive=True)
        bpy.ops.wm.save_as_mainfile(filepath=str(self.plain))
        self._try("info", self.describe)
        if not self.row["meshes"]:
            return
        self._try("check", self.check)
        if not only_exports:
            self._try("parity", self.compare)
        if self.names and not only_exports:
            self._try("save", self.save)
        for kind in EXPORTS if self.names else ():
            self._try(f"export to {kind}", partial(self.export, kind))

    def _try(self, name: str, step: Callable[[], None]) -> None:
        self.report(name)
        try:
            step()
        except (Exception, SystemExit) as error:
            self.failures.append(f"{name}: {workers.sentence(error)}")

    def _meshes(self) -> list[bpy.types.Object]:
        return [bpy.data.objects[name] for name in self.names]

    def _open(self) -> list[bpy.types.Object]:
        """Returns the meshes to be examined, without Sinew."""
        files.open_file(self.plain)
        characters.show(self._meshes())
        return self._meshes()

    def describe(self) -> None:
        self.row["meshes"] = len(info.describe_file(self.plain))

    def check(self) -> None:
        """Finds the meshes that Sinew deforms; what `sinew check` says of the others."""
        self.row["refused"] = preflight.check({"source": str(self.plain)}, self.report)["problems"]
        files.open_file(self.plain)
        try:
            meshes, refused = characters.deformable_meshes(bpy.context.scene, self.plain, ["lbs", "dq"])
        except SinewError as error:
            meshes, refused = [], [str(error).removeprefix(f"{self.plain}: ")]
        self.names = [obj.name for obj in meshes]
        self.row["refused"] = list(dict.fromkeys([*self.row["refused"], *refused]))
        self.row["vertices"] = sum(len(obj.data.vertices) for obj in meshes)
        self.row["bones"] = sum(len(armature.data.bones) for armature in {*map(attach.armature_of, meshes)})

    def poses(self, meshes: list[bpy.types.Object]) -> Iterator[str]:
        scene = bpy.context.scene
        for frame in dict.fromkeys(np.linspace(scene.frame_start, scene.frame_end, FRAMES).round().tolist()):
            scene.frame_set(int(frame))
            yield f"frame {frame:g}"
        armatures = dict.fromkeys(map(attach.armature_of, meshes))
        for seed in range(RANDOM_POSES):
            for number, armature in enumerate(armatures):
                features = {"scale", "mirror"} if seed == RANDOM_POSES - 1 else set()
                fuzz_parity.pose(100 * seed + number, features, armature)
            bpy.context.view_layer.update()
            yield f"random pose {seed}"

    def compare(self) -> None:
        modifiers = [m for obj in self._open() for m in obj.modifiers if m.type == "ARMATURE"]
        by_modifiers = []
        for _pose in self.poses(self._meshes()):
            for _method, preserve_volume in fuzz_parity.ORACLES:
                for modifier in modifiers:
                    modifier.use_deform_preserve_volume = preserve_volume
                bpy.context.view_layer.update()
                by_modifiers.append({obj.name: scenes.final_points(obj) for obj in self._meshes()})
        count = len(fuzz_parity.ORACLES)
        for number, (method, _preserve_volume) in enumerate(fuzz_parity.ORACLES):
            self._open()
            self._use(method)
            worst = 0.0
            expected = iter(by_modifiers[number::count])
            for pose in self.poses(self._meshes()):
                self._pose_again()
                shapes = next(expected)
                for obj in self._meshes():
                    error = self._error(obj, method, shapes[obj.name])
                    worst = max(error, worst)
                    if not error <= scenes.TOLERANCE:
                        self.failures.append(f"parity: {obj.name} by {method}, {pose}: {error:.1e}")
            self.row["worst"][method] = worst
        for method in fuzz_parity.OTHERS:
            self._use(method)
            self._pose_again()
            for obj in self._meshes():
                # What Blender itself makes no numbers of is no method's fault.
                is_finite = np.isfinite(scenes.final_points(obj)).all()
                if not is_finite and np.isfinite(shapes[obj.name]).all():
                    self.failures.append(f"methods: {obj.name} by {method} is not finite")

    def _use(self, method: str) -> None:
        errors = characters.use_methods([(obj, method) for obj in self._meshes()])
        assert not any(errors), errors

    def _pose_again(self) -> None:
        """Changes the pose and restores it, so that Sinew must compute the shapes; notes the routes."""
        meshes = self._meshes()
        bones = [bone for armature in {*map(attach.armature_of, meshes)} for bone in armature.pose.bones]
        before = [bone.location.copy() for bone in bones]
        for bone in bones:
            bone.location.x += 1.0
        bpy.context.view_layer.update()
        numbers = [session.skinned_of(obj).shown.number for obj in meshes]
        for bone, location in zip(bones, before, strict=True):
            bone.location = location
        bpy.context.view_layer.update()
        self.row["by"] = sorted({*self.row["by"], *map(routes.taken, meshes, numbers)})

    def _error(self, obj: bpy.types.Object, method: str, shape: np.ndarray) -> float:
        """The largest distance from a shape, as a part of the diagonal."""
        shown = scenes.final_points(obj)
        if shown.shape != shape.shape or not np.isfinite(shape).all():
            return 0.0 if np.array_equal(shown, shape, equal_nan=True) else float("inf")
        extent = max(scenes.diagonal(obj), float(np.linalg.norm(np.ptp(shape, axis=0))))
        # A mesh of one vertex has no size.
        extent = extent or float(np.abs(shape).max()) or 1.0
        error = float(np.abs(shown - shape).max(initial=0.0)) / extent
        if error <= scenes.TOLERANCE or len(shown) != len(obj.data.vertices):
            return error
        # Without vertices at a discontinuity of the modifier, where rounding decides.
        armature, outcome = attach.armature_of(obj), fuzz_parity.Outcome(0)
        return fuzz_parity.error_of(obj, armature, method, shape, outcome, routes.EVALUATION)

    def save(self) -> None:
        """Saves and opens the file with Sinew on it, and removes Sinew."""
        self._open()
        # Actions have more numbers than all else, and are not Sinew's.
        before = whole_file.content(named="actions")
        self._open()
        self._use("dq")
        shapes = {obj.name: scenes.final_points(obj) for obj in self._meshes()}
        skinned = self.folder / "skinned.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(skinned))
        files.open_file(skinned)
        self.report("remove")
        for obj in self._meshes():
            again, shape = scenes.final_points(obj), shapes[obj.name]
            extent = float(np.abs(shape).max(initial=0.0))
            if again.shape != shape.shape or scenes.worst(again, shape) > SAVED_TOLERANCE * extent:
                self.failures.append(f"save: {obj.name} has another shape when it is opened")
        for obj in self._meshes():
            attach.remove(obj)
        changed = whole_file.differences(before, whole_file.content(named="actions"))
        if changed:
            self.failures.append(f"remove: {len(changed)} values differ, such as {changed[0]}")

    def export(self, kind: str) -> None:
        if not all(obj.data.polygons for obj in self._meshes()):
            return  # glTF has no meshes without faces.
        printed = io.StringIO()
        parser, commands = cli.make_parser()
        words = ["export", str(self.plain), "--method", "lbs", "--out", str(self.folder / f"out{kind}")]
        args = parser.parse_args([*words, "--verify", "--json"])
        commands["export"].run(args, Console(printed, io.StringIO()))
        said = json.loads(printed.getvalue())
        self.failures += [f"export to {kind}: {sentence}" for sentence in said["errors"]]
        found: dict[str, float] = {}
        if said["meshes"]:
            self.row["exports"][kind] = found
        for mesh in said["meshes"]:
            for cause, distance in mesh["causes"].items():
                if distance["largest"] > mesh["rounding"]:
                    share = distance["largest"] / (mesh["diagonal"] or 1.0)
                    found[cause] = max(found.get(cause, 0.0), share)
            if not mesh["explained"]:
                self.failures.append(f"export to {kind}: {mesh['mesh']}: {found['rest']:.1e} without a cause")


def files_below(folder: Path) -> Iterator[Path]:
    return (path for path in sorted(folder.rglob("*")) if path.suffix.lower() in KINDS and path.is_file())


def main() -> int:
    if sys.argv[1:] == ["--worker"]:
        worker.main({"examine": examine})
        return 0
    parser = argparse.ArgumentParser(prog="./dev corpus", description=__doc__.splitlines()[0])
    parser.add_argument("folders", nargs="+", type=Path, metavar="FOLDER")
    parser.add_argument("--exports", action="store_true", help="only export")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the rows as JSON")
    parser.add_argument("--timeout", type=float, default=600.0, metavar="SECONDS", help="for each file")
    args = parser.parse_args()
    console = Console(sys.stdout, sys.stderr)
    paths = [path for folder in args.folders for path in files_below(folder)]
    only = {"command": "examine", "exports": args.exports}
    tasks = [{**only, "source": str(path.absolute())} for path in paths]
    limits, program = Limits(timeout=args.timeout), [sys.executable, __file__, "--worker"]
    rows: list[dict] = []
    try:
        with closing(workers.run_one_by_one(tasks, limits, program)) as outcomes:
            since = time.monotonic()
            for path, outcome in zip(paths, console.progress(outcomes, len(tasks), "Files"), strict=True):
                seconds, since = round(time.monotonic() - since, 1), time.monotonic()
                rows.append({"file": str(path), "seconds": seconds, **outcome})
                console.note(_line(rows[-1], len(rows), len(paths)))
                if args.json is not None:
                    args.json.write_text(json.dumps(rows, indent=1), encoding="utf-8")
    except KeyboardInterrupt:
        console.note("Stopped; what is done:")
    _show(rows, console)
    return int(any(_fails(row) for row in rows))


def _fails(row: dict) -> list[str]:
    """Why a file failed; none for one that Blender itself can not open."""
    return row.get("failures", [] if _is_unreadable(row) else [row.get("error", "")])


def _is_unreadable(row: dict) -> bool:
    return ": Blender can not read it: " in row.get("error", "")


def _result(row: dict) -> str:
    if "error" in row:
        return row["error"].removeprefix(f"{Path(row['file']).absolute()}: ")
    if row["failures"]:
        return "failed"
    if not row["meshes"]:
        return "no skin"
    if row["refused"]:
        return f"refused: {'; '.join(row['refused'])}"
    return "; ".join(["ok", *row["notes"]])


def _line(row: dict, number: int, count: int) -> str:
    return "\n  ".join([f"[{number}/{count}] {row['file']}: {_result(row)}", *row.get("failures", [])])


def _counted(found: list[dict[str, float]], cause: str) -> str:
    shares = [shares[cause] for shares in found if cause in shares]
    return f"{len(shares)} ({100.0 * max(shares):.2g}%)" if shares else "0"


def _show(rows: list[dict], console: Console) -> None:
    def largest(row: dict, method: str) -> str:
        worst = row.get("worst", {}).get(method)
        return "" if worst is None else f"{worst:.1e}"

    skinned = [row for row in rows if row.get("vertices")]
    console.table(
        ("file", "vertices", "bones", "lbs", "dq", "seconds", "result"),
        [
            (
                *(row["file"], str(row.get("vertices", "")), str(row.get("bones", ""))),
                *(largest(row, "lbs"), largest(row, "dq"), str(row["seconds"]), _result(row)),
            )
            for row in rows
            if "error" in row or row["meshes"]
        ],
    )
    found = {kind: [r["exports"][kind] for r in skinned if kind in r["exports"]] for kind in EXPORTS}
    console.table(
        ("exported: differences by cause, in how many files (the largest, of the diagonal)", *EXPORTS),
        [
            ("files", *(str(len(found[kind])) for kind in EXPORTS)),
            (
                "none at frames",
                *(str(sum(not {*f} - {"sampling"} for f in found[k])) for k in EXPORTS),
            ),
            *((CAUSES[cause], *(_counted(found[kind], cause) for kind in EXPORTS)) for cause in CAUSES),
        ],
    )
    failed = [row for row in rows if _fails(row)]
    for row in failed:
        console.say("\n  ".join([row["file"], *_fails(row)]))
    worst = [error for row in skinned for error in row["worst"].values()]
    apart = f", worst distance from the Armature modifier {max(worst):.1e} of the diagonal" if worst else ""
    sizes = [row["vertices"] for row in skinned] or [0]
    console.say(
        f"Blender {bpy.app.version_string}: {len(rows)} files, {sum(map(_is_unreadable, rows))} that Blender "
        f"can not read; {len(skinned)} with skins that Sinew deforms, of {min(sizes)} to {max(sizes)} "
        f"vertices{apart}; {len(failed)} failed"
    )


if __name__ == "__main__":
    sys.exit(main())
