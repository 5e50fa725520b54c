# SPDX-License-Identifier: GPL-3.0-or-later
"""Batches of files: workers, journal, kills, hangs, limits, report."""

from __future__ import annotations

import ctypes
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from contextlib import ExitStack
from html import unescape
from pathlib import Path
from urllib.parse import unquote

import bpy
import numpy as np
import program
import psutil
import pytest
import scenes
import test_cluster
import whole_file
from program import ENVIRONMENT, run_sinew, start_sinew
from sinew_addon.attach import properties
from sinew_addon.blender_process import BlenderProcess, Limits, how_it_ended
from sinew_addon.io import files
from sinew_addon.jobs.job_file import Settings

pytestmark = pytest.mark.outer_versions

# On Windows tools/platform_tests.py provides another.
newest_only = pytest.mark.skipif(
    bpy.app.version < (5, 2) and os.name != "nt", reason="long: runs with the newest Blender alone"
)
FAST = ("--frames", "none", "--no-pictures")


def make_rig(path: Path, degrees: float = 100.0) -> Path:
    """A small character in its own file."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    _obj, armature = scenes.make_arm(sides=6, rings=5)
    scenes.key_pose(armature, degrees)
    return scenes.save(path, compress=True)


def make_rigs(folder: Path, count: int) -> list[Path]:
    return [make_rig(folder / f"rig {number:03d}.blend", 20.0 + number) for number in range(count)]


def blenders_of(process: subprocess.Popen) -> list[psutil.Process]:
    """The Blender processes that a batch has started."""
    return psutil.Process(process.pid).children()


def command_of(process: psutil.Process) -> list[str]:
    """Empty for a process that has just ended."""
    try:
        return process.cmdline()
    except psutil.Error:
        return []


def wait_for_work(process: subprocess.Popen, but: int | None = None) -> psutil.Process:
    """The first Blender, except the one with the id `but`, that has been busy for longer than starting
    takes: 3 s, or, emulated, 12 s."""
    started = 12.0 if sys.platform == "win32" else 3.0
    end = time.monotonic() + 120
    while time.monotonic() < end:
        for blender in blenders_of(process):
            try:
                if blender.pid != but and sum(blender.cpu_times()[:2]) > started:
                    return blender
            except psutil.Error:
                continue
        time.sleep(0.05)
    raise AssertionError("no Blender got to work")


def crash(process: psutil.Process) -> str:
    """Returns what the batch calls it. On Windows the process ends with the status of a crash."""
    if sys.platform == "win32":
        kernel = ctypes.WinDLL("kernel32")
        handle = kernel.OpenProcess(1, False, process.pid)  # PROCESS_TERMINATE
        assert kernel.TerminateProcess(handle, 0xC0000005)
        kernel.CloseHandle(handle)
        return "EXCEPTION_ACCESS_VIOLATION"
    process.send_signal(signal.SIGSEGV)
    return "SIGSEGV"


@pytest.mark.parametrize(
    ("status", "is_windows", "said"),
    [
        (-11, False, "Blender crashed (SIGSEGV)"),
        pytest.param(
            *(-9, False, "Blender crashed (SIGKILL)"),
            marks=pytest.mark.skipif(sys.platform == "win32", reason="it has no such signal"),
        ),
        (11, False, "Blender was ended (status 11)"),
        (11, True, "Blender crashed (EXCEPTION_ACCESS_VIOLATION)"),
        (0xC0000005, True, "Blender crashed (EXCEPTION_ACCESS_VIOLATION)"),
        (0xC0000409, True, "Blender crashed (exception 0xC0000409)"),
        (15, True, "Blender was ended (status 15)"),
        (1, True, "Blender was ended (status 1)"),
    ],
)
def test_a_crash_is_called_what_the_system_calls_it(status, is_windows, said):
    assert how_it_ended(status, is_windows) == said


def report_of(out: Path) -> dict[str, dict]:
    report = json.loads((out / "report.json").read_text(encoding="utf-8"))
    return {row["file"]: row for row in report["files"]}


def journal_of(out: Path) -> list[dict]:
    """The complete lines of a journal that may not be there yet, or end with half a line."""
    path = out / "sinew-journal.jsonl"
    content = path.read_bytes() if path.exists() else b""
    return [json.loads(line) for line in content[: content.rfind(b"\n") + 1].splitlines()]


def unfinished_in(folder: Path) -> list[Path]:
    return [path for path in folder.rglob(".*") if "unfinished" in path.name]


def contents(folder: Path) -> dict[str, bytes]:
    return {
        os.fsencode(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


def driven_points(path: Path) -> dict[str, bytes]:
    """The final points of a copy, and the settings that produce them."""
    files.open_file(path)
    skinned = [obj for obj in bpy.data.objects if properties.has_sinew(obj)]
    assert skinned, f"{path} is not re-skinned"
    found = whole_file.evaluated([1, 6, 11])
    return found | {f"{obj.name} method": properties.of(obj).method for obj in skinned}


def test_settings_for_files_and_objects(tmp_path):
    """A job file's methods by file and object override those for all; exclusions; the report."""
    for name in ("hero", "extra"):
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        for part in ("Body", "Face", "Hair"):
            scenes.make_arm(sides=6, rings=5, name=part)
        props = bpy.data.collections.new("Props")
        bpy.context.scene.collection.children.link(props)
        hat, _ = scenes.make_arm(sides=6, rings=5, name="Hat")
        props.objects.link(hat)
        scenes.save(tmp_path / "in" / "sub" / f"{name}.blend")
    (tmp_path / "job.toml").write_text(
        """
        inputs = ["in/**/*.blend"]
        out = "out"
        method = "dq"
        exclude = ["Props"]

        [[files]]
        match = "sub/hero.blend"
        include = ["Body", "F*"]

        [[files.objects]]
        match = "Face"
        method = "lbs"
        """
    )
    command = ("reskin", "--job", tmp_path / "job.toml", "--no-pictures")
    assert "2 of 2 files re-skinned" in run_sinew(*command).stdout
    methods = {}
    for name in ("hero", "extra"):
        files.open_file(tmp_path / "out" / "sub" / f"{name}.blend")
        skinned = [obj for obj in bpy.data.objects if properties.has_sinew(obj)]
        methods[name] = {obj.name: properties.of(obj).method for obj in skinned}
    assert methods == {
        "hero": {"Body": "dq", "Face": "lbs"},
        "extra": {"Body": "dq", "Face": "dq", "Hair": "dq"},
    }
    rows = report_of(tmp_path / "out")
    deviation = {mesh["object"]: mesh["deviation_part"] for mesh in rows["sub/hero.blend"]["meshes"]}
    assert deviation["Face"] <= scenes.TOLERANCE < 0.01 < deviation["Body"]
    assert run_sinew(*command, status=1).stderr.count("use --overwrite to replace it") == 2


