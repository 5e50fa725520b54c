# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes locks anew, as `./dev lock` does: the files that requirements/NAME.in needs, by their hashes, for
all systems."""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
from pathlib import Path

from blenders import BLENDERS

FOLDER = Path(__file__).resolve().parents[1] / "requirements"


def tell_uv_of_the_registry() -> None:
    """Has uv take packages from where pip takes them."""
    names = {"index-url": "UV_DEFAULT_INDEX", "extra-index-url": "UV_INDEX"}
    names |= {"trusted-host": "UV_INSECURE_HOST", "cert": "SSL_CERT_FILE"}
    words = [sys.executable, "-m", "pip", "config", "list"]
    listed = subprocess.run(words, stdout=subprocess.PIPE, text=True, check=True).stdout
    for name, value in re.findall(r"^[\w:]+\.([\w-]+)='(.*)'$", listed, re.MULTILINE):
        words = value.replace("\\n", " ").split()
        if name in names:
            os.environ.setdefault(names[name], " ".join(words))
        if name == "find-links":
            # As pip, without folders that are not here, such as in a whole Blender's system.
            found = [word for word in words if "://" in word or Path(word).exists()]
            os.environ["UV_FIND_LINKS"] = ",".join(found)
    # As pip: the best of all, whichever registry has it.
    os.environ.setdefault("UV_INDEX_STRATEGY", "unsafe-best-match")


def main() -> None:
    parser = argparse.ArgumentParser(prog="./dev lock")
    parser.add_argument("--out", type=Path, default=FOLDER)
    known = sorted(path.stem for path in FOLDER.glob("*.in"))
    parser.add_argument("names", nargs="*", metavar="name", help=", ".join(known))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    tell_uv_of_the_registry()
    for name in options.names or known:
        print(f"dev: {options.out}/{name}.txt", file=sys.stderr, flush=True)
        # For all Pythons from the oldest that takes it. Without addresses of a registry: users may have
        # another one. What bpy's wheels need is in tests.in.
        python = BLENDERS.get(name.removeprefix("bpy-"), "3.11")
        line = f"uv pip compile --quiet --upgrade --universal --python-version {python} --generate-hashes"
        line += " --no-emit-index-url --no-emit-find-links --no-header"
        line += f"{' --no-deps' * name.startswith(('bpy-', 'three', 'babylon'))} --output-file"
        words = [*line.split(), options.out / f"{name}.txt", f"requirements/{name}.in"]
        subprocess.run(words, cwd=FOLDER.parent, check=True)


if __name__ == "__main__":
    main()
