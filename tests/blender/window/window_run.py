# SPDX-License-Identifier: GPL-3.0-or-later
"""Does what artists do in Blender's window with Sinew's zip, step after step. After each step, the visible
shapes are compared with those of an Armature modifier; saved files are recorded for window_read.py.

    blender --factory-startup --enable-event-simulate --python window_run.py -- sinew.zip FOLDER GROUP...

Prints "STEP NAME" before each step and "FAULT NAME | TEXT" for each fault after it.
"""

from __future__ import annotations

import json
import sys
import time
import traceback
from collections.abc import Callable
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
# These modules contain the steps.
import window
import window_editing  # noqa: F401
import window_objects  # noqa: F401
import window_others  # noqa: F401
import window_saving  # noqa: F401
import window_views  # noqa: F401
from window_hand import FOLDER, GROUPS, ZIP, Run, Steps, fresh, make_base, steps_of, wait

TICK = 0.03


def run_all() -> Steps:
    run = Run()
    FOLDER.mkdir(exist_ok=True)
    files = bpy.context.preferences.filepaths
    # quit.blend and autosaves would otherwise be mixed with those of other Blenders.
    files.temporary_directory = str(FOLDER)
    files.auto_save_time = 1
    bpy.context.preferences.system.viewport_aa = "OFF"
    yield from wait()
    if "again" not in GROUPS:
        window.install(ZIP)
        make_base()
    for group in GROUPS:
        started = time.monotonic()
        if group != "again":
            run.step = f"{group}: fresh"
            yield from guarded(run, fresh)
        for function in steps_of[group]:
            run.step = f"{group}: {function.__name__}"
            # Output from here on belongs to this step.
            print(f"STEP {run.step}", flush=True)
            before = run.faults
            yield from guarded(run, function)
            if run.faults > before and group not in ("again", "quit"):
                # A fault must not be counted again.
                yield from guarded(run, fresh, quiet=True)
        print(f"GROUP {group} {time.monotonic() - started:.1f} s", flush=True)
    (FOLDER / f"saved-{GROUPS[-1]}.json").write_text(json.dumps(run.saved))
    print("ENDED", flush=True)


def guarded(run: Run, function: Callable[[Run], Steps], quiet: bool = False) -> Steps:
    try:
        yield from function(run)
        yield from wait()
        if not quiet:
            run.check_shapes("at the end")
    except Exception as error:
        if not quiet:
            run.fault(f"{type(error).__name__}: {error}")
            traceback.print_exc(file=sys.stdout)


window.run(run_all(), TICK)
