# SPDX-License-Identifier: GPL-3.0-or-later
"""Every test starts in an empty file of a real Blender with Sinew registered."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterable
from pathlib import Path

# Nothing that one test computes is visible to another.
os.environ["SINEW_CACHE"] = "0"

import bpy
import numpy as np
import pytest
import routes
import scenes
import sinew_addon
from sinew_addon.attach import normals
from sinew_addon.deform import characters, precompute_watch, small_meshes
from sinew_addon.skinning.precompute import precomputations

REPOSITORY = Path(__file__).resolve().parents[2]
# Tests of one folder share set-ups with those of another.
sys.path += [str(path) for path in sorted(Path(__file__).parent.rglob("*")) if path.is_dir()]
BLEND_FILES = sorted((REPOSITORY / "blend_files").glob("*.blend"))
REAL_RIGS = ("human.blend", "CesiumMan.glb", "Fox.glb")


# In the first tier, the newest Blender runs all of some cases, and each other one every second of them.
IS_NEWEST = not os.environ.get("SINEW_NOT_NEWEST")


def halved(cases: Iterable) -> list:
    """Cases of which older Blenders leave every second one, each others, to the second tier."""
    left = 2 if IS_NEWEST else 1 - bpy.app.version[1] % 2
    return [
        pytest.param(*(case if isinstance(case, tuple) else (case,)), marks=pytest.mark.slow)
        if number % 2 == left
        else case
        for number, case in enumerate(cases)
    ]


_exit_status = 0


def pytest_sessionfinish(exitstatus):
    global _exit_status
    _exit_status = int(exitstatus)


@pytest.hookimpl(trylast=True)
def pytest_unconfigure():
    # Blender as a module may crash (4.2) or hang (4.5) when it exits, with or without Sinew: after an export
    # of glTF, after test modules were imported alone; on Windows under wine it always does.
    if bpy.app.version < (5, 0) or sys.platform == "win32":
        sys.stdout.flush()
        sys.stderr.flush()
        if sys.platform == "win32":
            # os._exit() also ends each library, which is where it crashes.
            import ctypes

            ctypes.windll.kernel32.TerminateProcess(ctypes.c_void_p(-1), _exit_status)
        os._exit(_exit_status)


def pytest_collection_modifyitems(items):
    left = {
        "outer_versions": "SINEW_BETWEEN",
        "long_term": "SINEW_SHORT_TERM",
        "once": "SINEW_NOT_NEWEST",
    }
    for mark in (mark for mark, variable in left.items() if os.environ.get(variable)):
        skip = pytest.mark.skip(reason=f"left to other versions of Blender: {mark}")
        for item in items:
            if item.get_closest_marker(mark):
                item.add_marker(skip)


@pytest.fixture(scope="session", autouse=True)
def registered():
    sinew_addon.register()
    yield
    # Handlers that are still registered when the process ends crash Blender 4.2 and hang 4.5.
    sinew_addon.unregister()


@pytest.fixture(autouse=True)
def empty_file():
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)


@pytest.fixture(autouse=True)
def nothing_of_commands(monkeypatch):
    """Undoes what a command sets for its process when the test ends, and ends what is computed beside."""
    monkeypatch.setattr(normals, "are_used", normals.are_used)
    yield
    characters.set_parameters({})
    precomputations.cancel_all()
    precomputations.blocks = True
    precomputations.stopped.clear()


@pytest.fixture
def in_window():
    """As in an interactive session: nothing waits."""
    precomputations.blocks = False


def look_until_done() -> None:
    """As the window's timer does while something is computed."""
    for _ in range(300):
        if precompute_watch.check() is None:
            return
        time.sleep(0.01)
    raise AssertionError("it goes on and on")


@pytest.fixture(autouse=True)
def small_meshes_as_users_have_them(request, monkeypatch):
    """Whether Sinew leaves small meshes to their Armature modifiers, as by default. Tests have small meshes,
    which Sinew deforms unless a test says otherwise, as most tests are about that."""
    monkeypatch.setattr(small_meshes, "is_used", getattr(request, "param", False))


def pytest_generate_tests(metafunc):
    is_marked = metafunc.definition.get_closest_marker("by_sinew") is not None
    is_both = metafunc.definition.get_closest_marker("both_ways") is not None
    if is_both and not is_marked and "route" not in metafunc.fixturenames:
        name = "small_meshes_as_users_have_them"
        metafunc.parametrize(name, [False, True], indirect=True, ids=["by Sinew", "as users have it"])


@pytest.fixture(params=routes.ROUTES)
def route(request):
    """Each test that has it runs by both routes."""
    routes.force(request.param)
    yield request.param
    routes.release()


@pytest.fixture(scope="session")
def real_rig():
    """real_rig(name): the path of a rig in SINEW_RIGS; skips the test if it does not exist."""

    def find(name: str) -> Path:
        folder = os.environ.get("SINEW_RIGS")
        if not folder:
            pytest.skip("SINEW_RIGS is not set: real rigs are not tested")
        path = Path(folder) / name
        if not path.exists():
            pytest.skip(f"SINEW_RIGS has no {name}")
        return path

    return find


@pytest.fixture
def arm(tmp_path):
    """A saved arm with UVs and a material: object and file."""
    obj, _armature = scenes.make_arm()
    uv = obj.data.uv_layers.new(name="UVMap")
    spread = np.linspace(0.0, 1.0, 2 * len(uv.data), dtype=np.float32)
    uv.data.foreach_set("uv", spread)
    obj.data.materials.append(bpy.data.materials.new("Skin"))
    return obj, scenes.save(tmp_path / "in" / "arm.blend")


@pytest.fixture
def rendered_points():
    """rendered_points(object): float32 [vertices, 3], what a render receives for it at this frame."""
    with scenes.rendering() as render:
        yield render
