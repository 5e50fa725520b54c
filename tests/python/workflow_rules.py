# SPDX-License-Identifier: GPL-3.0-or-later
"""GitHub's rules for workflows, as far as Sinew uses them: keys, needs, matrices, expressions, and what
these may refer to in each position. A part of what actionlint checks, which the Python registry does not
have."""

from __future__ import annotations

import re
from collections.abc import Iterator

# Keys of a workflow, of its jobs, of jobs that call another workflow, and of steps.
WORKFLOW = {"name", "run-name", "on", "permissions", "env", "defaults", "concurrency", "jobs"}
CALL = {"name", "needs", "if", "permissions", "uses", "with", "secrets", "strategy", "concurrency"}
JOB = CALL - {"uses", "with", "secrets"} | {
    *("runs-on", "environment", "outputs", "env", "defaults", "steps", "timeout-minutes"),
    *("continue-on-error", "container", "services"),
}
STEP = {
    *("id", "if", "name", "uses", "run", "working-directory", "shell", "with", "env"),
    *("continue-on-error", "timeout-minutes"),
}
EVENTS = {"push", "pull_request", "schedule", "workflow_call", "workflow_dispatch"}
RUNNERS = {
    *("ubuntu-24.04", "ubuntu-24.04-arm", "ubuntu-22.04", "windows-2022", "windows-2025"),
    *("macos-14", "macos-15", "macos-15-intel"),
}
PERMISSIONS = {
    *("actions", "attestations", "checks", "contents", "deployments", "id-token", "issues", "packages"),
    *("pages", "pull-requests", "security-events", "statuses"),
}

# The contexts that an expression may use, by its position.
ALWAYS = {"github", "inputs", "vars"}
OF_JOB = ALWAYS | {"needs"}
OF_RUN = OF_JOB | {"strategy", "matrix"}
OF_STEP = OF_RUN | {"job", "runner", "env", "secrets", "steps"}
CONTEXTS = {"if": OF_JOB, "strategy": OF_JOB, "env": OF_RUN | {"secrets"}, "secrets": OF_RUN | {"secrets"}}
STATUS = {"always", "cancelled", "failure", "success"}
# Name -> minimum and maximum number of arguments.
FUNCTIONS = {
    **dict.fromkeys(("contains", "startsWith", "endsWith"), (2, 2)),
    **dict.fromkeys(("toJSON", "fromJSON"), (1, 1)),
    **dict.fromkeys(("format", "hashFiles"), (1, 99)),
    **dict.fromkeys(STATUS, (0, 0)),
    "join": (1, 2),
}
TOKEN = re.compile(
    r"\s*(?:(?P<text>'(?:[^']|'')*')|(?P<number>-?\d[\w.]*)|(?P<name>[A-Za-z_][\w-]*)"
    r"|(?P<sign>&&|\|\||[=!<>]=|[!<>.,*()\[\]]))"
)


class Expression:
    """An expression between ${{ and }}, parsed like GitHub does; `paths` and `called` list what it refers
    to and calls."""

    def __init__(self, text: str) -> None:
        self.paths: list[tuple[str, ...]] = []
        self.called: list[str] = []
        self._tokens: list[tuple[str, str]] = []
        at, text = 0, text.rstrip()
        while at < len(text):
            match = TOKEN.match(text, at)
            if not match:
                raise ValueError(f"{text[at:]!r} is not understood")
            self._tokens.append((match.lastgroup or "", match[match.lastgroup or 0]))
            at = match.end()
        self._operation()
        if self._tokens:
            raise ValueError(f"{self._tokens[0][1]!r} is not expected")

    def _next(self, *signs: str) -> str:
        """Consumes a token if it is one of these."""
        if self._tokens and self._tokens[0][0] == "sign" and self._tokens[0][1] in signs:
            return self._tokens.pop(0)[1]
        return ""

    def _expect(self, sign: str) -> None:
        if not self._next(sign):
            raise ValueError(f"{sign!r} is missing")

    def _take(self, what: str) -> str:
        if not self._tokens or self._tokens[0][0] != what:
            raise ValueError(f"a {what} is missing")
        return self._tokens.pop(0)[1]

    def _operation(self) -> None:
        self._operand()
        while self._next("&&", "||", "==", "!=", "<", ">", "<=", ">="):
            self._operand()

    def _operand(self) -> None:
        while self._next("!"):
            pass
        if self._next("("):
            self._operation()
            self._expect(")")
        elif self._tokens and self._tokens[0][0] in ("text", "number"):
            self._tokens.pop(0)
        else:
            self._named(self._take("name"))

    def _named(self, name: str) -> None:
        if name in ("true", "false", "null"):
            return
        if self._next("("):
            count = 0
            while not self._next(")"):
                if count:
                    self._expect(",")
                self._operation()
                count += 1
            fewest, most = FUNCTIONS.get(name, (0, -1))
            if not fewest <= count <= most:
                raise ValueError(f"there is no {name} of {count} arguments")
            self.called.append(name)
            self._rest()
        else:
            self.paths.append((name, *self._rest()))

    def _rest(self) -> list[str]:
        """Parses what follows a name or a call: .key, .* or [index], which counts as *."""
        path = []
        while sign := self._next(".", "["):
            if sign == ".":
                path.append(self._next("*") or self._take("name"))
            else:
                self._operation()
                self._expect("]")
                path.append("*")
        return path


def texts(value: object) -> Iterator[str]:
    if isinstance(value, dict):
        for part in value.values():
            yield from texts(part)
    elif isinstance(value, list):
        for part in value:
            yield from texts(part)
    elif isinstance(value, str):
        yield value


