# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel, the menus and the shortcuts in a real window, with clicks and keys: see panel_in_window.py."""

from __future__ import annotations

import in_window
import pytest

pytestmark = pytest.mark.window


@pytest.fixture(scope="module")
def facts(tmp_path_factory) -> dict:
    return in_window.facts_of("panel_in_window", tmp_path_factory.mktemp("window"), "five_meshes")


def test_five_meshes_need_one_click_for_a_method(facts):
    assert facts["added"] == ["lbs"] * 5
    assert facts["chosen"] == ["dq"] * 5


def test_a_click_starts_with_the_method_of_the_preferences(facts):
    assert facts["added as preferred"] == ["qv"] * 5


def test_each_click_is_one_step_of_undo(facts):
    assert facts["switched off"] == [False] * 5
    assert facts["on again"] == [True] * 5
    assert facts["chosen undone"] == ["lbs"] * 5
    assert facts["added undone"] == [""] * 5


def test_f3_finds_operators_without_developer_extras(facts):
    assert facts["added by search"] == ["lbs"] * 5
    assert facts["switched by search"] == [False] * 5


def test_f3_finds_operators_in_every_mode_with_a_menu(facts):
    modes = [f"MESH {mode}" for mode in ("EDIT", "SCULPT", "WEIGHT_PAINT", "VERTEX_PAINT")]
    modes += ["ARMATURE EDIT", "ARMATURE POSE"]
    assert facts["switched in modes"] == {mode: [[False] * 5, [True] * 5] for mode in modes}


def test_the_menu_is_lower_than_the_window(facts):
    assert 200 < facts["menu height"] < 600


def test_a_shortcut_and_f3_flip_the_comparison(facts):
    assert facts["flipped"] == ["FLIP", False]
    assert facts["flipped by search"] is True


def test_f3_shows_the_errors_of_a_bake_as_colours_and_hides_them(facts):
    before, shown, afterwards, (vivid, grey) = facts["bake error"]
    assert (before, shown, afterwards) == ("MATERIAL", "VERTEX", "MATERIAL")
    assert facts["bake error undone"] == "MATERIAL"
    assert vivid > 1.2 * grey


def test_shortcuts_and_menus_go_with_the_add_on(facts):
    assert facts["shortcuts"] == ["sinew.flip_comparison ", "wm.call_menu_pie SINEW_MT_pie"]
    assert facts["shortcuts afterwards"] == []
    assert facts["menus afterwards"] == []


def test_plain_clicks_choose_what_is_compared_and_the_view_shows_it(facts):
    """Linear blend, dual and vector quaternions were chosen; a click removes one, another adds one."""
    assert facts["compared"] == ["dq", "lbs", "log"]
    assert facts["copies in view"] is True


def test_the_button_above_the_modifiers_opens_the_tab(facts):
    assert facts["tab"] == [True, "Sinew"]


def test_panels_print_no_errors(facts):
    assert facts["printed"] == []


def test_a_click_uses_a_suggested_method(facts):
    assert facts["suggestion used"][0] in facts["suggested"]
    assert facts["suggestion used"] == facts["suggestion used"][:1] * 5
    assert facts["suggestion undone"] == ["dq"] * 5


def test_off_greys_the_method(facts):
    on, off = facts["letters"]
    assert off < 0.7 * on
    assert facts["ways on"] == [True] * 5


def test_blenders_progress_bar_is_in_the_status_bar_until_esc(facts):
    meanwhile, afterwards, share = facts["progress"]
    assert meanwhile > 100
    assert (afterwards, share) == (0, 0.0)


def test_a_click_mends_and_one_step_of_undo_takes_it_back(facts):
    assert (facts["weights lost"], facts["weights mended"], facts["mending undone"]) == (20, 0, 20)


def test_a_corrective_key_is_found_by_f3_and_has_sinews_shape(facts):
    ((name, muted, driven),) = facts["corrective"]
    assert name.startswith("Dual Quaternion")
    assert (muted, driven) == (True, False)
    assert facts["corrective undone"] == []
    assert facts["corrective driven"] == [[name, True, True]]
    without, with_key = facts["off by"]
    assert without > 0.03
    assert with_key <= 1e-5
