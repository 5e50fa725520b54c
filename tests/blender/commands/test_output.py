# SPDX-License-Identifier: GPL-3.0-or-later
"""If a command can not write: one sentence, exit status 1, no partial files, no traceback.

Tests may run as root, who may write to every folder. Therefore files and links replace folders, disks are
read-only or full, and /proc accepts no files.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import zipfile
from pathlib import Path

import bpy
import numpy as np
import pytest
import scenes
from program import RUN, checked, complaint, disk, run_sinew, start_sinew, with_sinew
from sinew_addon import cli
from sinew_addon.base import output
from sinew_addon.base.errors import SinewError
from sinew_addon.base.names import as_file_name

pytestmark = pytest.mark.outer_versions

oldest_and_newest = pytest.mark.skipif(
    bpy.app.version[:2] not in ((4, 2), (5, 2)), reason="long: runs with the oldest and the newest Blender"
)
OUT = "OUT"
# For each command that writes: its arguments, and the name of its output.
WRITERS = {
    "points": (("points", "FILE", "--method", "dq", "--frames", "1,6", "--out", OUT), "points.npz"),
    "reskin": (("reskin", "FILE", "--method", "dq", "--frames", "none", "--out", OUT), "out"),
    "restore": (("restore", "RESKINNED", "--out", OUT), "out"),
    "inbetween": (("inbetween", "FILE", "--method", "sclerp", "--out", OUT), "out"),
    "export": (("export", "FILE", "--method", "cor", "--out", OUT), "arm.glb"),
    "blend": (("blend", "FILE", "--actions", "Bend", "Bend", "--out", OUT), "blended.blend"),
    **{
        f"bake {kind}": (
            ("bake", "FILE", "--method", "dq", "--to", kind, "--frames", "1-3", "--out", OUT),
            "out",
        )
        for kind in ("shape-keys", "mdd", "alembic", "usd")
    },
    "flex": (("flex", "FILE", "--out", OUT), "out"),
    "compare": (
        ("compare", "FILE", "--frames", "1,6", "--pictures", "1", "--size", "64", "--out", OUT),
        "out",
    ),
    "render": (
        ("render", "FILE", "--method", "dq", "--frames", "1,6", "--size", "64", "--out", OUT),
        "out",
    ),
}


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    """An arm with an action of bones, and the same after reskin."""
    folder = tmp_path_factory.mktemp("inputs")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    _obj, armature = scenes.make_arm()
    armature.animation_data.action.name = "Bend"
    scenes.save(folder / "arm.blend")
    run_sinew(
        "reskin", folder / "arm.blend", "--method", "dq", "--frames", "none", "--out", folder / "skinned"
    )
    return {"FILE": folder / "arm.blend", "RESKINNED": folder / "skinned" / "arm.blend"}


def arguments_of(writer: str, inputs: dict, out: Path) -> list[str]:
    arguments, _name = WRITERS[writer]
    places = {**inputs, OUT: out}
    return [str(places.get(argument, argument)) for argument in arguments]


def complaint_here(arguments: list[str], capsys) -> str:
    """The same for a command that ends before it uses Blender, without starting a process for it."""
    assert cli.main(arguments) == 1
    return complaint(capsys.readouterr().err)


def all_in(folder: Path) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*"))


@pytest.mark.once
def test_every_command_that_writes_is_tested_here():
    parser, commands = cli.make_parser()
    (of_commands,) = (each for each in parser._actions if each.dest == "command")
    writing = {name for name in commands if "--out" in of_commands.choices[name].format_help()}
    assert writing == {name.split()[0] for name in WRITERS}


@pytest.mark.once
@pytest.mark.parametrize("writer", WRITERS)
def test_no_folder_to_write_to(writer, inputs, tmp_path, capsys):
    name = WRITERS[writer][1]
    file = tmp_path / "taken.blend"
    file.write_bytes(b"precious")
    (tmp_path / "nowhere").symlink_to(tmp_path / "gone" / "too")
    failed = run_sinew(*arguments_of(writer, inputs, file / "x" / name), status=1)
    assert "can not be written" in complaint(failed.stderr)
    assert f"{file} is a file" in failed.stderr
    assert failed.stdout == ""
    for place, wanted in (
        (tmp_path / "nowhere" / "x" / name, "is a link to nothing"),
        (Path("/proc/sinew") / name, "nothing can be made in /proc"),
    ):
        assert wanted in complaint_here(arguments_of(writer, inputs, place), capsys)
    assert file.read_bytes() == b"precious"
    assert all_in(tmp_path) == ["nowhere", "taken.blend"]


@pytest.mark.once
@pytest.mark.parametrize("writer", WRITERS)
def test_the_wrong_thing_has_the_name(writer, inputs, tmp_path, capsys):
    """A file where a folder should be, and a folder where a file should be."""
    place = tmp_path / WRITERS[writer][1]
    if place.suffix:
        place.mkdir()
        wanted = "is a folder, expected a file"
    else:
        place.write_bytes(b"precious")
        wanted = "is a file"
    assert wanted in complaint_here(arguments_of(writer, inputs, place), capsys)
    assert all_in(tmp_path) == [place.name]


@pytest.mark.once
@pytest.mark.parametrize("writer", WRITERS)
def test_a_read_only_disk(writer, inputs, tmp_path, capsys):
    with disk(tmp_path / "locked", "ro") as folder:
        place = folder / "deep" / WRITERS[writer][1]
        assert "Read-only file system" in complaint_here(arguments_of(writer, inputs, place), capsys)


@oldest_and_newest
@pytest.mark.parametrize("writer", WRITERS)
def test_a_full_disk(writer, inputs, tmp_path):
    """Room for a few folders, but for no file."""
    with disk(tmp_path / "full", "size=16k") as folder:
        (folder / "ballast").write_bytes(bytes(16 * 1024 - 4096))
        with pytest.raises(OSError, match="No space"):
            (folder / "ballast 2").write_bytes(bytes(8192))
        (folder / "ballast 2").unlink()
        failed = run_sinew(*arguments_of(writer, inputs, folder / "deep" / WRITERS[writer][1]), status=1)
        assert re.search(r"can not be written|can not be drawn|are free", failed.stderr), failed.stderr
        left = [path for path in folder.rglob("*") if path.is_file() and path.name != "ballast"]
        assert [path.name for path in left if "unfinished" in path.name or not path.stat().st_size] == []


# A command, while no file may be larger than this.
LIMITED = f"""
import resource
before = resource.getrlimit(resource.RLIMIT_FSIZE)
resource.setrlimit(resource.RLIMIT_FSIZE, (600, before[1]))
try:
    exec({RUN!r})
