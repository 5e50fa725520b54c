# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds out whether another Blender, with its user's preferences, has Sinew."""

import contextlib
import json
import os
import signal
import subprocess
from dataclasses import dataclass

from .core.errors import SinewError

MARK = "SINEW-STATUS "
# Runs in the other Blender, in the background, which may lack this package.
_SCRIPT = f"""
import importlib, json, pathlib, sys, tomllib
import bpy

def manifest_of(name):
    file = getattr(sys.modules.get(name), "__file__", None)
    try:
        path = pathlib.Path(file or "").parent / "blender_manifest.toml"
        return tomllib.loads(path.read_text(encoding="utf-8")) if file else {{}}
    except (OSError, ValueError):
        return {{}}

status = {{"blender": bpy.app.version_string, "sinew": None, "problem": "the extension is not enabled"}}
for name in bpy.context.preferences.addons.keys():
    manifest = manifest_of(name)
    if manifest.get("id") == "sinew":
        status["sinew"], status["problem"] = manifest.get("version"), None
        if not hasattr(bpy.types.Object, "sinew"):
            status["problem"] = importlib.import_module(name + ".native").load_error()
        break
    if name.rpartition(".")[2] == "sinew":
        status["problem"] = "the extension is enabled and does not load"
print("\\n{MARK}" + json.dumps(status), flush=True)
"""


@dataclass(frozen=True)
class BlenderStatus:
    """Whether a Blender has Sinew.

    program  as given
    blender  its version
    sinew    the extension's version, None without the extension
    problem  why the extension cannot be used there, as the end of a sentence, or None
    """

    program: str
    blender: str
    sinew: str | None
    problem: str | None


def blender_status(program: str, limit: float) -> BlenderStatus:
    """Starts `program` in the background and reads its status; ends it after `limit` seconds, 0: never.

    Raises SinewError where it reports none.
    """
    command = [program, "--background", "--python-exit-code", "1", "--python-expr", _SCRIPT]
    try:
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            # A separate session, so that _end() ends everything that it has started, such as a Blender
            # started by a script.
            start_new_session=True,
        )
    except OSError as error:
        raise SinewError(f"--blender {program}: can not be started: {error.strerror or error}") from None
    try:
        output, errors = process.communicate(timeout=limit or None)
    except subprocess.TimeoutExpired:
        raise SinewError(f"--blender {program}: no answer after {limit:g} s") from None
    finally:
        _end(process)
    lines = output.decode("utf-8", errors="replace").splitlines()
    for line in reversed(lines):
        if line.startswith(MARK):
            with contextlib.suppress(ValueError, TypeError):
                return BlenderStatus(program, **json.loads(line.removeprefix(MARK)))
    how = f"status {process.returncode}"
    with contextlib.suppress(ValueError):
        how = signal.Signals(-process.returncode).name
    said = (errors.strip() or output.strip()).decode("utf-8", errors="replace").splitlines()[-1:]
    last_words = f": {said[0].strip()[:200]}" if said else ""
    raise SinewError(
        f"--blender {program}: ended ({how}) without an answer{last_words}; is it a Blender of 4.2 or newer?"
    )


def _end(process: subprocess.Popen) -> None:
    if os.name == "posix":
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, signal.SIGKILL)
    else:
        process.kill()
    process.wait()
