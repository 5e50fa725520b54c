# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects the site: broken links fail its build, and generated pages have all that they describe."""

from __future__ import annotations

import argparse
import html
import re
import subprocess
from pathlib import Path
from types import ModuleType

import make_reference
import pytest
import sinew
from sinew import _types
from sinew_addon import cli

ROOT = Path(__file__).resolve().parents[2]
# Installed by ./dev site and ./dev test.
PYTHON = ROOT / ".venvs" / "site" / "bin" / "python"


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Path:
    """As ./dev site builds it: a link without an end fails it."""
    out = tmp_path_factory.mktemp("site")
    assert PYTHON.exists(), "./dev site makes what builds the site"
    words = [PYTHON, "-m", "mkdocs", "build", "--site-dir", out]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    return out


def text_of(path: Path) -> str:
    return html.unescape(re.sub(r"<[^>]*>", "", path.read_text(encoding="utf-8")))


def test_every_document_is_a_page(site):
    names = {path.stem for path in (ROOT / "docs").glob("*.md")}
    names |= {path.stem.lower() for path in ROOT.glob("*.md")} - {"readme"} | {"index", *make_reference.PAGES}
    assert names <= {path.stem for path in site.glob("*.html")}
    # Files for engines are included; programs that generate pages are not.
    assert {path.parent.name for path in site.rglob("*.py")} == {"shaders"}


def test_the_command_line_is_whole(site):
    text = text_of(site / "commands.html")
    parser, modules = cli.make_parser()
    subparsers = next(a for a in parser._actions if isinstance(a, argparse._SubParsersAction)).choices
    assert set(subparsers) == set(modules)
    sections = re.split(r"^sinew (\w+)¶", text, flags=re.MULTILINE)
    found = dict(zip(sections[1::2], sections[2::2], strict=True))
    assert list(found) == list(modules)
    for name, subparser in subparsers.items():
        said = " ".join(found[name].split())
        for action in subparser._actions:
            assert ", ".join(action.option_strings) in said, (name, action)
            if action.help:
                assert action.help.replace("`", "").split("%(")[0].strip() in said, (name, action)


def test_the_python_package_is_whole(site):
    headings = re.findall(r"^([\w.]+)¶", text_of(site / "python.html"), flags=re.MULTILINE)
    wanted = set()
    for name in sinew.__all__:
        value = getattr(sinew, name)
        if isinstance(value, type):
            wanted |= {name} | {
                f"{name}.{member}"
                for member, found in vars(value).items()
                if not member.startswith("_") and not isinstance(found, property)
            }
        elif isinstance(value, ModuleType):
            own = {member for member in getattr(value, "__all__", dir(value)) if not member.startswith("_")}
            wanted |= {f"sinew.{name}"} | {f"{name}.{member}" for member in own - set(vars(_types))}
        elif callable(value):
            wanted.add(name)
    assert wanted <= set(headings), wanted - set(headings)
    assert len(headings) == len(set(headings))


def test_what_the_library_exports_to_cpp_is_there(site):
    text = text_of(site / "cpp.html")
    exported = 0
    for name in make_reference.public_headers():
        assert f"sinew/{name}¶" in text
        header = (ROOT / "native" / "sinew" / name).read_text(encoding="utf-8")
        for match in re.finditer(r"SINEW_EXPORT (?:[^(;{]*?)(\w+)(?:\(| \{)", header):
            assert re.search(rf"\b{match[1]}\b", text), (name, match[1])
            exported += 1
    assert exported > 12
    assert "private:" not in text
