# SPDX-License-Identifier: GPL-3.0-or-later
"""In the window of one Blender, with Sinew's zip: the steps of features, one after another. Prints "FACTS" and a
line of JSON with what each has found.

    blender --factory-startup --enable-event-simulate --python features_in_window.py -- sinew.zip FOLDER
"""  # noqa: E501

from __future__ import annotations

import importlib
import json
import sys
from collections.abc import Iterator
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
import window

ZIP, FOLDER = window.arguments()
RIG = FOLDER / "human.blend"
# The last one is at work when Blender ends.
PARTS = ("language", "lesson", "export", "page", "sheet", *(["blend"] if RIG.exists() else []), "precompute")
TICK = 0.1


def steps() -> Iterator[None]:
    window.install(ZIP)
    facts = {}
    for part in PARTS:
        bpy.ops.wm.read_homefile(use_factory_startup=True)
        yield from window.wait()
        print(f"PART {part}", flush=True)
        facts[part] = yield from importlib.import_module(f"{part}_in_window").steps()
    print("FACTS " + json.dumps(facts), flush=True)


window.run(steps(), TICK)
