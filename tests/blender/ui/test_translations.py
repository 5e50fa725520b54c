# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects texts in other languages: the values that they name, and what a whole Blender shows
(language_in_window.py), as Blender as a module has no languages."""

from __future__ import annotations

import ast
import string
from pathlib import Path

import pytest
import sinew_addon
from conftest import REPOSITORY
from sinew_addon.ui import translations

pytestmark = pytest.mark.long_term

LANGUAGES = list(translations.LANGUAGES)


def names_in_braces(text: str) -> set[str]:
    fields = (name for _before, name, _format, _conversion in string.Formatter().parse(text))
    return {name for name in fields if name is not None}


def texts_of(node: ast.expr) -> list[str]:
    """A string, or both of a conditional expression."""
    if isinstance(node, ast.IfExp):
        return texts_of(node.body) + texts_of(node.orelse)
    return [node.value] if isinstance(node, ast.Constant) and isinstance(node.value, str) else []


def test_texts_are_given_the_values_that_they_name():
    wrong, count = [], 0
    for path in sorted(Path(sinew_addon.__file__).parent.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            name = getattr(node.func, "id", "") if isinstance(node, ast.Call) else ""
            if name in ("tr", "phrase", "draw_text"):
                texts = texts_of(node.args[name == "draw_text"])
                count += len(texts)
                given = {keyword.arg for keyword in node.keywords} - {"icon", "alert", "pixels"}
                wrong += [f"{path}:{node.lineno}: {text}" for text in texts if names_in_braces(text) != given]
    assert count > 50
    assert wrong == []


def test_the_texts_of_all_classes_are_found(monkeypatch):
    """By the tool that brings the languages up to date."""
    monkeypatch.syspath_prepend(REPOSITORY / "tools")
    import texts

    assert {"Add Sinew", "Dual Quaternion", "keeps volume best"} <= set(texts.shown())


@pytest.mark.parametrize("language", LANGUAGES)
def test_translations_have_the_same_names_in_braces(language):
    differing = {
        text: translated
        for text, translated in translations.LANGUAGES[language].items()
        if names_in_braces(text) != names_in_braces(translated) or text.count("%") != translated.count("%")
    }
    assert differing == {}


@pytest.mark.parametrize("language", LANGUAGES)
def test_translations_end_as_their_texts_do(language):
    """A tooltip has no full stop, as Blender adds it; the text of a button that opens something has an
    ellipsis."""

    def end(text: str) -> str:
        return text[-1] if text[-1] in ".…:" else ""

    # A report of something done to several meshes: in German a participle, then a colon.
    allowed = {"Rebound"}
    texts = translations.LANGUAGES[language].items()
    assert [text for text, other in texts if end(text) != end(other) and text not in allowed] == []
