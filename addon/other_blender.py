# SPDX-License-Identifier: GPL-3.0-or-later
"""Asks another Blender, as its user has set it up, whether Sinew is there."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
from dataclasses import dataclass

from .core.errors import SinewError

MARK = "SINEW-ANSWER "
# Runs there, where nothing of ours need be: with its own preferences, in the background.
_QUESTION = f"""
import importlib, json, pathlib, sys, tomllib
import bpy

def manifest_of(name):
    file = getattr(sys.modules.get(name), "__file__", None)
    try:
        path = pathlib.Path(file or "").parent / "blender_manifest.toml"
        return tomllib.loads(path.read_text(encoding="utf-8")) if file else {{}}
    except (OSError, ValueError):
        return {{}}

answer = {{"blender": bpy.app.version_string, "sinew": None, "problem": "the extension is not enabled"}}
for name in bpy.context.preferences.addons.keys():
    manifest = manifest_of(name)
    if manifest.get("id") == "sinew":
        answer["sinew"], answer["problem"] = manifest.get("version"), None
        if not hasattr(bpy.types.Object, "sinew"):
            answer["problem"] = importlib.import_module(name + ".native").load_error()
        break
    if name.rpartition(".")[2] == "sinew":
        answer["problem"] = "the extension is enabled and does not load"
print("\\n{MARK}" + json.dumps(answer), flush=True)
"""


@dataclass(frozen=True)
class Answer:
    """blender: its version; sinew: that of the extension, None where there is none; problem: why it is of no
    use there, as the end of a sentence, or None."""

    program: str
    blender: str
    sinew: str | None
    problem: str | None


def ask(program: str, limit: float) -> Answer:
    """Starts `program` in the background and asks it; ends it after `limit` seconds, 0: never.

    Raises SinewError where it does not answer.
    """
    command = [program, "--background", "--python-exit-code", "1", "--python-expr", _QUESTION]
    try:
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            # Its own, to end it with all that it has started, as a script that starts Blender does.
            start_new_session=True,
        )
    except OSError as error:
        raise SinewError(f"--blender {program}: can not be started: {error.strerror or error}") from None
    try:
        said, _nothing = process.communicate(timeout=limit or None)
    except subprocess.TimeoutExpired:
        raise SinewError(f"--blender {program}: no answer after {limit:g} s") from None
    finally:
        _end(process)
    lines = said.decode("utf-8", errors="replace").splitlines()
    for line in reversed(lines):
        if line.startswith(MARK):
            with contextlib.suppress(ValueError, TypeError):
                return Answer(program, **json.loads(line.removeprefix(MARK)))
    how = f"status {process.returncode}"
    with contextlib.suppress(ValueError):
        how = signal.Signals(-process.returncode).name
    raise SinewError(
        f"--blender {program}: ended ({how}) without an answer; is it a Blender of 4.2 or newer?"
    )


def _end(process: subprocess.Popen) -> None:
    if os.name == "posix":
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, signal.SIGKILL)
    else:
        process.kill()
    process.wait()