@pytest.mark.slow
def test_report_has_pictures_of_the_worst_frame(tmp_path):
    from PIL import Image

    make_rig(tmp_path / "rig.blend")
    (tmp_path / "bad.blend").write_text("nothing")
    inputs, options = (tmp_path / "rig.blend", tmp_path / "bad.blend"), ("--method", "dq", "--frames", "1,11")
    run_sinew("reskin", *inputs, *options, "--out", tmp_path / "out", status=1)
    row = report_of(tmp_path / "out")["rig.blend"]
    assert row["pictures"]["frame"] == row["meshes"][0]["frame"] == 11
    obj = bpy.data.objects["Arm"]
    linear, dual = (scenes.modifier_shapes(obj, [11], preserve_volume=keep)[0] for keep in (False, True))
    expected = np.linalg.norm(dual - linear, axis=1).max()
    assert row["meshes"][0]["deviation"] == pytest.approx(expected, abs=1e-5)
    folder = tmp_path / "out" / "report-pictures"
    before, after = (
        np.asarray(Image.open(folder / row["pictures"][name]).convert("RGBA"), dtype=np.float64)
        for name in ("before", "after")
    )
    assert before[..., 3].std() > 20, "an empty picture"
    # Rendered at twice the size that the page shows, without smoothing.
    assert max(before.shape[:2]) == 720
    assert len(np.unique(before[..., 3])) <= 5
    assert 0.5 < np.abs(before - after).mean() < 100

    page = unescape((tmp_path / "out" / "report.html").read_text(encoding="utf-8"))
    images = re.findall(r'<img[^>]* src="([^"]*)"', page)
    assert [(tmp_path / "out" / unquote(image)).exists() for image in images] == [True, True]
    assert "max-width: 360px; max-height: 360px" in page
    assert "is not a .blend file" in page
    assert "Armature, linear blend → dq" in page


