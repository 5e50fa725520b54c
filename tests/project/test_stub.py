# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects what ./dev stub makes of the library: the stub, which editors and type checkers read and which
describes everything, and lists in files that can not read the library's."""

import ast
import subprocess
from pathlib import Path
from typing import get_args

import pytest
import sinew
from make_stub import lists

ROOT = Path(__file__).resolve().parents[2]
STUB = ROOT / "native" / "python" / "sinew" / "_native"
# Installed by ./dev stub and ./dev test.
PYTHON = ROOT / ".venvs" / "site" / "bin" / "python"


def contents(folder):
    return {path.name: path.read_text(encoding="utf-8") for path in folder.iterdir()}


def test_the_stub_is_made_of_the_module(tmp_path):
    words = [PYTHON, ROOT / "tools" / "make_stub.py", "--out", tmp_path / "made"]
    subprocess.run(words, check=True, timeout=120)
    assert contents(tmp_path / "made") == contents(STUB), "./dev stub writes it anew"


@pytest.mark.skipif("ddm" not in {method.name for method in sinew.methods()}, reason="built without ddm")
def test_lists_are_those_of_the_library():
    for path, text in lists().items():
        assert path.read_text(encoding="utf-8") == text, f"{path.name}: ./dev stub writes its list anew"


@pytest.mark.parametrize("path", sorted(STUB.iterdir()), ids=lambda path: path.name)
def test_everything_is_described(path):
    module = ast.parse(path.read_text(encoding="utf-8"))
    described = [node for node in ast.walk(module) if isinstance(node, ast.ClassDef | ast.FunctionDef)]
    assert described
    for node in described:
        if node.name == "__init__" or not node.name.startswith("_"):
            assert ast.get_docstring(node), node.name


def test_the_type_of_names_has_all_methods():
    assert get_args(sinew.interpolate.Method) == sinew.interpolate.METHODS
