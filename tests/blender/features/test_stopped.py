# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects files from what is computed in steps: stopped, it leaves all as it was; what only measures leaves
it so at its end, too."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import bpy
import pytest
import scenes
import test_auto_mix
import test_blend
import test_inbetween
import test_recommended
import test_worst_frames
from sinew_addon.features.auto_mix import auto_mix
from sinew_addon.features.bake import bake
from sinew_addon.features.blend import blend_actions
from sinew_addon.features.inbetween import inbetween_bake
from sinew_addon.features.measure import worst_frames
from sinew_addon.features.suggest import recommend, suggest
from sinew_addon.io import actions
from whole_file import assert_same, content

pytestmark = pytest.mark.long_term

Steps = Iterator[float]


def inbetweens(_folder: Path) -> Steps:
    armature = test_inbetween.make_rig()
    test_inbetween.key_random_poses(armature)
    return inbetween_bake.steps(armature, "sclerp")


def blend(_folder: Path) -> Steps:
    armature, chosen, _pair = test_blend.make_walks()
    actions.play(armature, chosen[0])
    return blend_actions.make(armature, chosen, (1, 1), test_blend.Settings())


def mix(_folder: Path) -> Steps:
    return auto_mix.AutoMix(bpy.context.scene, [test_auto_mix.jointed("lbs")], "SCENE", 0.3).steps()


def recommendation(_folder: Path) -> Steps:
    obj, _armature = test_recommended.arm(150.0, axis=1)
    return recommend.search(bpy.context.scene, [obj])


def suggestion(_folder: Path) -> Steps:
    obj, _armature = scenes.skinned_arm("lbs")
    return suggest.scan(bpy.context.scene, [obj], "ACTION")


def search_of_worst_frames(_folder: Path) -> Steps:
    obj, armature = test_worst_frames.waving_arm()
    scenes.add_sinew(obj, "dq")
    bpy.context.scene.frame_set(7, subframe=0.25)
    # Posed by hand, in addition to its keys.
    scenes.bend(armature, 33.0)
    return worst_frames.scan(bpy.context.scene, [obj], "stretch", "blender", "ACTION")


def bake_to(kind: str, folder: Path) -> Steps:
    obj, _armature = scenes.skinned_arm("dq")
    return bake.start([obj], kind, range(1, 12), folder / f"arm.{kind}", overwrite=False).sample()


MEASURING = (recommendation, suggestion, search_of_worst_frames)
OTHERS = (inbetweens, blend, mix)


@pytest.mark.parametrize(
    "start", [*OTHERS, *MEASURING, "mdd", "pc2", "vat"], ids=lambda each: getattr(each, "__name__", each)
)
@pytest.mark.parametrize("count", [1, 5])
def test_stopped_it_leaves_all_as_it_was(start, count, tmp_path):
    steps = bake_to(start, tmp_path) if isinstance(start, str) else start(tmp_path)
    bpy.context.view_layer.update()
    before = content()
    shares = [next(steps) for _step in range(count)]
    assert shares == sorted(shares)
    steps.close()
    assert_same(before)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("start", MEASURING)
def test_at_its_end_all_is_as_it_was(start, tmp_path):
    steps = start(tmp_path)
    bpy.context.view_layer.update()
    before = content()
    assert list(steps)[-1] == 1.0
    assert_same(before)
