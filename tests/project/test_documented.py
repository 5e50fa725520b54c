# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects the commands of `sinew` in the documents: each exists with its options, and runs as written."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest
from sinew_addon import cli

ROOT = Path(__file__).resolve().parents[2]
DOCUMENTS = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    ROOT / "RELEASING.md",
    ROOT / "SECURITY.md",
    *sorted((ROOT / "docs").glob("*.md")),
]
PROGRAMS = Path(sys.executable).parent


class Command(NamedTuple):
    """words: the command without prompt, preceding pipe and description; whole: with arguments, so that
    it can be run."""

    document: str
    line: str
    words: tuple[str, ...]
    whole: bool


def commands_in(path: Path) -> list[Command]:
    found = []
    # A line that ends with a backslash continues.
    text = re.sub(r" *\\\n *", " ", path.read_text(encoding="utf-8"))
    for line in text.splitlines():
        block = re.match(r" {4,}(?:find .*\| )?(sinew .*)", line)
        if block:
            # A description follows after two spaces.
            text = re.split(r"\s{2,}", block[1])[0]
            found.append(Command(path.name, line.strip(), tuple(shlex.split(text)), whole=True))
            continue
        for text in re.findall(r"`((?:\.venv/bin/)?(?:blender --command )?sinew(?: [^`]+)?)`", line):
            words = text.replace(".venv/bin/", "").replace("blender --command ", "").split()
            if len(words) > 1 and words[1] != "…":
                found.append(Command(path.name, text, tuple(words), whole=False))
    return found


COMMANDS = [command for path in DOCUMENTS for command in commands_in(path)]
WHOLE = [command for command in COMMANDS if command.whole]


def test_every_command_of_sinew_is_one(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    parser, modules = cli.make_parser()
    (subparsers,) = (action.choices for action in parser._actions if action.choices)
    for command in COMMANDS:
        assert command.words[1] in modules, command
        help_of_it = subparsers[command.words[1]].format_help()
        for word in command.words[2:]:
            if word.startswith("--"):
                assert word.partition("=")[0] in help_of_it, command
        if command.whole:
            parser.parse_args(command.words[1:])


def test_every_subcommand_is_documented():
    _parser, modules = cli.make_parser()
    said = {command.words[1] for command in WHOLE if command.document == "command-line.md"}
    assert said == set(modules)


# Tests of Blender run those that need a cluster, another Blender or a character.
RUN_HERE = [
    command for command in WHOLE if not {"--scheduler", "--blender", "human.vrm"} & set(command.words)
]


# An armature with two actions that swing one bone on another, which moves forwards.
LEGS = """
import math, sys
import bpy
bpy.ops.wm.read_homefile(use_empty=True)
data = bpy.data.armatures.new("Legs")
legs = bpy.data.objects.new("Legs", data)
bpy.context.scene.collection.objects.link(legs)
bpy.context.view_layer.objects.active = legs
bpy.ops.object.mode_set(mode="EDIT")
hips, leg = data.edit_bones.new("hips"), data.edit_bones.new("leg")
hips.tail, leg.head, leg.tail, leg.parent = (0, 0, 1), (0, 0, 1), (0, 0, 2), hips
bpy.ops.object.mode_set(mode="POSE")
for name, count in (("walk", 5), ("run", 7)):
    legs.animation_data_clear()
    for frame in range(count):
        legs.pose.bones["hips"].location.x = 0.1 * frame
        legs.pose.bones["hips"].keyframe_insert("location", frame=frame + 1)
        swing = math.radians(15) * math.sin(2 * math.pi * frame / (count - 1))
        legs.pose.bones["leg"].rotation_quaternion = (math.cos(swing), math.sin(swing), 0, 0)
        legs.pose.bones["leg"].keyframe_insert("rotation_quaternion", frame=frame + 1)
    legs.animation_data.action.name = name
    legs.animation_data.action.use_fake_user = True
bpy.ops.object.mode_set(mode="OBJECT")
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[1])
"""


@pytest.fixture(scope="module")
def studio(tmp_path_factory):
    """A folder with the files that the documents mention."""
    pytest.importorskip("bpy", reason="the commands need Blender")
    folder = tmp_path_factory.mktemp("studio")
    rig = ROOT / "blend_files" / "wrist.blend"
    for name in ("human.blend", "characters/hero.blend", "shots/010/shot.blend", "library/other.blend"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(rig, folder / name)
    for name in ("scan.csv", "model.csv"):
        (folder / name).write_text("0,0,0\n1,0,0\n0,2,0\n0,0,3\n", encoding="utf-8")
    for name in ("hand.csv", "camera.csv", "seen.csv"):
        (folder / name).write_text("1,0,0,0,1,2,3\n0.8,0.6,0,0,1,2,4\n0.8,0,0.6,0,2,2,3\n", encoding="utf-8")
    subprocess.run([sys.executable, "-c", LEGS, str(folder / "legs.blend")], check=True)
    batch = (ROOT / "docs" / "batch.md").read_text(encoding="utf-8")
    job = re.search(r"```toml\n(.*?)```", batch, re.DOTALL)[1]
    # The rig has one mesh, which the example's lists of names do not contain.
    (folder / "film.toml").write_text(
        re.sub(r"^include = .*\n", "", job, flags=re.MULTILINE), encoding="utf-8"
    )
    flex = (ROOT / "docs" / "flex.md").read_text(encoding="utf-8")
    (folder / "ours.toml").write_text(re.search(r"```toml\n(.*?)```", flex, re.DOTALL)[1], encoding="utf-8")
    return folder


def run(line: str, folder: Path) -> str:
    """Runs a line as written, with this environment's programs."""
    line = re.split(r"\s{2,}", line)[0].replace("/library", "library")
    done = subprocess.run(
        ["bash", "-c", f"set -o pipefail; {line}"],
        cwd=folder,
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=300,
        check=False,
        env={**os.environ, "PATH": f"{PROGRAMS}{os.pathsep}{os.environ['PATH']}"},
    )
    assert done.returncode == 0, f"{line}\n{done.stdout}{done.stderr}"
    assert "Traceback" not in done.stderr
    return done.stdout


@pytest.mark.slow
@pytest.mark.parametrize(
    "command", RUN_HERE, ids=lambda command: f"{command.document}: {' '.join(command.words)}"
)
def test_it_runs_as_written(command, studio, tmp_path):
    folder = shutil.copytree(studio, tmp_path / "studio")
    if command.words[1] == "restore":
        run("sinew reskin characters/ --method dq --frames none --out reskinned/", folder)
    if "--resume" in command.words:
        run(command.line.replace(" --resume", ""), folder)
    if "--against" in command.words:
        run("sinew render human.blend --method dq --frames 1,16,32 --out golden/", folder)
    before = {path for path in folder.rglob("*") if path.is_file()}
    assert run(command.line, folder)
    written = {path for path in folder.rglob("*") if path.is_file()} - before
    may_write = {"--junit", "--viewer", "--out"} & set(command.words)
    reads_only = command.words[1] in ("methods", "info", "check", "flex") and not may_write
    assert bool(written) != reads_only or "--resume" in command.words
    assert not [path for path in written if "unfinished" in path.name]