@pytest.mark.slow
def test_a_file_does_not_depend_on_those_before_it(tmp_path):
    """A Blender that has processed other files gives the same result as a fresh one."""
    folder = tmp_path / "in"
    shutil.copytree(Path(__file__).resolve().parents[3] / "blend_files", folder)
    make_rig(folder / "z.blend")
    run_sinew("reskin", folder, "--method", "qv", "--out", tmp_path / "all", "--jobs", 1, "--no-pictures")
    run_sinew("reskin", folder / "z.blend", "--method", "qv", "--out", tmp_path / "alone", *FAST)
    both = []
    for path in (tmp_path / "all" / "z.blend", tmp_path / "alone" / "z.blend"):
        files.open_file(path, load_ui=True)
        both.append(whole_file.of_open_file() | whole_file.evaluated([1, 6, 11]))
    assert whole_file.differences(*both) == []


@newest_only
def test_resume_does_only_what_is_missing_or_changed(tmp_path):
    paths = make_rigs(tmp_path / "in", 6)
    (tmp_path / "in" / "bad.blend").write_text("nothing")
    out = tmp_path / "out"
    arguments = ("reskin", tmp_path / "in", "--out", out, *FAST)
    run_sinew(*arguments, "--method", "dq", status=1)
    written = {path.name: (out / path.name).stat().st_mtime_ns for path in paths}

    make_rig(paths[0], 77.0)  # changed
    (out / paths[1].name).unlink()  # missing
    os.utime(paths[2])  # touched, with what was in it
    (out / paths[3].name).write_bytes(b"edited by an artist")
    result = run_sinew(*arguments, "--method", "dq", "--resume", status=1)
    rows = report_of(out)
    statuses = [rows[path.name]["status"] for path in paths]
    assert statuses == ["written", "written", "unchanged", "failed", "unchanged", "unchanged"]
    assert "was changed since it was written" in rows[paths[3].name]["error"]
    assert (out / paths[3].name).read_bytes() == b"edited by an artist"
    assert "is not a .blend file" in rows["bad.blend"]["error"]
    assert (out / paths[2].name).stat().st_mtime_ns == written[paths[2].name]
    assert "3 of them before" in result.stdout

    (out / paths[3].name).unlink()
    (tmp_path / "in" / "bad.blend").unlink()
    # Half a line, as after a full disk or a lost machine.
    with (out / "sinew-journal.jsonl").open("ab") as journal:
        journal.write(b'{"file":"rig 000.blend","writ')
    run_sinew(*arguments, "--method", "dq", "--resume")
    assert Counter(row["status"] for row in report_of(out).values()) == {"unchanged": 5, "written": 1}
    run_sinew(*arguments, "--method", "lbs", "--resume")
    assert Counter(row["status"] for row in report_of(out).values()) == {"written": 6}
    assert driven_points(out / paths[0].name)["Arm method"] == "lbs"


