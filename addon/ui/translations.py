# SPDX-License-Identifier: GPL-3.0-or-later
"""Sinew's texts in other languages, by Blender's own mechanism (`bpy.app.translations`).

Blender itself translates every label, tooltip and choice, and text given to a layout. Only composed texts go
through tr() and counted().
"""

import json
import re
from collections.abc import Iterable
from pathlib import Path

import bpy

from ..attach.feature import Feature
from ..base.phrases import Phrase

_ENTRY = re.compile(r'^msgid ((?:".*"\n)+)msgstr ((?:".*"\n?)+)', re.MULTILINE)


def read(path: Path) -> dict[str, str]:
    """Returns the texts of a .po file of gettext, each with its translation; without those that are not
    translated, fuzzy or obsolete."""
    texts = {}
    for block in path.read_text(encoding="utf-8").split("\n\n"):
        entry = _ENTRY.search(block)
        if entry is not None and "#, fuzzy" not in block:
            # Its strings are written as in JSON.
            text, translated = ("".join(map(json.loads, part.splitlines())) for part in entry.groups())
            if text and translated:
                texts[text] = translated
    return texts


# By language alone, which Blender uses for all of its countries: de for de_DE.
LANGUAGES = {path.stem: read(path) for path in (Path(__file__).parents[1] / "translations").glob("*.po")}
# Blender translates an operator's label, and the text of its buttons, in a separate context.
CONTEXTS = (bpy.app.translations.contexts.default, bpy.app.translations.contexts.operator_default)


def tr(text: str, /, **values: object) -> str:
    """Returns a text of the interface in the user's language.

    values  for its names in braces
    """
    if isinstance(text, Phrase):
        parts = {
            name: tr(value) if isinstance(value, Phrase) else value for name, value in text.values.items()
        }
        return bpy.app.translations.pgettext_iface(text.template).format(**parts)
    found = bpy.app.translations.pgettext_iface(text)
    return found.format(**values) if values else found


def counted(count: int, one: str, many: str) -> str:
    """Returns the text for one, or for another number; both contain {count}."""
    return tr(one if count == 1 else many, count=f"{count:,}")


def joined(texts: Iterable[str]) -> str:
    """Returns translated texts as one: "A and B"."""
    return f" {tr('and')} ".join(tr(text) for text in texts)


def tip(text: str) -> str:
    """Returns a tooltip, which the user can have in English independently of the interface."""
    return bpy.app.translations.pgettext_tip(text)


def _begin() -> None:
    messages = {
        language: {(context, text): translated for text, translated in texts.items() for context in CONTEXTS}
        for language, texts in LANGUAGES.items()
    }
    bpy.app.translations.register(__name__, messages)


def _end() -> None:
    bpy.app.translations.unregister(__name__)


FEATURE = Feature(begin=_begin, end=_end)