def faults_in_expressions(
    value: object, contexts: set[str], known: dict[str, set[str]], is_condition: bool = False
) -> Iterator[str]:
    """known: for some contexts, the keys that they have"""
    for text in texts(value):
        found = re.findall(r"\$\{\{(.*?)\}\}", text, re.DOTALL)
        if text.count("${{") != len(found):
            yield f"{text!r} has no end"
        for written in found or ([text] if is_condition else []):
            try:
                expression = Expression(written)
            except ValueError as error:
                yield f"{written.strip()!r}: {error}"
                continue
            for path in expression.paths:
                if path[0] not in contexts:
                    yield f"there is no {path[0]!r} in {written.strip()!r}"
                elif path[0] in known and len(path) > 1 and path[1] not in known[path[0]] | {"*"}:
                    yield f"{path[0]} has no {path[1]!r}"
            if not is_condition and STATUS & set(expression.called):
                yield f"{written.strip()!r} asks for the status outside of a condition"


def matrix_keys(job: dict) -> Iterator[str | set[str]]:
    """What every run has; and, as text, what some have only."""
    matrix = job.get("strategy", {}).get("matrix", {})
    axes = set(matrix) - {"include", "exclude"}
    rows = [set(row) | axes for row in matrix.get("include", [])] or [axes]
    for missing in sorted(set.union(*rows) - set.intersection(*rows)):
        yield f"a run of the matrix has no {missing!r}"
    yield set.intersection(*rows)


def as_list(value: object) -> list:
    return value if isinstance(value, list) else [] if value is None else [value]


def faults_in_job(name: str, job: dict, jobs: dict, known: dict[str, set[str]]) -> Iterator[str]:
    allowed = CALL if "uses" in job else JOB
    yield from (f"a job has no key {key!r}" for key in sorted(set(job) - allowed))
    if "uses" not in job:
        yield from (f"{key!r} is missing" for key in ("runs-on", "steps") if not job.get(key))
    needs = as_list(job.get("needs"))
    yield from (f"there is no job {other!r} to need" for other in needs if other not in jobs)
    keys: set[str] = set()
    for found in matrix_keys(job):
        if isinstance(found, str):
            yield found
        else:
            keys = found
    known = known | {"needs": set(needs), "matrix": keys}
    for key, value in job.items():
        if key != "steps":
            contexts = CONTEXTS.get(key, OF_RUN)
            yield from faults_in_expressions(value, contexts, known, is_condition=key == "if")
    labels = as_list(job.get("runs-on"))
    if labels == ["${{ matrix.os }}"]:
        labels = [row.get("os") for row in job["strategy"]["matrix"]["include"]]
    yield from (f"there is no runner {label!r}" for label in labels if label not in RUNNERS)
    steps: set[str] = set()
    for step in job.get("steps", []):
        yield from (f"a step has no key {key!r}" for key in sorted(set(step) - STEP))
        if ("uses" in step) == ("run" in step):
            yield "a step either uses an action or runs something"
        for key, value in step.items():
            yield from faults_in_expressions(
                value, OF_STEP, known | {"steps": steps}, is_condition=key == "if"
            )
        if "id" in step:
            if step["id"] in steps:
                yield f"two steps are {step['id']!r}"
            steps = steps | {step["id"]}


def needs_go_in_a_circle(jobs: dict) -> bool:
    left = {name: set(as_list(job.get("needs"))) & set(jobs) for name, job in jobs.items()}
    while ready := {name for name, needs in left.items() if not needs & set(left)}:
        left = {name: needs for name, needs in left.items() if name not in ready}
    return bool(left)


def faults_in_events(on: dict) -> Iterator[str]:
    yield from (f"there is no event {event!r}" for event in sorted(set(on) - EVENTS))
    for entry in on.get("schedule") or []:
        fields = entry["cron"].split()
        limits = [(0, 59), (0, 23), (1, 31), (1, 12), (0, 6)]
        numbers = [(re.findall(r"\d+", field), limit) for field, limit in zip(fields, limits, strict=False)]
        if len(fields) != 5 or any(
            not low <= int(number) <= high for found, (low, high) in numbers for number in found
        ):
            yield f"{entry['cron']!r} is no time of cron"


def faults(workflow: dict) -> list[str]:
    """The mistakes in a workflow, each as a sentence. workflow: as parsed, with `on` by its name"""
    on, jobs = workflow["on"], workflow["jobs"]
    inputs: set[str] = set()
    for event in ("workflow_call", "workflow_dispatch"):
        inputs |= set((on.get(event) or {}).get("inputs") or {})
    known = {"inputs": inputs}
    found = [f"a workflow has no key {key!r}" for key in sorted(set(workflow) - WORKFLOW)]
    found += faults_in_events(on)
    outside = {key: value for key, value in workflow.items() if key not in ("on", "jobs")}
    found += faults_in_expressions(outside, ALWAYS | ({"secrets"} if "env" in outside else set()), known)
    if needs_go_in_a_circle(jobs):
        found.append("jobs need each other in a circle")
    for name, job in jobs.items():
        if not re.fullmatch(r"[A-Za-z_][\w-]*", name):
            found.append(f"{name!r} is no name of a job")
        found += [f"{name}: {fault}" for fault in faults_in_job(name, job, jobs, known)]
    for part in (workflow, *jobs.values()):
        for key, value in part.get("permissions", {}).items():
            if key not in PERMISSIONS or value not in ("read", "write", "none"):
                found.append(f"there is no permission {key}: {value}")
    return found
