# SPDX-License-Identifier: GPL-3.0-or-later
"""What the hosted workflows call exists, and they have no more permissions than they need. They are not
run here."""

from __future__ import annotations

import copy
import re
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest
import workflow_rules
import yaml

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / ".github" / "workflows"
WORKFLOWS = sorted(FOLDER.glob("*.yml"))
DEV = (ROOT / "dev").read_text(encoding="utf-8")

every_workflow = pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.stem)


def load(path: Path) -> dict:
    """The parsed workflow; YAML 1.1 reads the key `on` as true."""
    workflow = yaml.safe_load(path.read_text(encoding="utf-8"))
    workflow["on"] = workflow.pop(True)
    return workflow


def steps_of(workflow: dict) -> list[dict]:
    return [step for job in workflow["jobs"].values() for step in job.get("steps", [])]


def lines_of(workflow: dict) -> list[list[str]]:
    """The words of every line that a step runs."""
    return [
        shlex.split(line, comments=True)
        for step in steps_of(workflow)
        for line in step.get("run", "").splitlines()
        if line.strip()
    ]


def dev_commands(lines: list[list[str]]) -> list[list[str]]:
    return [line[line.index("./dev") + 1 :] for line in lines if "./dev" in line]


def unknown_commands(lines: list[list[str]], known: set[str]) -> list[str]:
    return [" ".join(words) for words in dev_commands(lines) if not words or words[0] not in known]


def known_commands() -> set[str]:
    helped = subprocess.run(["bash", ROOT / "dev", "help"], capture_output=True, text=True, check=True).stdout
    return set(re.findall(r"^\./dev (\w+)", helped, re.MULTILINE))


def test_there_are_workflows():
    assert {path.stem for path in WORKFLOWS} >= {"tests", "wheels", "extension", "release", "daily"}
    assert {words[0] for path in WORKFLOWS for words in dev_commands(lines_of(load(path)))} >= {
        "test",
        "release",
    }


@every_workflow
def test_every_command_of_dev_exists(path):
    assert unknown_commands(lines_of(load(path)), known_commands()) == []


def test_an_unknown_command_is_seen():
    steps = {"jobs": {"a": {"steps": [{"run": "mkdir x\n./dev tests --quick"}, {"run": "./dev test"}]}}}
    assert unknown_commands(lines_of(steps), {"test"}) == ["tests --quick"]


@every_workflow
def test_it_is_as_github_reads_it(path):
    assert workflow_rules.faults(load(path)) == []