@pytest.mark.slow
@newest_only
def test_hang_crash_and_greed_fail_alone(tmp_path):
    scenes.write_slow_file(tmp_path / "in" / "a endless.blend", 500, 100_000_000)
    scenes.write_slow_file(tmp_path / "in" / "b greedy.blend", 8000, 1)
    make_rig(tmp_path / "in" / "c good.blend")
    out = tmp_path / "out"
    arguments = ("reskin", tmp_path / "in", "--method", "dq", "--out", out, *FAST, "--jobs", 1)
    run_sinew(*arguments, "--timeout", 3, "--memory", "700MiB", status=1)
    rows = report_of(out)
    assert "no end after 3 s while opening it; tried 2 times" in rows["a endless.blend"]["error"]
    assert "needed more than 700 MiB" in rows["b greedy.blend"]["error"]
    assert rows["c good.blend"]["status"] == "written"

    process = start_sinew(*arguments, "--resume", "--memory", "700MiB")
    first = wait_for_work(process)
    # While one batch works in a folder, no other one may.
    refused = run_sinew(*arguments, "--resume", status=2)
    assert "another batch is at work there" in refused.stderr
    how = crash(first)
    crash(wait_for_work(process, but=first.pid))
    _output, errors = process.communicate(timeout=120)
    assert process.returncode == 1, errors
    rows = report_of(out)
    assert f"Blender crashed ({how}) while opening it; tried 2 times" in rows["a endless.blend"]["error"]
    assert rows["c good.blend"]["status"] == "unchanged"
    assert unfinished_in(out) == []


@pytest.mark.skipif(not hasattr(os, "sched_getaffinity"), reason="this system does not limit threads so")
def test_a_blender_keeps_to_its_share_of_the_processors(tmp_path):
    """It may use as many threads as allowed for its work, and none is bound to a processor."""
    there = os.sched_getaffinity(0)
    if len(there) < 2:
        pytest.skip("needs two processors")
    rig = make_rig(tmp_path / "rig.blend")
    settings = Settings(method="dq").as_task()
    paths = {
        "source": str(rig),
        "target": str(tmp_path / "out.blend"),
        "unfinished": str(tmp_path / "u.blend"),
    }
    task = {"command": "reskin", "settings": settings, "frames": "auto", "pictures": None, **paths}
    counts = []
    for threads in (0, 1):
        blender = BlenderProcess(Limits(threads=threads))
        try:
            assert blender.run(task, Limits())["meshes"]
            (process,) = program.own_children()
            own = [thread.id for thread in process.threads()]
            assert all(os.sched_getaffinity(thread) == there for thread in own)
        finally:
            blender.end()
        counts.append(len(own))
    assert counts[1] < counts[0]


def test_links_are_kept_and_reported(tmp_path):
    """Linked characters are reported, missing libraries kept; relative paths still lead there."""
    make_rig(tmp_path / "library" / "hero.blend")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scenes.make_arm(sides=6, rings=5, name="Local")
    hero = tmp_path / "library" / "hero.blend"
    shot = scenes.save(tmp_path / "shots" / "shot.blend")
    for library, relative in ((hero, True), (tmp_path / "library" / "gone.blend", False)):
        if not library.exists():
            shutil.copy(hero, library)
        scenes.link_here(library, "Arm", relative=relative)
    scenes.save(shot)
    (tmp_path / "library" / "gone.blend").unlink()

    out = tmp_path / "out" / "deep"
    run_sinew("reskin", shot, "--method", "dq", "--out", out, *FAST, status=1)
    row = report_of(out)["shot.blend"]
    assert [mesh["object"] for mesh in row["meshes"]] == ["Local"]
    assert any("linked from another file" in reason for reason in row["left_out"])
    assert [note for note in row["notes"] if "gone.blend is missing" in note]
    files.open_file(out / "shot.blend")
    libraries = {
        os.path.normpath(bpy.path.abspath(library.filepath)): len(library.users_id)
        for library in bpy.data.libraries
    }
    assert set(libraries) == {str(hero), str(tmp_path / "library" / "gone.blend")}
    assert all(libraries.values())


