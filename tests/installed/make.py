# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes an environment with both wheels, away from the checkout, and runs test_installed.py in it.

python tests/installed/make.py ENVIRONMENT PYTHON WHEEL bpy==4.5.* [PROGRAM THAT LIMITS A TEST]
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def run(line: str, *others: object, **options: object) -> None:
    subprocess.run([*line.split(), *map(str, others)], check=True, **options)


def main(environment: str, own: str, wheel: str, bpy: str, *limit: str) -> None:
    python = ROOT / environment / "bin/python"
    run("uv venv --quiet --clear", environment, "--python", own)
    with tempfile.TemporaryDirectory() as place:
        # A copy: setuptools writes beside the sources, and would have it in the next wheel.
        unwanted = shutil.ignore_patterns("__pycache__", "build", "*.egg-info")
        sources = shutil.copytree("addon", f"{place}/addon", ignore=unwanted)
        run(
            "uv build --quiet --wheel --require-hashes --build-constraints requirements/wheels.txt --out-dir",
            *(place, sources),
        )
        # Given as files: packages with our names in the registry may not be ours.
        (addon,) = Path(place).glob("*.whl")
        wanted = f"./{wheel}", f"sinew-blender[cluster] @ {addon.as_uri()}", bpy, "pytest"
        run("uv pip install --quiet --python", python, *wanted)
        for name in ("tests/installed/test_installed.py", "blend_files/wrist.blend"):
            shutil.copy(name, place)
        env = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        words = f"{python} -m pytest -p no:cacheprovider -ra test_installed.py".split()
        run(" ".join(limit), *words, cwd=place, env=env)


if __name__ == "__main__":
    main(*sys.argv[1:])
