# SPDX-License-Identifier: GPL-3.0-or-later
"""The icons of Sinew's modifier and of the Armature modifier mean what they mean in any stack, in each view
and in any order, and the panel says what deforms."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path

import bpy
import numpy as np
import pytest
import scenes
from conftest import halved
from sinew_addon.attach import attach, properties
from sinew_addon.attach.icons import Deformer
from sinew_addon.ui import state_text

VIEWS = ("viewport", "render")
CLICKS = tuple(product(("Sinew", "Armature"), VIEWS))
SINEW, ARMATURE, NOTHING = Deformer.SINEW, Deformer.ARMATURE, Deformer.NOTHING


@dataclass
class Rule:
    """What the icons should mean, apart from Sinew's own code: each is as it was clicked, and what deforms
    is what the stack shows."""

    sinew: dict[str, bool] = field(default_factory=lambda: dict.fromkeys(VIEWS, True))
    armature: dict[str, bool] = field(default_factory=lambda: dict.fromkeys(VIEWS, True))

    def click(self, modifier: str, view: str) -> None:
        icons = self.sinew if modifier == "Sinew" else self.armature
        icons[view] = not icons[view]

    def deformer(self, view: str) -> Deformer:
        if not self.armature[view]:
            return NOTHING
        return SINEW if self.sinew[view] else ARMATURE

    def icons(self) -> dict[str, tuple[bool, bool]]:
        return {"Sinew": tuple(self.sinew.values()), "Armature": tuple(self.armature.values())}


class Character:
    """An arm by dual quaternions, whose Armature modifier blends linearly, and its three shapes."""

    def __init__(self, prepare: Callable[[bpy.types.Object], None] = lambda obj: None) -> None:
        obj, _armature = scenes.make_arm()
        prepare(obj)
        bpy.context.scene.frame_set(9)
        self.shapes = {ARMATURE: scenes.final_points(obj)}
        obj.modifiers["Armature"].show_viewport = False
        self.shapes[NOTHING] = scenes.final_points(obj)
        obj.modifiers["Armature"].show_viewport = True
        scenes.add_sinew(obj, "dq")
        self.shapes[SINEW] = scenes.final_points(obj)

    @property
    def obj(self) -> bpy.types.Object:
        """Found anew, as loading and undo make another."""
        return bpy.data.objects["Arm"]

    def icons(self) -> dict[str, tuple[bool, bool]]:
        shown = {m.name: (m.show_viewport, m.show_render) for m in self.obj.modifiers}
        return {name: shown[name] for name in ("Sinew", "Armature") if name in shown}

    def click(self, modifier: str, view: str) -> None:
        found = self.obj.modifiers[modifier]
        setattr(found, f"show_{view}", not getattr(found, f"show_{view}"))
        bpy.context.view_layer.update()

    def deformer(self, points: np.ndarray) -> Deformer:
        near = {each: scenes.worst(points, shape) for each, shape in self.shapes.items()}
        best = min(near, key=near.get)
        assert near[best] <= scenes.TOLERANCE * scenes.diagonal(self.obj)
        return best

    def check(self, rule: Rule, rendered_points: Callable | None = None) -> None:
        assert self.deformer(scenes.final_points(self.obj)) is rule.deformer("viewport")
        assert self.icons() == rule.icons()
        assert properties.of(self.obj).error == ""
        is_plain = all(rule.deformer(view) is SINEW for view in VIEWS)
        assert (state_text.switch_text([self.obj]) == "On") == is_plain
        said = state_text.sentence_of(self.obj)
        words = {ARMATURE: "Its Armature modifier deforms", NOTHING: "Not deformed", SINEW: "in the place of"}
        assert all(words[rule.deformer(view)] in said for view in VIEWS)
        if rendered_points is not None:
            assert self.deformer(rendered_points(self.obj)) is rule.deformer("render")


def _in_front(obj: bpy.types.Object) -> None:
    scenes.put_in_front(obj, "SMOOTH").iterations = 4


def _with_keys(obj: bpy.types.Object) -> None:
    obj.modifiers.new("Behind", "SMOOTH").iterations = 2
    obj.shape_key_add(name="Basis")
    obj.shape_key_add(name="Key").data[3].co.z += 0.1
    obj.data.shape_keys.key_blocks["Key"].value = 0.7


def _switch(character: Character, rule: Rule, _chosen: tuple[str, str], _path: Path) -> None:
    properties.of(character.obj).enabled = False
    assert character.icons() == rule.icons() | {"Sinew": (False, False)}
    shown = ARMATURE if rule.armature["viewport"] else NOTHING
    assert character.deformer(scenes.final_points(character.obj)) is shown
    properties.of(character.obj).enabled = True


def _reopen(_character: Character, _rule: Rule, _chosen: tuple[str, str], path: Path) -> None:
    scenes.reopened(path)


def _undo(character: Character, rule: Rule, chosen: tuple[str, str], _path: Path) -> None:
    bpy.ops.ed.undo_push()
    character.click(*chosen)
    bpy.ops.ed.undo_push()
    bpy.ops.ed.undo()
    bpy.context.view_layer.update()
    character.check(rule)
    bpy.ops.ed.redo()
    bpy.context.view_layer.update()
    rule.click(*chosen)


def _duplicate(character: Character, _rule: Rule, _chosen: tuple[str, str], _path: Path) -> None:
    old = character.obj
    new = scenes.copied(old)
    bpy.context.view_layer.update()
    bpy.data.objects.remove(old)
    new.name = "Arm"
    bpy.context.view_layer.objects.active = new
    bpy.context.view_layer.update()


def _paint(character: Character, rule: Rule, chosen: tuple[str, str], _path: Path) -> None:
    bpy.ops.object.mode_set(mode="WEIGHT_PAINT")
    bpy.context.view_layer.update()
    assert character.deformer(scenes.final_points(character.obj)) is rule.deformer("viewport")
    character.click(*chosen)
    rule.click(*chosen)
    assert character.deformer(scenes.final_points(character.obj)) is rule.deformer("viewport")
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.update()


def _edit(_character: Character, _rule: Rule, _chosen: tuple[str, str], _path: Path) -> None:
    for mode in ("EDIT", "SCULPT", "OBJECT"):
        bpy.ops.object.mode_set(mode=mode)
        bpy.context.view_layer.update()


@pytest.mark.parametrize(
    ("prepare", "route"),
    halved([(_in_front, "evaluation"), (_with_keys, "update")]),
    indirect=["route"],
)
@pytest.mark.usefixtures("route")
def test_clicks_among_everything_else(prepare, rendered_points, tmp_path):
    """A long walk: clicks, Sinew off and on, saving and loading, undo, duplicates, modes."""
    character, rule, dice = Character(prepare), Rule(), random.Random(7)
    others = (_switch, _reopen, _undo, _duplicate, _paint, _edit)
    for step in range(60):
        chosen = dice.choice(CLICKS)
        if step % 2:
            dice.choice(others)(character, rule, chosen, tmp_path / "arm.blend")
        else:
            character.click(*chosen)
            rule.click(*chosen)
        character.check(rule, rendered_points if step % 5 == 0 else None)
    attach.remove(character.obj)
    assert character.icons() == {"Armature": rule.icons()["Armature"]}


@pytest.mark.parametrize("shown", [(False, False), (True, False), (False, True)])
def test_add_to_what_is_off(shown, rendered_points, capfd):
    """Off in both views, Sinew deforms in both and says so; off in one, it deforms in the other."""
    obj, _armature = scenes.make_arm()
    bpy.context.scene.frame_set(9)
    modifier = obj.modifiers["Armature"]
    modifier.use_deform_preserve_volume = True
    shapes = {True: scenes.final_points(obj), False: scenes.rest_points(obj)}
    modifier.show_viewport, modifier.show_render = shown
    bpy.ops.sinew.add()
    printed, deforms = capfd.readouterr().out, shown if any(shown) else (True, True)
    near = scenes.TOLERANCE * scenes.diagonal(obj)
    assert scenes.worst(scenes.final_points(obj), shapes[deforms[0]]) <= near
    assert scenes.worst(rendered_points(obj), shapes[deforms[1]]) <= near
    assert ("was off before Sinew" in printed) == (not any(shown))
    assert ("Not deformed" in state_text.sentence_of(obj)) == any(shown)
    properties.of(obj).enabled = False
    assert (modifier.show_viewport, modifier.show_render) == deforms
    properties.of(obj).enabled = True
    # Sinew deforms wherever the Armature modifier is switched on.
    modifier.show_viewport = modifier.show_render = True
    bpy.context.view_layer.update()
    assert scenes.worst(scenes.final_points(obj), shapes[True]) <= near
    assert scenes.worst(rendered_points(obj), shapes[True]) <= near
    bpy.ops.sinew.remove()
    assert (modifier.show_viewport, modifier.show_render) == (shown if not any(shown) else (True, True))


@pytest.mark.parametrize("kind", ["shape-keys", "mdd"])
def test_add_to_a_bake(kind, tmp_path, capfd):
    """What was baked is off while Sinew is on, and plays again without it."""
    obj, _armature = scenes.make_arm()
    other = scenes.copied(obj, "Other")
    path = scenes.save(tmp_path / "arm.blend")
    linear, both = (scenes.modifier_shapes(obj, [1, 6, 11], volume) for volume in (False, True))
    scenes.add_sinew(obj, "dq")
    assert bpy.ops.sinew.bake(kind=kind) == {"FINISHED"}
    near = scenes.TOLERANCE * scenes.diagonal(obj)
    for _again in range(2):
        capfd.readouterr()
        assert bpy.ops.sinew.add(method="lbs") == {"FINISHED"}
        printed = capfd.readouterr().out
        assert "Arm: Its Armature modifier was off before Sinew" in printed
        assert ("are muted" if kind == "shape-keys" else "plays baked shapes") in printed
        assert "Other:" not in printed
        assert scenes.worst(scenes.shapes(obj, [1, 6, 11]), linear) <= near
        assert scenes.worst(scenes.shapes(other, [1, 6, 11]), linear) <= near
        bpy.ops.sinew.use_method(method="dq")
        assert scenes.worst(scenes.shapes(obj, [1, 6, 11]), both) <= near
        obj, other = scenes.reopened(path), bpy.data.objects["Other"]
        assert scenes.worst(scenes.shapes(obj, [1, 6, 11]), both) <= near
        bpy.ops.sinew.remove()
        assert scenes.worst(scenes.shapes(obj, [1, 6, 11]), both) <= near
        assert scenes.worst(scenes.shapes(other, [1, 6, 11]), linear) <= near
        assert [(m.show_viewport, m.show_render) for m in obj.modifiers if m.type == "ARMATURE"] == [
            (False, False)
        ]
        assert obj.data.shape_keys is None or not obj.data.shape_keys.keys()
    # A bake of it replaces the one before.
    bpy.ops.sinew.add(method="lbs")
    assert bpy.ops.sinew.bake(kind=kind, overwrite=True) == {"FINISHED"}
    assert scenes.worst(scenes.shapes(obj, [1, 6, 11]), linear) <= near


@pytest.mark.parametrize("view", VIEWS)
def test_keys_on_sinews_icon(view, rendered_points):
    character = Character()
    obj = character.obj
    sinews, frames = obj.modifiers["Sinew"], (9, 10, 11)
    shapes = {frame: scenes.shapes(obj, [frame])[0] for frame in frames}
    sinews.show_viewport = False
    alone = {frame: scenes.shapes(obj, [frame])[0] for frame in frames}
    sinews.show_viewport = True
    scenes.key(sinews, f"show_{view}", ((1, True), (10, False), (11, True)))
    bpy.context.view_layer.update()
    for frame in (9, 10, 11, 10, 9):
        bpy.context.scene.frame_set(frame)
        for each, points in (("viewport", scenes.final_points(obj)), ("render", rendered_points(obj))):
            expected = (alone if each == view and frame == 10 else shapes)[frame]
            assert scenes.worst(points, expected) <= scenes.TOLERANCE * scenes.diagonal(obj)
    attach.remove(obj)
    assert character.icons() == {"Armature": (True, True)}


def test_sinews_icon_for_edit_mode_goes_off_again():
    character, rule = Character(), Rule()
    own = character.obj.modifiers["Sinew"]
    for modifier in ("Armature", "Sinew", "Armature", "Sinew"):
        own.show_in_editmode = True
        for _at_once in range(2):
            character.click(modifier, "viewport")
            rule.click(modifier, "viewport")
        character.click(modifier, "render")
        rule.click(modifier, "render")
        character.check(rule)
        assert not own.show_in_editmode


def test_stages_change_nothing_where_nothing_deforms(route):
    """Delta Mush would smooth what a shape key makes."""
    obj, _armature = scenes.make_arm()
    scenes.key_shape(obj, (1.0, 1.0, 1.5))
    bpy.context.scene.frame_set(9)
    obj.modifiers["Armature"].show_viewport = False
    expected = scenes.final_points(obj)
    scenes.add_sinew(obj, "dq")
    properties.of(obj).delta_mush.enabled = True
    assert scenes.worst(scenes.final_points(obj), expected) <= 1e-6
    obj.modifiers["Armature"].show_viewport = True
    assert scenes.worst(scenes.final_points(obj), expected) > 1e-3


@pytest.mark.usefixtures("route")
@pytest.mark.parametrize("view", VIEWS)
def test_keys_on_the_icon_of_a_modifier_behind(view, rendered_points):
    """They are no reason to deform where the Armature modifier is off."""
    character = Character(lambda obj: obj.modifiers.new("Behind", "MIRROR"))
    obj, other = character.obj, VIEWS[view == "viewport"]
    scenes.key(obj.modifiers["Behind"], "show_viewport", ((1, True), (10, True)))
    character.click("Armature", view)
    bpy.context.scene.frame_set(9)
    points = {"viewport": scenes.final_points(obj), "render": rendered_points(obj)}
    for each, expected in ((view, NOTHING), (other, SINEW)):
        assert points[each].shape == character.shapes[expected].shape
        assert scenes.worst(points[each], character.shapes[expected]) <= 1e-5