finally:
    resource.setrlimit(resource.RLIMIT_FSIZE, before)
"""


@oldest_and_newest
@pytest.mark.parametrize("writer", WRITERS)
def test_a_write_that_stops_half_way(writer, inputs, tmp_path):
    """A limit on the size of files simulates a disk that fills up in the meantime."""
    place = tmp_path / "deep" / WRITERS[writer][1]
    failed = checked(with_sinew.run(LIMITED, *arguments_of(writer, inputs, place)), 1)
    assert re.search(r"can not be (written|drawn)", failed.stderr), failed.stderr
    left = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert [path.name for path in left if "unfinished" in path.name] == []
    # A journal keeps complete lines, however few; a report of these can be small enough.
    assert {path.name for path in left} <= {"sinew-journal.jsonl", "report.json"}
    assert all(json.loads(path.read_text()) for path in left if path.name == "report.json")


@pytest.mark.once
def test_a_device_is_not_replaced(tmp_path):
    """Renaming a file to /dev/null would replace that for the whole machine."""
    pipe = tmp_path / "pipe.npz"
    os.mkfifo(pipe)
    with pytest.raises(SinewError, match="is a device or a pipe"):
        output.file_to_write(pipe, (".npz",))


@pytest.mark.once
def test_points_replace_no_other_kind_of_file(inputs):
    before = inputs["FILE"].read_bytes()
    refused = run_sinew(*arguments_of("points", inputs, inputs["FILE"]), status=2)
    assert "expected a name ending in .npz" in complaint(refused.stderr)
    assert inputs["FILE"].read_bytes() == before


def test_what_is_raised_meanwhile_leaves_nothing(tmp_path):
    def write(unfinished: Path) -> None:
        unfinished.write_text("half")
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        output.write_whole(tmp_path / "a" / "b" / "c.txt", write)
    assert all_in(tmp_path) == []


@pytest.mark.once
@pytest.mark.parametrize("arguments", [("methods",), ("methods", "--json"), ("info", "FILE")])
def test_standard_output_on_a_full_disk(arguments, inputs):
    with open("/dev/full", "w") as full:
        process = start_sinew(*(inputs.get(argument, argument) for argument in arguments), stdout=full)
        _output, errors = process.communicate(timeout=60)
    assert complaint(errors) == "sinew: standard output: can not be written: No space left on device"
    assert process.returncode == 1
    assert "Traceback" not in errors
    assert "Exception ignored" not in errors


@pytest.mark.once
@pytest.mark.parametrize(
    "arguments",
    [
        ("info", "LONG"),
        ("reskin", "LONG", "--method", "dq", "--out", "OUT"),
        ("points", "FILE", "--method", "dq", "--frames", "1", "--out", "LONG.npz"),
        ("reskin", "FILE", "--method", "dq", "--out", "LONG"),
        ("render", "FILE", "--against", "FILE/x", "--out", "OUT"),
        ("inbetween", "FILE/x", "--method", "dlb", "--out", "OUT"),
    ],
)
def test_names_that_are_too_long_or_below_a_file(arguments, inputs, tmp_path):
    """What else can not be read is in test_command_line.py."""
    places = {
        "FILE": str(inputs["FILE"]),
        "OUT": str(tmp_path / "out"),
        "LONG": str(tmp_path / ("a" * 300)),
    }
    words = [re.sub(r"\b(FILE|OUT|LONG)\b", lambda found: places[found[0]], a) for a in arguments]
    assert complaint(run_sinew(*words, status=1).stderr)
    assert not [path for path in tmp_path.rglob("*") if "unfinished" in path.name]


@pytest.mark.once
def test_a_job_file_that_is_a_folder(tmp_path):
    refused = run_sinew("reskin", "--job", tmp_path, "--out", tmp_path / "out", status=2)
    assert "can not be read" in complaint(refused.stderr)


NAMES = [
    "../../x",
    "/etc/x",
    "a/b",
    "..",
    "C:\\x",
    "C:x",
    "mixamorig:Body",
    "100%2F",
    "Häschen 50%",
    "\x1b[2J",
    "con.x",
    "LPT¹",
    "Arm. ",
]


def test_names_of_objects_stay_in_the_archive(tmp_path):
    """They are keys for numpy, and file names for whoever unpacks the archive."""
    for name in NAMES:
        obj, _armature = scenes.make_arm(sides=6, rings=5, name="Arm")
        obj.name = name
        assert obj.name == name
    file, out = tmp_path / "names.blend", tmp_path / "deep" / "below" / "points.npz"
    scenes.save(file)
    done = run_sinew("points", file, "--method", "dq", "--frames", "1", "--out", out)
    assert "\x1b" not in done.stderr
    with np.load(out) as arrays:
        assert set(arrays.files) == {as_file_name(name) for name in NAMES} | {"frames"}
        assert "mixamorig:Body" in arrays.files
        assert "..%2F..%2Fx" in arrays.files
    with zipfile.ZipFile(out) as archive:
        for member in archive.namelist():
            assert not re.search(r"[/\\]|^\.+$|^[A-Za-z]:", member.removesuffix(".npy")), member


@pytest.mark.once
def test_names_can_be_had_back():
    from urllib.parse import unquote

    for name in NAMES:
        assert unquote(as_file_name(name)) == name
    assert [as_file_name(name) for name in ("CON", "com1", "Console")] == ["%43ON", "%63om1", "Console"]


def test_two_objects_of_one_name(tmp_path):
    """A linked one and one of the file's own: each has its array."""
    scenes.make_arm(sides=6, rings=5, name="Arm")
    library = scenes.save(tmp_path / "library.blend")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scenes.make_arm(sides=8, rings=5, name="Arm")
    scenes.link_here(library, "Arm", "Arm Rig")
    shot = scenes.save(tmp_path / "shot.blend")
    out = tmp_path / "points.npz"
    run_sinew("points", shot, "--method", "blender", "--frames", "1,6", "--out", out)
    with np.load(out) as arrays:
        assert sorted(arrays.files) == ["Arm", "Arm [library.blend]", "frames"]
        assert arrays["Arm"].shape == (2, 40, 3)
        assert arrays["Arm [library.blend]"].shape == (2, 30, 3)


