# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the stub of sinew._native, which editors and type checkers read, from the module that is installed.

python tools/make_stub.py [--out FOLDER]    into native/python/sinew/_native, or FOLDER
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

STUB = Path(__file__).resolve().parents[1] / "native" / "python" / "sinew" / "_native"


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


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="./dev stub")
    parser.add_argument("--out", type=Path, default=STUB)
    write_stub(parser.parse_args().out)
