# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects the text of variants: what it means, that it is written as read, and what it says of errors."""

import re

import pytest
import sinew
from sinew_addon.base.errors import WrongUse
from sinew_addon.skinning import variants
from sinew_addon.skinning.variants import Variant, parse

TEXTS = (
    "dq",
    "dq+twist_spread+delta_mush",
    "soft one=dq:signs=hierarchy+delta_mush:factor=0.25:iterations=20",
    "lbs+mix=dq",
    "cor+bulge_limit+scale_rule=none+normals=SKINNED",
    "limited:influences=2",
    "blender",
    "as it was=file",
    "recommended",
)


@pytest.mark.parametrize("text", TEXTS)
def test_it_is_written_as_it_is_read(text):
    variant = parse(text)
    assert parse(variant.key) == variant
    assert variant.key.removeprefix("=") == text
    assert re.match(variants.pattern(), variant.key)


def test_its_values_are_those_of_every_stage():
    variant = parse(" dq + delta_mush : iterations=9 ")
    assert variant.stages == ("delta_mush",)
    values = variant.all_values
    assert (values["delta_mush.enabled"], values["delta_mush.iterations"]) == (True, 9)
    assert (values["twist_spread.enabled"], values["mix.method"]) == (False, "off")
    assert not any(name.endswith(".group") for name in values)
    own = {each.id for each in sinew.stages()[-1].parameters if each.kind != "vertex_group"}
    assert variant.stage_values.keys() == {"delta_mush"}
    assert variant.stage_values["delta_mush"].keys() == own
    assert parse("blender").all_values == {}
    assert parse("lbs+mix=dq").stage_values == {}
    assert (parse("lbs+mix=dq").mix, parse("lbs").mix) == ("dq", "")


def test_what_is_by_default_and_groups_are_left_out():
    values = {
        "delta_mush.enabled": True,
        "delta_mush.factor": 0.5,
        "delta_mush.group": "Soft",
        "mix.method": "OFF",
    }
    found = Variant.of("dq", ["delta_mush"], {**values, "normals": "LEAVE", "cor.signs": "hierarchy"})
    assert found.text == "dq+delta_mush+normals=LEAVE"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "expected one of lbs"),
        ("dqq", "got 'dqq'"),
        ("dq foo", "got 'dq foo'"),
        ("x=y=dq", "got 'y=dq'"),
        ("dq+", "got ''"),
        ("dq+foo", "expected one of mix, twist_spread"),
        ("dq+mix", "expected mix=METHOD, got mix"),
        ("dq+mix=off", "expected mix=METHOD"),
        ("dq+twist_spread=on", "expected twist_spread alone"),
        ("dq+delta_mush:enabled=off", "delta_mush: is on where it is named"),
        ("dq+delta_mush:iterations=x", "expected a whole number from 0 to 1000, got 'x'"),
        ("dq+delta_mush:group=Soft", "a vertex group belongs to a mesh"),
        ("blender+delta_mush", "nothing may follow blender"),
        ("dq+scale_rule=5", "expected one of 4.0, 3.x, none, got '5'"),
    ],
)
def test_an_error_names_what_is_wrong(text, said):
    with pytest.raises(WrongUse, match=re.escape(said)):
        parse(text)
    # Values of parameters are beyond what a pattern can say.
    if ":" not in text and text != "dq+mix=off":
        assert not re.match(variants.pattern(), text)


def test_lists_have_each_once():
    assert [each.text for each in variants.parse_list("dq, lbs,dq")] == ["dq", "lbs"]


def test_labels_are_whole():
    assert parse("cor+twist_spread+bulge_limit+delta_mush").label == (
        "Centres of Rotation with Twist Spread, Limit Bulge and Delta Mush"
    )
    assert parse("lbs+mix=dq").label == "Linear Blend with Mix of Dual Quaternion"
    assert parse("soft=dq").title == "soft: Dual Quaternion"


def test_names_fit_into_the_text():
    assert variants.named(parse("dq"), " soft ").key == "soft=dq"
    with pytest.raises(WrongUse, match="has one of"):
        variants.named(parse("dq"), "a+b")
