# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects the hosted workflows: what they call exists, and only the approved job publishes. Their syntax
and their safety are checked by ./dev lint, with check-jsonschema, zizmor and, where it is installed,
actionlint."""

from __future__ import annotations

import re
import shlex
import subprocess
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / ".github" / "workflows"

every_workflow = pytest.mark.parametrize("path", sorted(FOLDER.glob("*.yml")), ids=lambda path: path.stem)


def load(path: Path) -> dict:
    """The parsed workflow; YAML 1.1 reads the key `on` as true."""
    workflow = yaml.safe_load(path.read_text(encoding="utf-8"))
    workflow["on"] = workflow.pop(True)
    return workflow


def scripts_of(workflow: dict) -> list[str]:
    return [
        step["run"] for job in workflow["jobs"].values() for step in job.get("steps", []) if "run" in step
    ]


@every_workflow
def test_commands_and_files_that_it_names_are_there(path):
    workflow = load(path)
    helped = subprocess.run(["bash", ROOT / "dev", "help"], capture_output=True, text=True, check=True).stdout
    commands = set(re.findall(r"^\./dev (\w+)", helped, re.MULTILINE))
    lines = "\n".join(scripts_of(workflow)).splitlines()
    for job in workflow["jobs"].values():
        lines += [job.get("env", {}).get(f"CIBW_TEST_{name}", "") for name in ("COMMAND", "SOURCES")]
    for words in (shlex.split(line, comments=True) for line in lines):
        assert "./dev" not in words or words[words.index("./dev") + 1] in commands, words
        for word in words:
            if re.match(r"(\./)?(tools|tests|docs|\.ci)(/|$)", word):
                assert (ROOT / word).exists(), word
    for job in workflow["jobs"].values():
        if "uses" in job:
            called = load(ROOT / job["uses"])["on"]["workflow_call"] or {}
            assert set(job.get("with", {})) <= set(called.get("inputs", {}))


def test_wheels_are_built_for_the_pythons_of_blender():
    jobs = load(FOLDER / "wheels.yml")["jobs"]
    built = {f"3.{minor}" for minor in re.findall(r"cp3(\d+)-", jobs["wheels"]["env"]["CIBW_BUILD"])}
    listed = (ROOT / "tools/blenders.py").read_text(encoding="utf-8")
    blenders = re.search(r"^BLENDERS = \{(.*)\}$", listed, re.MULTILINE)[1]
    assert built == set(re.findall(r': "([\d.]+)"', blenders))


def test_only_the_approved_job_publishes():
    workflow = load(FOLDER / "release.yml")
    assert workflow["on"] == {"push": {"tags": ["v[0-9]+.[0-9]+.[0-9]+"]}}
    publishing = {
        name: job
        for name, job in workflow["jobs"].items()
        if any("pypi-publish" in step.get("uses", "") for step in job.get("steps", []))
    }
    (job,) = publishing.values()
    assert job["environment"] == "pypi"
    assert job["permissions"] == {"id-token": "write"}
    assert set(job["needs"]) == {"tests", "draft"}