def test_libraries_of_libraries_are_found(tmp_path):
    """In other folders than the file, to which all their paths are relative."""
    base = tmp_path / "library" / "characters" / "hero.blend"
    middle = tmp_path / "sets" / "set.blend"
    shot = tmp_path / "shots" / "deep" / "shot.blend"
    for path, library in ((base, None), (middle, base), (shot, middle)):
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        if path != middle:
            scenes.make_arm(sides=6, rings=5)
        scenes.save(path)
        content = bpy.data.collections.new(path.stem)
        bpy.context.scene.collection.children.link(content)
        if library is None:
            content.objects.link(bpy.data.objects["Arm"])
        else:
            with bpy.data.libraries.load(str(library), link=True, relative=True) as (_, to):
                to.collections = [library.stem]
            instance = bpy.data.objects.new("Instance", None)
            instance.instance_type, instance.instance_collection = "COLLECTION", to.collections[0]
            content.objects.link(instance)
        scenes.save(path)
    out = tmp_path / "out"
    run_sinew("reskin", shot, "--method", "dq", "--out", out, *FAST, status=1)
    assert report_of(out)["shot.blend"]["notes"] == []
    files.open_file(out / "shot.blend")
    paths = {os.path.normpath(bpy.path.abspath(library.filepath)) for library in bpy.data.libraries}
    assert paths == {str(base), str(middle)}


@pytest.mark.slow
@newest_only
def test_200_files_on_one_machine_and_on_a_cluster(tmp_path):
    folder = tmp_path / "in"
    good, broken = make_library(folder, 200)
    before = contents(folder)
    out = tmp_path / "local"
    lock_folder(out / "locked")
    result = run_sinew("reskin", folder, "--method", "dq", "--out", out, "--no-pictures", status=1)
    assert contents(folder) == before
    rows = report_of(out)
    assert len(rows) == len(good) + len(broken) == 200
    for name, reason in broken.items():
        row = rows[name]
        assert reason in (row.get("error") or " ".join(row["left_out"])), (name, row)
    for name in good:
        # Parts of a name that are not text are shown as ?.
        name = name.encode("utf-8", "replace").decode()
        assert rows[name]["status"] == "written", (name, rows[name])
        assert not rows[name]["left_out"]
    assert "written by a newer Blender, 99.0" in rows["from the future.blend"]["notes"][0]
    assert f"{len(good)} of {len(good) + len(broken)} files re-skinned" in result.stdout
    assert unfinished_in(out) == []

    sample = [name for name in good if name.startswith(("names", "rig"))][::9]
    with Cluster(tmp_path) as cluster:
        there = tmp_path / "cluster"
        lock_folder(there / "locked")
        process = start_sinew(
            "reskin", folder, "--method", "dq", "--out", there, *FAST, "--scheduler", cluster.address
        )
        for _ in range(40):
            process.stderr.readline()
        cluster.lose_a_worker()
        _output, errors = process.communicate(timeout=300)
        assert process.returncode == 1, errors
    assert unfinished_in(there) == []
    elsewhere = report_of(there)
    assert {name: row["status"] for name, row in rows.items()} == {
        name: row["status"] for name, row in elsewhere.items()
    }
    inputs = [folder / name for name in sample]
    run_sinew("reskin", *inputs, "--method", "dq", "--jobs", 1, "--out", tmp_path / "one", *FAST)
    for name in sample:
        points = driven_points(out / name)
        assert points == driven_points(there / name) == driven_points(tmp_path / "one" / Path(name).name), (
            name
        )


