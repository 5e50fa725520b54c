# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension's page in Blender's preferences, with Sinew registered as an add-on.
test_panel_in_window.py tests clicks on it."""

from __future__ import annotations

import bpy
import pytest
import scenes
from sinew_addon.attach import properties
from sinew_addon.deform import precomputing, safe_mode, session
from sinew_addon.io import addon_preferences, units
from sinew_addon.skinning import precompute
from sinew_addon.skinning.precompute import precomputations

pytestmark = pytest.mark.long_term


@pytest.fixture
def preferences():
    addons = bpy.context.preferences.addons
    entry = addons.new()
    entry.module = addon_preferences.ADDON
    yield entry.preferences
    addons.remove(entry)
    precomputing.open_cache()


@pytest.fixture
def selected():
    return scenes.make_arm()[0]


def test_scripts_do_not_depend_on_it(preferences, selected):
    preferences.first_method = "cor"
    bpy.ops.sinew.add()
    assert properties.of(selected).method == "lbs"


@pytest.mark.parametrize(("system", "text"), [("METRIC", "2.5 cm"), ("NONE", "0.25 units")])
def test_lengths_are_in_the_units_of_the_scene(system, text):
    scene = bpy.context.scene
    scene.unit_settings.system, scene.unit_settings.scale_length = system, 0.1
    assert units.text(scene, "length", 0.25) == text


def test_numbers_of_methods_go_to_the_chosen_folder(preferences, selected, tmp_path, monkeypatch):
    monkeypatch.delenv(precomputing.VARIABLE)
    monkeypatch.setattr(precompute, "SECONDS_WORTH_A_FILE", 0.0)
    preferences.cache_folder = str(tmp_path / "numbers")
    assert precomputations.cache is not None
    # A mesh that no other test has: results in memory are not written again.
    selected.data.vertices[0].co.x += 0.0123
    scenes.add_sinew(selected, "cor")
    assert session.skinned_of(selected) is not None
    assert list((tmp_path / "numbers").iterdir())
    # The environment at Blender's start overrides the preferences.
    monkeypatch.setenv(precomputing.VARIABLE, "0")
    preferences.cache_folder = str(tmp_path / "others")
    assert precomputations.cache is None


def test_safe_mode_takes_effect_at_once(preferences, selected, monkeypatch):
    scenes.add_sinew(selected, "dq")
    assert session.skinned_of(selected).plan.is_in_depsgraph
    preferences.safe_mode = True
    assert session.skinned_of(selected).plan.is_written
    assert session.skinned_of(selected).plan.reason == "Safe mode"
    preferences.safe_mode = False
    assert session.skinned_of(selected).plan.is_in_depsgraph
    monkeypatch.setenv(safe_mode.VARIABLE, "1")
    session.refresh(bpy.context)
    assert session.skinned_of(selected).plan.is_written
