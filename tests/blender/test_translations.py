# SPDX-License-Identifier: GPL-3.0-or-later
"""Sinew's texts in other languages. Blender as a module has no languages: language_in_window.py tests
what is shown in a whole Blender."""

from __future__ import annotations

import warnings

import in_window
import messages
import pytest
from messages import names_in_braces
from sinew_addon.ui import translations

LANGUAGES = list(translations.LANGUAGES)


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_missing_translation_warns(language):
    """It fails nothing, as Blender shows the English text."""
    shown = messages.shown()
    assert len(shown) > 300
    missing = [text for text in shown if text not in translations.LANGUAGES[language]]
    if missing:
        warnings.warn(f"{language}: {len(missing)} texts are not translated: {missing}", stacklevel=1)


@pytest.mark.parametrize("language", LANGUAGES)
def test_no_translation_is_left_over(language):
    used = messages.shown().keys() | messages.literals()
    assert [text for text in translations.LANGUAGES[language] if text not in used] == []


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


def test_texts_are_given_the_values_that_they_name():
    assert messages.wrong_values() == []


def test_texts_put_together_are_translated_as_a_whole():
    """No text with words is assembled in a panel's code, where it would stay English."""
    assert messages.joined_in_code() == []


@pytest.fixture(scope="module")
def facts(tmp_path_factory) -> dict:
    return in_window.facts_of("language_in_window", tmp_path_factory.mktemp("window"), "five_meshes")


def test_blender_shows_german(facts):
    german = translations.LANGUAGES["de"]
    shown = facts["german"]
    assert shown["panel"] == german["Stages and Scale"]
    assert shown["operator"] == german["Rebind"]
    assert shown["tooltip"] == german[facts["english"]["tooltip"]]
    assert shown["own tooltip"] == german[facts["english"]["own tooltip"]]
    assert shown["choice"] == german["Dual Quaternion"]
    assert shown["put together"] == "4 Maschen"
    assert shown["state"] == "Linear anstelle von Armature"
    assert shown["blender's"] == "Punktgruppe"


def test_english_comes_back(facts):
    english = facts["english"]
    assert english["panel"] == "Stages and Scale"
    assert english["operator"] == "Rebind"
    assert english["put together"] == "4 meshes"
    assert english["state"] == "Linear Blend in the place of Armature"


def test_translations_go_with_the_add_on(facts):
    assert facts["without"] == "Stages and Scale"


def test_panels_in_german_print_no_errors(facts):
    assert facts["printed"] == []
