# SPDX-License-Identifier: GPL-3.0-or-later
"""Flamenco: the job type compiled by node in a Manager of our own, its commands run on real files."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import bpy
import pytest
from program import COMMAND, ENVIRONMENT, ran
from sinew_addon.attach import properties
from sinew_addon.io import files
from test_batch import make_rig

pytestmark = [
    pytest.mark.skipif(
        shutil.which("node") is None, reason="node is not installed here, which compiles the job type"
    ),
    pytest.mark.outer_versions,
]

ROOT = Path(__file__).resolve().parents[3]
SCRIPT = ROOT / "addon" / "jobs" / "sinew_reskin.js"
MANAGER = Path(__file__).with_name("flamenco_manager.js")


def compile_job(**settings: object) -> dict:
    done = ran("node", MANAGER, SCRIPT, input=json.dumps({"settings": settings}))
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def job_type() -> dict:
    return compile_job(action="check", folder="/jobs", files="a.blend")["type"]


def files_of(job_type: dict, folder: Path) -> str:
    """The setting `files`, evaluated as Flamenco's add-on for Blender does: names are local variables."""

    class Settings:
        pass

    settings = Settings()
    settings.folder = str(folder)
    (setting,) = (setting for setting in job_type["settings"] if setting["key"] == "files")
    return eval(setting["eval"], {}, {"settings": settings, "abspath": lambda path: Path(path).absolute()})


def run_task(task: dict, variables: dict[str, list[str]]) -> subprocess.CompletedProcess:
    """Acts like a worker of Flamenco: runs one command after the other, and none after a failure. A
    variable may stand for several words here."""
    done = None
    for command in task["commands"]:
        assert command["name"] == "exec"
        parameters = command["parameters"]
        words: list[str] = []
        for word in (parameters["exe"], *parameters["args"]):
            words += variables.get(word, [word])
        done = ran(*words, env=ENVIRONMENT)
        if done.returncode:
            break
    assert done is not None
    return done


def method_in(path: Path) -> str:
    files.open_file(path)
    (method,) = {properties.of(obj).method for obj in bpy.data.objects if properties.has_sinew(obj)}
    return method


@pytest.fixture
def two_files(tmp_path):
    """In two folders, with the same, difficult name."""
    folder = tmp_path / "jobs"
    make_rig(folder / "hero [1].blend")
    make_rig(folder / "shots" / "hero [1].blend")
    return folder


def test_tasks_have_names_and_wait_for_their_checks():
    names = [f"shots/{number}.blend" for number in range(5)]
    job = {"action": "re-skin", "folder": "/jobs/", "method": "qv", "out": "/copies", "chunk_size": 2}
    tasks = compile_job(**job, files="\n".join(["hero.blend", *names]), options="--set 'mix=dq'")["tasks"]
    assert [task["name"] for task in tasks] == [
        f"{action} {part}"
        for part in ("part-001", "shots/part-001", "shots/part-002", "shots/part-003")
        for action in ("check", "re-skin")
    ]
    assert {task["type"] for task in tasks} == {"blender"}
    for check, reskin in zip(tasks[::2], tasks[1::2], strict=True):
        assert (check["dependencies"], reskin["dependencies"]) == ([], [check["name"]])
    third = tasks[3]
    sources, out = ["/jobs/shots/0.blend", "/jobs/shots/1.blend"], "/copies/shots/part-001"
    assert [command["parameters"] for command in third["commands"]] == [
        {
            "exe": "{blender}",
            "args": [
                *("--command", "sinew", "reskin", *sources, "--method", "qv"),
                *("--out", out, "--resume", "--set", "mix=dq"),
            ],
        },
        {"exe": "{blender}", "args": ["--command", "sinew", "check", out]},
    ]
    # Every file in exactly one task of each kind.
    for kind in ("check", "reskin"):
        words = [
            word
            for task in tasks
            for command in task["commands"][:1]
            if command["parameters"]["args"][2] == kind
            for word in command["parameters"]["args"]
            if word.endswith(".blend")
        ]
        assert words == [f"/jobs/{name}" for name in ("hero.blend", *names)]