@pytest.mark.slow
@newest_only
@pytest.mark.parametrize("place", ["machine", "cluster"])
def test_killed_at_random(tmp_path, place):
    """Kills the batch each time, and before that often one of its Blenders, or a cluster's worker with its
    process."""
    folder, out = tmp_path / "in", tmp_path / "out"
    paths = make_rigs(folder, 60)
    before = contents(folder)
    choose = random.Random(8)
    arguments = ("reskin", folder, "--method", "dq", "--out", out, *FAST, "--resume")
    lost: Counter[str] = Counter()
    with ExitStack() as stack:
        cluster = stack.enter_context(Cluster(tmp_path)) if place == "cluster" else None
        if cluster is not None:
            arguments = (*arguments, "--scheduler", cluster.address)
        for _ in range(8):
            jobs = () if cluster is not None else ("--jobs", choose.randint(1, 2))
            process = start_sinew(*arguments, *jobs)
            read_some(process, choose)
            own = {"Blender": lambda process=process: blenders_of(process)}
            theirs = {} if cluster is None else {"worker": cluster.workers, "Blender": cluster.blenders}
            for kind, victims in (theirs or own).items():
                if choose.random() < 0.5:
                    lost[kind] += kill_one(victims(), choose)
                    time.sleep(choose.uniform(0.0, 0.1))
            blenders = blenders_of(process)
            process.kill()
            process.communicate()
            _gone, left = psutil.wait_procs(blenders, timeout=10)
            assert left == [], "a Blender outlived its batch"
            check_whole(out)
        assert 0 < len(list(out.glob("[!.]*.blend"))) < 60, "the kills came too late to mean anything"
        assert all(lost[kind] for kind in theirs)
        # A file that was lost with two Blenders is reported, and done by the next run.
        process = start_sinew(*arguments)
        said, errors = process.communicate(timeout=120)
        assert process.returncode == 0, errors
        assert "60 of 60 files" in said
    assert contents(folder) == before
    check_each_once(out, paths)


def read_some(process: subprocess.Popen, choose: random.Random) -> None:
    """Waits until a few files are done, and slightly longer."""
    for _ in range(choose.randint(0, 3)):
        line = process.stderr.readline()
        while line and "unchanged" in line:
            line = process.stderr.readline()
    time.sleep(choose.uniform(0.0, 0.06))


def kill_one(processes: list[psutil.Process], choose: random.Random) -> bool:
    if not processes:
        return False
    try:
        choose.choice(processes).kill()
    except psutil.NoSuchProcess:
        return False
    return True


def check_whole(out: Path) -> None:
    """A file with its final name is complete: exactly the file that its record describes."""
    records = {r["file"]: r for r in journal_of(out)}
    for copy in out.glob("[!.]*.blend"):
        status = copy.stat()
        assert records[copy.name]["written"] == [status.st_size, status.st_mtime_ns]


def check_each_once(out: Path, paths: list[Path]) -> None:
    assert unfinished_in(out) == []
    times = Counter(record["file"] for record in journal_of(out) if "error" not in record)
    assert times == {path.name: 1 for path in paths}, "lost, or done twice"
    for path in paths:
        assert driven_points(out / path.name)["Arm method"] == "dq"