MATRIX = {"include": [{"os": "macos-15", "archs": "arm64"}, {"os": "windows-2022", "archs": "AMD64"}]}
WORKFLOW = {
    "name": "an example",
    "on": {"push": None, "schedule": [{"cron": "17 4 * * 1"}], "workflow_call": {"inputs": {"fast": {}}}},
    "permissions": {"contents": "read"},
    "jobs": {
        "first": {"runs-on": "ubuntu-24.04", "steps": [{"run": "true"}]},
        "second": {
            "needs": "first",
            "if": "always() && needs.first.result != 'failure'",
            "strategy": {"matrix": MATRIX},
            "runs-on": "${{ matrix.os }}",
            "steps": [
                {"id": "a", "run": "true", "env": {"SYSTEM": "${{ matrix.archs }}"}},
                {"if": "steps.a.outcome == 'success'", "run": "true"},
                {"if": "${{ !cancelled() && inputs.fast }}", "uses": "a/b@c"},
                {"run": "true", "env": {"NAME": "${{ format('{0}-{1}', github.ref, fromJSON('[1]')[0]) }}"}},
            ],
        },
    },
}
SECOND = ("jobs", "second")
FIRST_STEP = (*SECOND, "steps", 0)
# A mistake that is inserted at a position, and a part of the message that must follow.
WRONG = [
    (("job",), {}, "a workflow has no key 'job'"),
    (("on", "pushes"), None, "no event 'pushes'"),
    (("on", "schedule"), [{"cron": "17 24 * * 1"}], "no time of cron"),
    (("on", "schedule"), [{"cron": "17 4 * *"}], "no time of cron"),
    (("permissions", "content"), "read", "no permission content"),
    (("jobs", "first", "permissions"), {"contents": "all"}, "no permission contents: all"),
    (("jobs", "first", "run-on"), "ubuntu-24.04", "no key 'run-on'"),
    (("jobs", "first", "runs-on"), "ubuntu-24", "no runner 'ubuntu-24'"),
    (("jobs", "first", "steps"), [], "'steps' is missing"),
    (("jobs", "first", "needs"), ["second"], "in a circle"),
    (("jobs", "2"), {"runs-on": "ubuntu-24.04", "steps": [{"run": "true"}]}, "no name of a job"),
    ((*SECOND, "needs"), ["frist"], "no job 'frist'"),
    ((*SECOND, "needs"), [], "needs has no 'first'"),
    ((*SECOND, "if"), "matrix.os == 'macos-15'", "no 'matrix'"),
    ((*SECOND, "timeout-minutes"), "${{ steps.a.outcome }}", "no 'steps'"),
    ((*SECOND, "strategy"), {"matrix": {"include": [{"os": "macos-15"}]}}, "matrix has no 'archs'"),
    (
        (*SECOND, "strategy"),
        {"matrix": {"include": [*MATRIX["include"], {"os": "macos-14"}]}},
        "a run of the matrix has no 'archs'",
    ),
    ((*SECOND, "strategy"), {"matrix": {"include": [{"os": "mac", "archs": "x"}]}}, "no runner 'mac'"),
    ((*FIRST_STEP, "uses"), "a/b@c", "either uses an action or runs"),
    ((*FIRST_STEP, "shel"), "bash", "a step has no key 'shel'"),
    ((*FIRST_STEP, "id"), "b", "steps has no 'a'"),
    ((*SECOND, "steps", 1, "id"), "a", "two steps are 'a'"),
    ((*SECOND, "steps", 2, "if"), "${{ inputs.quick }}", "inputs has no 'quick'"),
    ((*FIRST_STEP, "if"), "github.ref = 'x'", "is not understood"),
    ((*FIRST_STEP, "if"), "(github.ref", "')' is missing"),
    ((*FIRST_STEP, "if"), "github.ref ==", "a name is missing"),
    ((*FIRST_STEP, "if"), "github.ref 'x'", "is not expected"),
    ((*FIRST_STEP, "if"), "startWith(github.ref, 'x')", "no startWith"),
    ((*FIRST_STEP, "if"), "startsWith(github.ref)", "no startsWith of 1"),
    ((*FIRST_STEP, "env"), {"A": "${{ secret.A }}"}, "no 'secret'"),
    ((*FIRST_STEP, "env"), {"A": "${{ github.ref }"}, "has no end"),
    ((*FIRST_STEP, "env"), {"A": "${{ success() }}"}, "outside of a condition"),
]


def test_a_workflow_without_faults_has_none():
    assert workflow_rules.faults(WORKFLOW) == []


@pytest.mark.parametrize(("place", "value", "said"), WRONG, ids=[said for _, _, said in WRONG])
def test_a_fault_is_named(place, value, said):
    workflow = copy.deepcopy(WORKFLOW)
    target = workflow
    for key in place[:-1]:
        target = target[key]
    target[place[-1]] = value
    found = workflow_rules.faults(workflow)
    assert any(said in fault for fault in found), found


@pytest.mark.skipif(not shutil.which("shellcheck"), reason="shellcheck is not installed")
@every_workflow
def test_shellcheck_finds_nothing_in_a_step(path):
    for step in steps_of(load(path)):
        if "run" in step:
            words = ["shellcheck", "--shell=bash", "-"]
            done = subprocess.run(words, input=step["run"], capture_output=True, text=True, check=False)
            assert done.returncode == 0, done.stdout


@every_workflow
def test_every_option_of_dev_is_known(path):
    sources = DEV + "".join(tool.read_text(encoding="utf-8") for tool in (ROOT / "tools").glob("*.py"))
    for words in dev_commands(lines_of(load(path))):
        for word in words[1:]:
            assert not word.startswith("--") or f"{word.partition('=')[0]}" in sources, words


@every_workflow
def test_every_file_that_a_step_names_is_there(path):
    workflow = load(path)
    tested = [
        job.get("env", {}).get("CIBW_TEST_COMMAND", "")
        + " "
        + job.get("env", {}).get("CIBW_TEST_SOURCES", "")
        for job in workflow["jobs"].values()
    ]
    for words in [*lines_of(workflow), *map(shlex.split, tested)]:
        for word in words:
            if re.match(r"(\./)?(tools|tests|docs|\.ci)(/|$)", word):
                assert (ROOT / word).exists(), word
    for job in workflow["jobs"].values():
        if "uses" in job:
            assert (ROOT / job["uses"]).is_file()
            called = load(ROOT / job["uses"])["on"]
            assert "workflow_call" in called
            given = set(job.get("with", {}))
            assert given <= set((called["workflow_call"] or {}).get("inputs", {}))