def test_a_job_bends_every_joint(two_files):
    job = {"action": "flex", "folder": str(two_files), "files": files_of(job_type(), two_files)}
    tasks = compile_job(**job, options="--poses 'hard [1].toml'", program="package")["tasks"]
    assert [(task["name"], task["dependencies"]) for task in tasks] == [
        ("flex part-001", []),
        ("flex shots/part-001", []),
    ]
    assert tasks[0]["commands"][0]["parameters"]["args"][2:] == ["--poses", "hard [1].toml"]
    (first, _second) = compile_job(**job, program="package")["tasks"]
    done = run_task(first, {"{sinew}": COMMAND})
    assert "2 of 2 joints pass" in done.stdout, done.stdout + done.stderr
    assert done.returncode == 0


def test_what_is_wrong_is_said():
    job = {"action": "re-skin", "folder": "S:\\jobs", "files": "a.blend", "program": "package"}
    assert compile_job(**job)["error"] == "There is no folder for the copies: set Folder of Copies."
    assert "within the folder of the files" in compile_job(**job, out="S:/jobs/copies/")["error"]
    (_check, reskin) = compile_job(**job, out="S:\\jobs-copies")["tasks"]
    assert reskin["commands"][0]["parameters"]["exe"] == "{sinew}"
    assert reskin["commands"][0]["parameters"]["args"][:2] == ["reskin", "S:\\jobs\\a.blend"]
    assert (
        compile_job(action="check", folder="/jobs", files="")["error"]
        == "There is no .blend file below /jobs."
    )


def test_the_job_type_offers_what_there_is():
    settings = {setting["key"]: setting for setting in job_type()["settings"]}
    assert all(
        setting["default"] in setting["choices"] for setting in settings.values() if "choices" in setting
    )
    # Keys of the schema AvailableJobSetting in Flamenco's API.
    known = {"key", "label", "type", "subtype", "choices", "propargs", "description", "default", "eval"}
    assert set().union(*settings.values()) <= known | {"visible", "required"}
    # A visible setting has a sentence; the manual names each of them.
    manual = (ROOT / "docs" / "flamenco.md").read_text(encoding="utf-8")
    for key, setting in settings.items():
        assert setting["description"]
        assert f"`{key}`" in manual, key


@pytest.mark.slow
def test_two_files_are_checked_and_reskinned(two_files, tmp_path):
    listed = files_of(job_type(), two_files)
    assert listed.splitlines() == ["hero [1].blend", "shots/hero [1].blend"]
    job = {"folder": str(two_files), "files": listed, "out": str(tmp_path / "copies"), "program": "package"}
    tasks = compile_job(**job, method="qv", options="--no-pictures --frames none")["tasks"]
    # A worker's Blender without the extension does not know its command.
    variables = {"{sinew}": COMMAND, "{blender}": ["false"]}
    before = {path: path.read_bytes() for path in two_files.rglob("*.blend")}
    for task in tasks:
        done = run_task(task, variables)
        if task["name"].startswith("check"):
            assert done.returncode == 0, done.stderr
            assert "ok: does not need Sinew" in done.stdout
        else:
            assert done.returncode == 1, done.stderr
    copies = sorted((tmp_path / "copies").rglob("*.blend"))
    assert [path.relative_to(tmp_path / "copies").as_posix() for path in copies] == [
        "part-001/hero [1].blend",
        "shots/part-001/hero [1].blend",
    ]
    assert {method_in(path) for path in copies} == {"qv"}
    assert {path: path.read_bytes() for path in two_files.rglob("*.blend")} == before
    # With the extension, a retry only does the check: the copies are unchanged.
    variables |= {"--command": [], "sinew": [], "{blender}": COMMAND}
    written = {path: path.stat().st_mtime_ns for path in copies}
    for task in tasks[1::2]:
        done = run_task(task, variables)
        assert done.returncode == 0, done.stdout + done.stderr
        assert "ok: Sinew deforms 1 mesh by qv" in done.stdout
    assert {path: path.stat().st_mtime_ns for path in copies} == written


@pytest.mark.slow
def test_a_file_with_a_problem_is_not_reskinned(two_files, tmp_path):
    (two_files / "hero [1].blend").write_bytes(b"BLENDER and then nothing")
    job = {"folder": str(two_files), "files": files_of(job_type(), two_files), "program": "package"}
    tasks = compile_job(**job, out=str(tmp_path / "copies"))["tasks"]
    checks = [task for task in tasks if not task["dependencies"]]
    passed = [task["name"] for task in checks if run_task(task, {"{sinew}": COMMAND}).returncode == 0]
    assert passed == ["check shots/part-001"]
    assert [task["name"] for task in tasks if task["dependencies"] == ["check part-001"]] == [
        "re-skin part-001"
    ]
