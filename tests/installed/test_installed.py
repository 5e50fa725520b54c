# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects what README says of an installation, in an environment that has the two wheels and nothing of a
checkout.

`./dev test` makes that environment, copies this file and a rig to a folder elsewhere, and runs it in that.
"""

from __future__ import annotations

import importlib.util
import json
import pkgutil
import subprocess
import sys
import time
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
RIG = HERE / "wrist.blend"
PROGRAMS = Path(sys.executable).parent


def run(*arguments: object, status: int = 0) -> subprocess.CompletedProcess:
    result = subprocess.run(
        [str(argument) for argument in arguments],
        capture_output=True,
        text=True,
        encoding="utf-8",
        cwd=HERE,
        timeout=120,
        check=False,
    )
    assert result.returncode == status, result.stdout + result.stderr
    assert "Traceback" not in result.stderr, result.stderr
    return result


def sinew(*arguments: object, status: int = 0) -> subprocess.CompletedProcess:
    return run(PROGRAMS / "sinew", *arguments, status=status)


def test_every_module_is_there_and_imports():
    """In one process of its own, with Blender in it."""
    program = """
import importlib, pathlib, pkgutil, sys
import bpy, sinew, sinew_addon
for package in (sinew, sinew_addon):
    place = pathlib.Path(package.__file__).resolve()
    assert pathlib.Path(sys.prefix).resolve() in place.parents, place
names = [found.name for found in pkgutil.walk_packages(sinew_addon.__path__, "sinew_addon.")]
for name in names:
    importlib.import_module(name)
print(len(names), flush=True)
import os
os._exit(0)  # Blender as a module can crash in its own ending
"""
    assert int(run(sys.executable, "-c", program).stdout.split()[-1]) > 100


def test_nothing_of_a_checkout_is_in_reach():
    assert not any((Path(folder) / "blender_manifest.toml").exists() for folder in sys.path)
    assert not any((folder / ".git").exists() for folder in (HERE, *HERE.parents))
    assert not list(Path(sys.prefix).rglob("__editable__*"))
    commands = Path(importlib.util.find_spec("sinew_addon").origin).parent / "commands"
    assert "reskin" in [found.name for found in pkgutil.iter_modules([str(commands)])]


def test_methods():
    rows = json.loads(sinew("methods", "--json").stdout)
    assert {"lbs", "qv", "dq"} <= {row["name"] for row in rows["methods"]}


def test_info():
    (report,) = json.loads(sinew("info", RIG, "--json").stdout)
    assert report["meshes"]


def test_check():
    assert "wrist.blend" in sinew("check", RIG).stdout


def test_points():
    out = HERE / "points" / "wrist.npz"
    for method in ("dq", "blender"):
        sinew("points", RIG, "--method", method, "--frames", "1,24", "--out", out)
        with np.load(out) as arrays:
            names = [name for name in arrays.files if name != "frames"]
            assert names
            assert all(np.ptp(arrays[name], axis=0).any() for name in names)


def test_compare():
    sinew("compare", RIG, "--methods", "lbs,dq", "--frames", "1,24", "--pictures", "1", "--size", "64",
          "--out", HERE / "pages")  # fmt: skip
    assert "<svg" in (HERE / "pages" / "wrist.html").read_text(encoding="utf-8")


def test_reskin_by_this_machine():
    sinew("reskin", RIG, "--method", "dq", "--frames", "none", "--out", HERE / "here")
    assert "dq" in sinew("check", HERE / "here" / "wrist.blend").stdout


def test_reskin_by_a_dask_worker():
    with cluster() as address:
        sinew("reskin", RIG, "--method", "dq", "--frames", "24", "--no-pictures", "--scheduler", address,
              "--out", HERE / "by-dask")  # fmt: skip
    assert (HERE / "by-dask" / "wrist.blend").exists()


@contextmanager
def cluster():
    """A scheduler and a worker, as docs/batch.md starts them."""
    file = HERE / "scheduler.json"
    options = ("--scheduler-file", file, "--no-dashboard", "--host", "127.0.0.1")
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": HERE}
    started = [
        subprocess.Popen([str(part) for part in (PROGRAMS / "dask", *arguments)], **quiet)
        for arguments in (
            ("scheduler", *options, "--port", "0"),
            ("worker", *options, "--nthreads", "1", "--local-directory", HERE),
        )
    ]
    try:
        address, end = None, time.monotonic() + 60
        while address is None and time.monotonic() < end:
            time.sleep(0.1)
            with suppress(OSError, ValueError):
                address = json.loads(file.read_text())["address"]
        yield address
    finally:
        for process in reversed(started):
            process.terminate()
        for process in started:
            process.wait(timeout=30)
