# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects what only a whole Blender with a window can do: languages, the lesson, computations in the
background, the file browsers of exporters, and operators that work in steps."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import in_window
import pytest
from sinew_addon.features.bake.baked_files import EXPORTS, KINDS
from sinew_addon.ui import translations

pytestmark = pytest.mark.window

TOLERANCE = 2e-5


PARTS = ("language", "lesson", "export", "page", "sheet", "blend", "precompute")


@pytest.fixture(scope="module")
def facts(tmp_path_factory) -> dict:
    """What each part has found, in one Blender."""
    in_window.program_and_package()
    folder = tmp_path_factory.mktemp("window")
    rig = Path(os.environ.get("SINEW_RIGS", ""), "human.blend")
    if rig.is_file():
        shutil.copy(rig, folder)
    parts = (f"{part}_in_window" for part in PARTS)
    return in_window.facts_of("features_in_window", folder, "five_meshes", *parts)


def part_of(name: str):
    @pytest.fixture
    def part(facts) -> dict:
        if name not in facts:
            pytest.skip("SINEW_RIGS is not set, or has no human.blend")
        return facts[name]

    return part


language, lesson, export, page, sheet, blend, precompute = map(part_of, PARTS)


def test_blender_shows_german(language):
    german = translations.LANGUAGES["de"]
    shown = language["german"]
    assert shown["panel"] == german["Stages and Scale"]
    assert shown["operator"] == german["Rebind"]
    assert shown["tooltip"] == german[language["english"]["tooltip"]]
    assert shown["own tooltip"] == german[language["english"]["own tooltip"]]
    assert shown["choice"] == german["Dual Quaternion"]
    assert shown["put together"] == "4 Maschen"
    assert shown["state"] == "Linear anstelle von Armature"
    assert shown["blender's"] == "Punktgruppe"


def test_english_comes_back(language):
    english = language["english"]
    assert english["panel"] == "Stages and Scale"
    assert english["operator"] == "Rebind"
    assert english["put together"] == "4 meshes"
    assert english["state"] == "Linear Blend in the place of Armature"


def test_translations_go_with_the_add_on(language):
    assert language["without"] == "Stages and Scale"


def test_no_errors_are_printed(facts):
    """But the one that the lesson is about."""
    assert [line for line in facts["printed"] if "Save this file first" not in line] == []


def test_what_is_not_saved_is_not_lost(lesson):
    assert lesson["is dirty"] is True
    assert lesson["asks first"] is True
    assert lesson["kept after Esc"] is True
    assert lesson["kept without the question"] is True
    assert "Save this file first" in lesson["said"]


def test_what_was_saved_makes_room_for_it(lesson):
    """Opened as a file without a name, so that saving does not write to the extension's folder."""
    assert lesson["opened"] == [True, "", True]
    assert {"TEXT_EDITOR", "VIEW_3D"} <= set(lesson["reading"])


def test_the_window_goes_on_meanwhile(precompute):
    assert precompute["plan_at_first"] == "waiting"
    assert precompute["ticks_meanwhile"] >= 3
    assert precompute["watched"] == ["SINEW_OT_watch_precomputation"]
    assert precompute["off_modifier_meanwhile"] <= TOLERANCE
    assert precompute["plan_then"] == "in depsgraph"
    assert precompute["off_modifier_then"] > 1e-3


def test_esc_stops_it_and_a_button_goes_on(precompute):
    assert precompute["plan_stopped"] == "waiting"
    assert "stopped" in precompute["reason_stopped"]
    assert precompute["plan_after_button"] == "in depsgraph"


def test_a_render_waits_with_the_interface_locked_or_not(precompute):
    assert precompute["plan_before_render"] == ["waiting", "waiting"]
    assert max(precompute["render_off"]) <= TOLERANCE


def test_its_thread_ends_with_the_file_and_with_blender(precompute):
    assert precompute["running_after_load"] == 0
    assert precompute["plan_at_the_end"] == "waiting"


