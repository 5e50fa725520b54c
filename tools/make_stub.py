# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes what is made from the library that is installed: the stub of sinew._native, which editors and type
checkers read, and the lists of methods and stages in files that can not read them.

python tools/make_stub.py [--out FOLDER]    FOLDER: the stub alone, into it
"""

from __future__ import annotations

import argparse
import ast
import json
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import sinew

ROOT = Path(__file__).resolve().parents[1]
STUB = ROOT / "native" / "python" / "sinew" / "_native"


def docstring(found: re.Match[str]) -> str:
    """Written as in all modules here: text follows the quotes, and a single line ends with them."""
    text, end = found.groups()
    return '"""' + text + (end if "\n" in text else "") + '"""'


def write_stub(folder: Path) -> None:
    with tempfile.TemporaryDirectory() as made:
        tool = [sys.executable, "-m", "pybind11_stubgen"]
        subprocess.run([*tool, "--exit-code", "--output-dir", made, "sinew._native"], check=True)
        for path in Path(made).rglob("*.pyi"):
            text = path.read_text(encoding="utf-8")
            # The versions of Sinew and of what is compiled in are no types.
            text = re.sub(r"^(__\w+__: str) = .*$", r"\1", text, flags=re.MULTILINE)
            text = re.sub(r"[ \t]+$", "", text, flags=re.MULTILINE)
            text = re.sub(r":\n +\.\.\.$", ": ...", text, flags=re.MULTILINE)
            path.write_text(
                re.sub(r'"""\n *(.*?)(\n *)"""', docstring, text, flags=re.DOTALL), encoding="utf-8"
            )
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(Path(made, "sinew", "_native"), folder)


def used_names() -> set[str]:
    """What the extension uses of the library."""
    used = set()
    for path in (ROOT / "addon").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module == "sinew" and not node.level:
                used |= {alias.name for alias in node.names}
            elif isinstance(node, ast.Attribute) and getattr(node.value, "id", "") == "sinew":
                used.add(node.attr)
    return {name for name in used if not name.startswith("_")}


def lists() -> dict[Path, str]:
    """Each file with a list that is made from the library's, as it should be."""
    methods = json.dumps([method.name for method in sinew.methods()])
    stages = json.dumps([stage.name for stage in sinew.stages() if stage.name != "mix"])
    rows = [
        f"| `{m.name}` | {m.group} | {m.label}: {m.description[0].lower()}{m.description[1:]} |\n"
        for m in sinew.methods()
    ]
    names = "".join(f'    "{name}",\n' for name in sorted(used_names()))
    made = [
        ("docs/SINEW_skinning.schema.json", r'("enum": )\[.*?\](\n        },\n        "mix")', methods),
        ("docs/SINEW_skinning.schema.json", r'("items": \{"enum": )\[.*?\]()', stages),
        ("addon/jobs/sinew_reskin.js", r"(const METHODS = )\[.*?\](;)", methods),
        ("README.md", r"(when to use it \|\n\|---\|---\|---\|\n)(?:\|.*\n)*()", "".join(rows)),
        ("addon/native.py", r'(NAMES = \[\n)(?:    "\w+",\n)*()', names),
    ]
    texts: dict[Path, str] = {}
    for name, pattern, value in made:
        path = ROOT / name
        text = texts.get(path) or path.read_text(encoding="utf-8")
        texts[path], found = re.subn(pattern, lambda its, new=value: its[1] + new + its[2], text)
        assert found == 1, f"{name}: its list is not found"
    return texts


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="./dev stub")
    parser.add_argument("--out", type=Path)
    folder = parser.parse_args().out
    write_stub(folder or STUB)
    for path, text in {} if folder else lists().items():
        path.write_text(text, encoding="utf-8")
