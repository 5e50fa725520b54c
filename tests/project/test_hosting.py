# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects what hosted machines run and install: workflows, whose commands exist and of which only the
approved job publishes, and locks by hashes, with all that is required. ./dev lint checks the syntax and the
safety of workflows, with check-jsonschema, zizmor and, where it is installed, actionlint."""

from __future__ import annotations

import re
import shlex
import subprocess
import tomllib
from pathlib import Path

import pytest
import yaml
from blenders import BLENDERS
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[2]
WORKFLOWS = ROOT / ".github" / "workflows"

every_workflow = pytest.mark.parametrize("path", sorted(WORKFLOWS.glob("*.yml")), ids=lambda path: path.stem)


def load(path: Path) -> dict:
    """The parsed workflow; YAML 1.1 reads the key `on` as true."""
    workflow = yaml.safe_load(path.read_text(encoding="utf-8"))
    workflow["on"] = workflow.pop(True)
    return workflow


@every_workflow
def test_commands_and_files_that_it_names_are_there(path):
    workflow = load(path)
    helped = subprocess.run(["bash", ROOT / "dev", "help"], capture_output=True, text=True, check=True).stdout
    commands = set(re.findall(r"^\./dev (\w+)", helped, re.MULTILINE))
    lines = []
    for job in workflow["jobs"].values():
        lines += [line for step in job.get("steps", []) for line in step.get("run", "").splitlines()]
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
    jobs = load(WORKFLOWS / "wheels.yml")["jobs"]
    built = {f"3.{minor}" for minor in re.findall(r"cp3(\d+)-", jobs["wheels"]["env"]["CIBW_BUILD"])}
    assert built == set(BLENDERS.values())


def test_only_the_approved_job_publishes():
    workflow = load(WORKFLOWS / "release.yml")
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


FOLDER = ROOT / "requirements"
LOCKS = sorted(path.stem for path in FOLDER.glob("*.in"))

PINNED = re.compile(
    r"(?P<name>[\w.-]+)==(?P<version>[\w.]+)(?: ; (?P<marker>[^\\]+?))? \\\n"
    r"(?P<hashes>(?:    --hash=sha256:[0-9a-f]{64}(?: \\)?\n)+)(?:    #.*\n)*"
)


def wanted(name: str) -> list[str]:
    """The requirements of NAME.in and of what it includes."""
    found = []
    for line in (FOLDER / f"{name}.in").read_text(encoding="utf-8").splitlines():
        if line.startswith("-r "):
            found += wanted(line.removeprefix("-r ").removesuffix(".in"))
        elif line and not line.startswith("#"):
            found.append(line)
    return found


def locked(text: str) -> dict[str, list[str]]:
    """Versions by name; several if they differ by a marker. Anything else in the text is an error."""
    found: dict[str, list[str]] = {}
    end = 0
    for match in PINNED.finditer(text):
        assert match.start() == end, text[end : match.start()]
        end = match.end()
        found.setdefault(canonicalize_name(match["name"]), []).append(match["version"])
    assert end == len(text), text[end : end + 200]
    return found


@pytest.mark.parametrize("name", LOCKS)
def test_a_lock_has_hashes_and_what_is_wanted(name):
    text = (FOLDER / f"{name}.txt").read_text(encoding="utf-8")
    assert "://" not in text
    assert "--index-url" not in text
    versions = locked(text)
    for requirement in map(Requirement, wanted(name)):
        found = versions[canonicalize_name(requirement.name)]
        assert all(requirement.specifier.contains(version) for version in found), requirement


def test_every_blender_and_every_installation_has_a_lock():
    assert {path.stem for path in FOLDER.glob("*.txt")} == set(LOCKS)
    assert {f"bpy-{version}" for version in BLENDERS} <= set(LOCKS)
    # Without an option, uv checks the hashes that a file has; pip wants one of each.
    assert "--require-hashes" in (ROOT / "dev").read_text(encoding="utf-8")
    assert "--no-verify-hashes" not in (ROOT / "noxfile.py").read_text(encoding="utf-8")


def test_ranges_of_users_are_those_that_are_locked():
    def listed(file: str, table: str, key: str) -> set[str]:
        names = tomllib.loads((ROOT / file).read_text(encoding="utf-8"))[table][key]
        return {name for name in names if not name.startswith(("bpy", "sinew-skinning"))}

    addon = listed("addon/pyproject.toml", "project", "dependencies")
    addon |= listed("addon/pyproject.toml", "build-system", "requires")
    assert addon <= set(wanted("tests"))
    assert listed("pyproject.toml", "build-system", "requires") == set(wanted("build"))