def test_the_exporter_for_gltf_has_a_check_box(export):
    """With the exporter's own file browser, with the extension installed."""
    assert export["with"].keys() == export["without"].keys()
    assert set(map(tuple, export["without"].values())) == {(None, False)}
    assert ["cor", True] in export["with"].values()
    # Objects parented to bones have no skin.
    assert set(map(tuple, export["with"].values())) <= {("cor", True), (None, False)}
    assert export["attributes"] == []
    assert export["on"]
    assert all(export["on"])


def test_a_comparison_is_saved_as_a_page(page):
    """With the file browser, then in steps: Esc leaves no file, and the scene at its frame."""
    assert page["stopped"] == [False, 3]
    assert page["saved"] == [True, True, 3]


def test_a_click_on_a_contact_sheet_goes_there(sheet):
    """By its variant, in its pose; Backspace and Esc bring back all that the artist saw."""
    assert sheet["opened"] == [True, True]
    # In the pose: another variant by a key, then back to the sheet.
    assert sheet["a cell"] == ["cor", True, False, "cor", True, False, True]
    assert sheet["another"] == ["dq", True, False, "cor", True, False, True]
    assert sheet["a label"] == ["blender", False, True]
    assert sheet["keys"] == ["dq", 2, True]
    assert sheet["closed"] == [True, True, True]
    assert sheet["stopped"] == [True, True]


def test_each_use_of_a_variant_is_an_undo_step(sheet):
    """From the sheet: without the pose that one looked at. By number keys, until Esc."""
    assert sheet["undone"] == ["blender", True, "cor", True, "dq", True]
    assert sheet["by keys"] == ["cor", "blender", "blender", "blender", "blender", "cor"]


def test_blending_actions(blend):
    """In steps, between which the window is drawn: Esc restores everything, and Ctrl+Z undoes a blend."""
    before, after = blend["stopped"]
    assert before == after == blend["undone"]
    assert blend["ended"]["plays"] == "Blend STRAIN LATE"
    assert blend["ended"]["frame"] == before["frame"]


@pytest.mark.slow
def test_bakes(tmp_path, real_rig):
    """With the dialog: Esc in the middle of each restores everything, and Ctrl+Z undoes one that is
    finished. In a Blender of its own, whose processes it counts."""
    in_window.program_and_package()
    shutil.copy(real_rig("human.blend"), tmp_path)
    facts = in_window.facts_of("bake_in_window", tmp_path)
    stopped, ended = facts["stopped"], facts["ended"]
    assert stopped.keys() == ended.keys() >= {"shape-keys", "mdd"}
    assert not any(one["changed"] for one in stopped.values()), stopped
    assert "baked/human_cache/.Human.mdd.unfinished" in stopped["mdd"]["files meanwhile"]
    for kind in stopped.keys() & {"alembic", "usd"}:
        assert "baked/.human.unfinished.blend" in stopped[kind]["files meanwhile"], kind
        assert stopped[kind]["blenders meanwhile"] == 1, kind
        assert f"baked/human{EXPORTS[kind]}" in ended[kind]["files"], kind
        # The second and the last change nothing (attach/undeformed.py).
        assert ended[kind]["modifiers"] == ["ARMATURE", "NODES", "NODES", "LAPLACIANDEFORM"], kind
    assert not any(one["not undone"] for one in ended.values()), ended
    assert (ended["shape-keys"]["keys"], ended["shape-keys"]["modifiers"]) == (True, ["ARMATURE"])
    assert ended["mdd"]["modifiers"] == ["MESH_CACHE", "ARMATURE"]
    assert ended["bones"]["modifiers"] == ["ARMATURE"]
    assert stopped.keys() | facts["refused"].keys() == set(KINDS) - {"pc2"}
    assert all("built without" in error for error in facts["refused"].values())
    assert not any(".unfinished" in name for one in ended.values() for name in one["files"])
