# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects who deforms an object, as a table, without Blender."""

from __future__ import annotations

from dataclasses import fields, replace

import pytest
from sinew_addon.attach.icons import Deformer, Icons
from sinew_addon.deform.plan import ObjectFacts, State, plan
from sinew_addon.skinning.shading import GivenNormals

_HIDDEN = {"viewport": Deformer.NOTHING, "render": Deformer.NOTHING}
TABLE = [
    ({}, State.IN_DEPSGRAPH, ""),
    ({"enabled": False}, State.OFF, ""),
    ({"enabled": False, "mode": "EDIT", "safe_mode": True}, State.OFF, ""),
    ({"is_linked": True}, State.LINKED, "make a library override"),
    ({"is_linked": True, "error": "Arm: no", "mode": "EDIT"}, State.LINKED, "make a library override"),
    ({"error": "Arm: no"}, State.REFUSED, "Arm: no"),
    ({"error": "Arm: no", "mode": "EDIT"}, State.REFUSED, "Arm: no"),
    ({"error": "Arm: no", "enabled": False}, State.OFF, ""),
    ({"mode": "EDIT"}, State.EDITING, "In this mode"),
    ({"mode": "SCULPT", "has_heat_map": True}, State.EDITING, "In this mode"),
    ({"mode": "WEIGHT_PAINT"}, State.IN_DEPSGRAPH, ""),
    ({"builtin_is_faster": True}, State.BUILT_IN, "Small"),
    ({"builtin_is_faster": True, "safe_mode": True}, State.BUILT_IN, "Small"),
    ({"safe_mode": True}, State.AFTER_UPDATE, "Safe mode"),
    ({"failure": "ValueError: no"}, State.AFTER_UPDATE, "ValueError: no"),
    ({"is_comparison_copy": True, "mesh_is_shared": True}, State.AFTER_UPDATE, "copy for comparison"),
    ({"mesh_is_editable": False}, State.IN_DEPSGRAPH, ""),
    ({"mesh_is_shared": True}, State.IN_DEPSGRAPH, ""),
    ({"has_upstream": True}, State.IN_DEPSGRAPH, ""),
    ({"has_upstream": True, "upstream_changes_weights": True}, State.AFTER_UPDATE, "change weights"),
    ({"has_heat_map": True}, State.AFTER_UPDATE, "heat map"),
    ({"visibility_is_keyed": True}, State.AFTER_UPDATE, "animated"),
    ({"views_differ": True}, State.AFTER_UPDATE, "alone"),
    ({"deformed_is_read": True}, State.IN_DEPSGRAPH, ""),
    ({"is_deforming_body": True}, State.AFTER_UPDATE, "Its rigid body is simulated from the deformed mesh"),
    ({"viewport": Deformer.NOTHING}, State.IN_DEPSGRAPH, ""),
    ({"viewport": Deformer.ARMATURE, "mesh_is_shared": True}, State.IN_DEPSGRAPH, ""),
    ({"render": Deformer.ARMATURE, "safe_mode": True}, State.AFTER_UPDATE, "Safe mode"),
    ({"viewport": Deformer.NOTHING, "render": Deformer.ARMATURE}, State.IN_DEPSGRAPH, ""),
    ({**_HIDDEN, "has_upstream": True}, State.IN_DEPSGRAPH, ""),
    ({**_HIDDEN, "builtin_is_faster": True}, State.BUILT_IN, "Small"),
    ({"render": Deformer.ARMATURE, "builtin_is_faster": True}, State.IN_DEPSGRAPH, ""),
    ({**_HIDDEN, "mode": "EDIT"}, State.EDITING, "In this mode"),
    ({**_HIDDEN, "enabled": False}, State.OFF, ""),
]


@pytest.mark.parametrize(("facts", "state", "reason"), TABLE)
def test_the_table(facts, state, reason):
    found = plan(ObjectFacts(**facts))
    assert found.state is state
    assert reason in found.reason
    assert bool(found.reason) == bool(reason)


def test_what_others_read_is_not_left_out():
    assert plan(ObjectFacts()).leaves_out
    assert not plan(ObjectFacts(deformed_is_read=True)).leaves_out


@pytest.mark.parametrize(
    ("fact", "value"), [("mesh_is_editable", False), ("mesh_is_shared", True), ("has_upstream", True)]
)
def test_points_of_a_mesh_that_is_not_its_own_are_in_a_buffer(fact, value):
    assert plan(ObjectFacts(**{fact: value})).in_buffer
    assert not plan(ObjectFacts()).in_buffer


@pytest.mark.parametrize("facts", [facts for facts, state, _reason in TABLE if state is State.AFTER_UPDATE])
def test_what_is_written_after_the_update_is_in_a_buffer(facts):
    assert plan(ObjectFacts(**facts)).in_buffer


@pytest.mark.parametrize("facts", [facts for facts, *_ in TABLE])
def test_who_deforms_gives_normals_and_says_what_it_lacks(facts):
    given = {"normals": GivenNormals("POINT"), "normals_reason": "Cast follows", "lacks": "until found"}
    plain, found = plan(ObjectFacts(**facts)), plan(ObjectFacts(**facts, **given))
    assert found == (replace(plain, **given) if plain.is_in_depsgraph or plain.is_written else plain)


@pytest.mark.parametrize(
    ("sinew", "modifiers", "deformer"),
    [
        (True, (True,), Deformer.SINEW),
        (True, (False, True), Deformer.SINEW),
        (True, (False, False), Deformer.NOTHING),
        (False, (False, True), Deformer.ARMATURE),
        (False, (False,), Deformer.NOTHING),
    ],
)
def test_what_icons_mean(sinew, modifiers, deformer):
    assert Icons(sinew, modifiers).deformer is deformer


@pytest.mark.parametrize("viewport", Deformer)
@pytest.mark.parametrize("render", Deformer)
def test_the_panel_says_what_deforms_in_each_view(viewport, render):
    said = " ".join(plan(ObjectFacts(viewport=viewport, render=render)).view_reasons)
    of_views = {"viewport": viewport, "renders": render}
    for name, deformer in of_views.items() if viewport is not render else ():
        assert (f"in {'the ' if name == 'viewport' else ''}{name}" in said) == (
            deformer is not Deformer.SINEW
        )
    assert ("Not deformed" in said) == (Deformer.NOTHING in of_views.values())
    assert ("Its Armature modifier deforms" in said) == (Deformer.ARMATURE in of_views.values())


def test_every_fact_matters():
    """A fact that no row changes would not need to be collected."""
    named = {name for facts, *_ in TABLE for name in facts} | {"normals", "normals_reason", "lacks"}
    assert named == {field.name for field in fields(ObjectFacts)}