def test_names_that_blender_would_fill_in(inputs, tmp_path):
    """Blender replaces # by the frame, and from 5.0 on {…}, in the paths of what it renders."""
    name = "{blend_name} ##.blend"
    file = tmp_path / name
    file.write_bytes(inputs["FILE"].read_bytes())
    out = tmp_path / "o{scene_name}ut ##"
    run_sinew("render", file, "--method", "dq", "--frames", "6", "--size", "64", "--out", out)
    assert all_in(out) == ["0006.png", "render.json"]
    run_sinew("compare", file, "--frames", "1,6", "--size", "64", "--pictures", "1", "--out", out)
    assert (out / f"{file.stem}.html").exists()
    assert [path for path in (out / file.stem / "pictures").iterdir() if path.suffix == ".png"]
    assert all_in(tmp_path) == sorted([name, out.name, *(f"{out.name}/{path}" for path in all_in(out))])


def test_no_two_frames_have_one_picture(inputs, tmp_path):
    out = tmp_path / "out"
    run_sinew(
        *("render", inputs["FILE"], "--method", "dq", "--size", "64", "--out", out),
        *("--frames", "6,6.5,6.501,6.999,-2.25"),
    )
    assert len(list(out.glob("*.png"))) == 5


@pytest.mark.once
def test_pictures_of_somebody_else_are_not_replaced(inputs, tmp_path):
    picture = tmp_path / "0006.png"
    picture.write_bytes(b"rendered for days")
    command = ("render", inputs["FILE"], "--method", "dq", "--frames", "6", "--size", "64", "--out", tmp_path)
    assert "0006.png" in complaint(run_sinew(*command, status=1).stderr)
    assert picture.read_bytes() == b"rendered for days"
    picture.unlink()
    run_sinew(*command)
    run_sinew(*command)


@pytest.mark.once
def test_scratch_folders_of_killed_runs_go(tmp_path, inputs):
    """Only those of dead runs: those of a live run, of another program and of unknown owners remain."""
    temporary = tmp_path / "tmp"
    temporary.mkdir()
    (temporary / "sinew-of-an-older-version").mkdir()
    (temporary / "other").mkdir()
    program = (
        "from sinew_addon.base.scratch import ScratchFolder\n"
        "folder = ScratchFolder(); (folder.path / 'deep').mkdir(); print(folder.path, flush=True); input()"
    )

    def start() -> tuple[subprocess.Popen, Path]:
        process = subprocess.Popen(
            [os.sys.executable, "-c", program],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, "TMPDIR": str(temporary)},
        )
        return process, Path(process.stdout.readline().strip())

    (killed, left), (alive, kept) = start(), start()
    killed.kill()
    killed.wait()
    assert left.exists()
    third, own = start()
    try:
        assert not left.exists()
        assert (kept / "deep").exists()
        assert own.exists()
        assert (temporary / "sinew-of-an-older-version").exists()
        assert (temporary / "other").exists()
    finally:
        for process in (alive, third):
            process.kill()
            process.communicate()