@every_workflow
def test_actions_are_pinned_by_commit_and_named_by_version(path):
    used = [
        line for line in path.read_text(encoding="utf-8").splitlines() if re.match(r"\s*(- )?uses:", line)
    ]
    assert used
    for line in used:
        assert re.search(r"uses: (\./\.github/workflows/[\w-]+\.yml|[\w./-]+@[0-9a-f]{40} # v[\d.]+)$", line)


def test_an_action_has_one_version():
    used = {}
    for path in WORKFLOWS:
        for step in steps_of(load(path)):
            if "uses" in step:
                name, _, commit = step["uses"].partition("@")
                used.setdefault(name, set()).add(commit)
    assert len(used) >= 5
    assert all(len(commits) == 1 for commits in used.values()), used


@every_workflow
def test_it_may_read_and_ends(path):
    """A job that writes declares so itself, and no job runs for hours."""
    workflow = load(path)
    assert workflow["permissions"] == {"contents": "read"}
    for name, job in workflow["jobs"].items():
        assert "uses" in job or 0 < job["timeout-minutes"] <= 180, name
        assert "permissions" not in job or path.stem == "release", name
        for step in job.get("steps", []):
            if step.get("uses", "").startswith("actions/checkout@"):
                assert step["with"]["persist-credentials"] is False


def test_what_is_installed_is_locked():
    installed = [
        words
        for path in WORKFLOWS
        for step in steps_of(load(path))
        if "pip install" in step.get("run", "")
        for words in [shlex.split(step["run"])]
    ]
    # Sinew's own library, and the current Blender, which are not locked.
    others = [words for words in installed if "--require-hashes" not in words]
    assert len(installed) > len(others) == 2
    assert sorted(words[-1] for words in others) == ["./addon", "bpy"]
    for words in installed:
        if words not in others:
            assert (ROOT / words[words.index("--requirement") + 1]).is_file()


@every_workflow
def test_no_step_pastes_what_others_wrote_into_a_shell(path):
    for step in steps_of(load(path)):
        assert "${{" not in step.get("run", "")


def test_what_was_never_run_says_so():
    for path in WORKFLOWS:
        assert "ever run" in path.read_text(encoding="utf-8")


def test_wheels_are_built_for_the_pythons_of_blender():
    jobs = load(FOLDER / "wheels.yml")["jobs"]
    built = {f"3.{minor}" for minor in re.findall(r"cp3(\d+)-", jobs["wheels"]["env"]["CIBW_BUILD"])}
    assert built == set(re.search(r'^bpy_pythons="(.*)"', DEV, re.MULTILINE)[1].split())
    systems = {(m["os"].split("-")[0], m["archs"]) for m in jobs["wheels"]["strategy"]["matrix"]["include"]}
    assert systems == {
        ("ubuntu", "x86_64"),
        ("ubuntu", "aarch64"),
        ("windows", "AMD64"),
        ("macos", "arm64"),
        ("macos", "x86_64"),
    }


def test_the_release_starts_by_the_tag_that_is_named():
    on = load(FOLDER / "release.yml")["on"]
    assert on == {"push": {"tags": ["v[0-9]+.[0-9]+.[0-9]+"]}}
    told = (ROOT / "tools" / "release.py").read_text(encoding="utf-8")
    assert "git push origin main v{version}" in told
    assert ".github/workflows/release.yml" in told


def test_only_who_was_approved_publishes():
    jobs = load(FOLDER / "release.yml")["jobs"]
    publishing = [
        name
        for name, job in jobs.items()
        if any("pypi-publish" in step.get("uses", "") for step in job.get("steps", []))
    ]
    assert publishing == ["publish"]
    job = jobs["publish"]
    assert job["environment"] == "pypi"
    assert job["permissions"] == {"id-token": "write"}
    assert set(job["needs"]) == {"tests", "draft"}
    assert not [step for step in job["steps"] if "password" in step.get("with", {})]


def test_dependabot_looks_after_actions_and_pip():
    updates = yaml.safe_load((ROOT / ".github" / "dependabot.yml").read_text(encoding="utf-8"))["updates"]
    assert {update["package-ecosystem"] for update in updates} == {"github-actions", "pip"}
    folders = {folder for update in updates for folder in update.get("directories", [])}
    with_locks = folders - {"/requirements"}
    assert all((ROOT / folder.strip("/") / "pyproject.toml").is_file() for folder in with_locks)
    assert "/requirements" in folders