def lock_folder(path: Path) -> None:
    """A folder in which nothing can be created, not even by root."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if os.geteuid() == 0:
        path.symlink_to("/proc", target_is_directory=True)
    else:
        path.mkdir(mode=0o555)


def make_library(folder: Path, count: int) -> tuple[list[str], dict[str, str]]:
    """Good and bad files: names of those to be re-skinned; for the others, with the expected message."""
    alphabets = ["Ünïcödé", "名前", "имя", "اسم", "שם", "ชื่อ", "नाम", "이름", "όνομα", "🦴 bone", "名" * 70]
    signs = ["it's", 'a "quote"', "new\nline", "-dash", "100%", "[brackets]"]
    signs += ["*", "back\\slash", "$HOME", " space "]
    good = [f"names/{name}.blend" for name in [*alphabets, *signs, "dot.dot"]]
    if sys.platform == "linux":
        good.append(f"names/{os.fsdecode(b'latin-1 ' + bytes([0xE9]))}.blend")
    template = make_rig(folder / "rig.blend")
    good.append("rig.blend")
    whole = template.read_bytes()
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "plain.blend"), compress=False)
    good.append("plain.blend")
    plain = (folder / "plain.blend").read_bytes()
    for name in good:
        if name.startswith("names"):
            (folder / "names").mkdir(exist_ok=True)
            (folder / name).write_bytes(whole)

    broken: dict[str, str] = {}

    def broke(name: str, content: bytes, reason: str) -> None:
        path = folder / "broken" / f"{name}.blend"
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(content)
        broken[f"broken/{name}.blend"] = reason

    broke("empty", b"", "is empty")
    broke("text", b"not a blend file", "is not a .blend file")
    broke("picture", b"\x89PNG\r\n\x1a\n" + bytes(100), "is not a .blend file")
    broke("header only", plain[:12], "Blender can not read it")
    broke("magic only", b"BLENDER", "Blender can not read it")
    broke("gzip of nothing", b"\x1f\x8b" + bytes(30), "Blender can not read it")
    broke("zstd of nothing", b"\x28\xb5\x2f\xfd" + bytes(30), "Blender can not read it")
    for part in (3, 10, 50, 90):
        broke(f"{part} percent", plain[: len(plain) * part // 100], "Blender can not read it")
        broke(f"{part} percent, compressed", whole[: len(whole) * part // 100], "Blender can not read it")
    assert plain.startswith(b"BLENDER17-01v0")
    (folder / "from the future.blend").write_bytes(b"BLENDER17-01v9900" + plain[17:])
    good.append("from the future.blend")

    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.mesh.primitive_cube_add()
    scenes.save(folder / "broken" / "no armature.blend")
    broken["broken/no armature.blend"] = "no mesh is deformed by an armature"

    # An armature in a missing library, with its absolute path.
    library = make_rig(folder.parent / "library.blend")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    obj, _armature = scenes.make_arm(sides=6, rings=5)
    with bpy.data.libraries.load(str(library), link=True) as (_, to):
        to.objects = ["Arm Rig"]
    obj.modifiers["Armature"].object = to.objects[0]
    scenes.save(folder / "broken" / "armature is gone.blend")
    library.unlink()
    broken["broken/armature is gone.blend"] = "no mesh is deformed by an armature"

    make_rig(folder / "locked" / "in a locked folder.blend")
    broken["locked/in a locked folder.blend"] = "can not be written"
    (folder / "a folder.blend").mkdir()
    (folder / "nowhere.blend").symlink_to(folder / "no such file")
    (folder / "backup.blend1").write_bytes(whole)

    more = count - len(good) - len(broken)
    make_rigs(folder / "rigs", more)
    good += [f"rigs/rig {number:03d}.blend" for number in range(more)]
    return good, broken


class Cluster(ExitStack):
    """A dask scheduler and two workers, in their own processes."""

    def __init__(self, folder: Path) -> None:
        super().__init__()
        address_file = folder / "scheduler.json"
        options = ("--scheduler-file", str(address_file), "--no-dashboard")
        self._start(folder, "scheduler", *options, "--port", "0", "--host", "127.0.0.1")
        worker = ("worker", *options, "--nthreads", "1", "--local-directory", str(folder))
        self._workers = [self._start(folder, *worker) for _ in range(2)]
        end = time.monotonic() + 60
        while not address_file.exists() and time.monotonic() < end:
            time.sleep(0.1)
        self.address = json.loads(address_file.read_text())["address"]

    def _start(self, folder: Path, *arguments: str) -> subprocess.Popen:
        return self.enter_context(test_cluster.running(folder, *arguments, environment=ENVIRONMENT))

    def lose_a_worker(self) -> None:
        """Kills one with its current process; its nanny starts another."""
        for process in psutil.Process(self._workers[-1].pid).children():
            process.kill()

    def workers(self) -> list[psutil.Process]:
        return [
            child
            for keeper in self._workers
            for child in psutil.Process(keeper.pid).children()
            if "spawn_main" in " ".join(command_of(child))
        ]

    def blenders(self) -> list[psutil.Process]:
        return [
            child
            for worker in self.workers()
            for child in worker.children()
            if any(part.endswith(".worker") for part in command_of(child))
        ]
