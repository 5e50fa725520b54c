# SPDX-License-Identifier: GPL-3.0-or-later
"""Compare in the viewport: copies show the shape of each method, and leave nothing behind."""

from __future__ import annotations

import bpy
import five_meshes
import numpy as np
import pytest
import scenes
import sinew_addon
import whole_file
from program import run_sinew
from sinew_addon.attach import attach, normals, properties
from sinew_addon.deform import characters, session
from sinew_addon.features.compare import comparison_labels, comparison_state
from sinew_addon.io import files
from sinew_addon.ui import operators

pytestmark = pytest.mark.outer_versions

METHODS = characters.method_names()
# The copies' coordinates are larger than the original's by the offset.
TOLERANCE = 1e-6


def compare(obj: bpy.types.Object, methods: set[str] | None = None) -> comparison_state.SinewComparison:
    five_meshes.select(obj)
    assert bpy.ops.sinew.compare(methods=methods or set(METHODS)) == {"FINISHED"}
    return state()


def state() -> comparison_state.SinewComparison:
    return comparison_state.of_scene(bpy.context.scene)


def copies(obj: bpy.types.Object) -> dict[str, bpy.types.Object]:
    """The copies of one object, by method."""
    return {
        properties.of(copy).identity.method: copy
        for copy in comparison_state.copies_of(state())
        if properties.of(copy).identity.copied == obj
    }


def without_offset(copy: bpy.types.Object, place: int) -> np.ndarray:
    """A copy's final points, moved to the original's position, object space."""
    matrix = np.array(scenes.evaluated(copy).matrix_world)
    offset = place * state().spacing * np.array(state().axis)
    return scenes.final_points(copy) - np.linalg.solve(matrix[:3, :3], offset)


def assert_copies_show(obj: bpy.types.Object, frames: list[int], expected: dict[str, np.ndarray]) -> None:
    for number, frame in enumerate(frames):
        bpy.context.scene.frame_set(frame)
        for place, (method, copy) in enumerate(copies(obj).items(), start=1):
            assert properties.of(copy).error == ""
            got = without_offset(copy, place)
            # The offset is rounded to 6e-8 of itself: for the last of many methods it is ten times the mesh's
            # size.
            size = scenes.diagonal(obj) + 0.1 * place * state().spacing
            if copy.modifiers[-1].type == "SUBSURF":
                # Rounding happens at the copy's position.
                size += place * state().spacing
            assert scenes.worst(got, expected[method][number]) <= TOLERANCE * size, method


def shapes_of_methods(obj: bpy.types.Object, frames: list[int]) -> dict[str, np.ndarray]:
    """The shape that Sinew makes of the object itself; restores it afterwards."""
    skinned, method = (
        properties.has_sinew(obj),
        properties.of(obj).method if obj.is_property_set("sinew") else "",
    )
    found = {characters.BLENDER: scenes.shapes(obj, frames)} if not skinned else {}
    for name in METHODS[:-1]:
        characters.use_method(obj, name)
        found[name] = scenes.shapes(obj, frames)
    if skinned:
        characters.use_method(obj, characters.BLENDER)
        found[characters.BLENDER] = scenes.shapes(obj, frames)
        characters.use_method(obj, method)
    else:
        attach.remove(obj)
    return found


def assert_ends_without_trace(before: dict[str, object]) -> None:
    assert bpy.ops.sinew.end_comparison() == {"FINISHED"}
    whole_file.assert_same(before)


def turned_and_scaled(obj: bpy.types.Object, armature: bpy.types.Object) -> None:
    obj.rotation_euler, obj.scale, obj.location = (0.3, 0.5, 1.0), (1.0, 2.0, 0.5), (3.0, 1.0, 2.0)
    armature.rotation_euler, armature.scale = (1.0, 0.2, 0.0), (0.7, 0.7, 0.7)


def moving(obj: bpy.types.Object, armature: bpy.types.Object) -> None:
    obj.parent = armature
    scenes.key(armature, "rotation_euler", ((1, (0.0, 0.0, 0.0)), (11, (0.0, 2.0, 2.0))))
    scenes.key(armature, "location", ((1, (0.0, 0.0, 0.0)), (11, (2.0, 0.0, 0.0))))


def subdivided_behind(obj: bpy.types.Object, _armature: bpy.types.Object) -> None:
    obj.modifiers.new("Behind", "SUBSURF")
    cast = obj.modifiers.new("Pinned", "CAST")
    cast.factor, cast.use_pin_to_last = 0.2, True


def subdivided_last(obj: bpy.types.Object, _armature: bpy.types.Object) -> None:
    obj.modifiers.new("Cast", "CAST").factor = 0.2
    obj.modifiers.new("Last", "SUBSURF")


def two_modifiers(obj: bpy.types.Object, armature: bpy.types.Object) -> None:
    second = obj.modifiers.new("Multi", "ARMATURE")
    second.object, second.use_multi_modifier, second.vertex_group = armature, True, "bone.1"


SETUPS = {
    "plain": lambda obj, armature: None,
    "turned and scaled": turned_and_scaled,
    "moving": moving,
    "subdivided behind": subdivided_behind,
    "subdivided last": subdivided_last,
    "mirrored in front": lambda obj, armature: setattr(
        scenes.put_in_front(obj, "MIRROR"), "use_axis", (False, False, True)
    ),
    "with shape keys": lambda obj, armature: scenes.key_shape(obj),
    "parent deforms": scenes.deform_by_parent,
    "two modifiers": two_modifiers,
    "shared mesh": lambda obj, armature: scenes.copied(obj, linked=True),
}


@pytest.mark.parametrize(
    ("set_up", "skinned"),
    [
        *((set_up, False) for set_up in SETUPS),
        ("plain", True),
        *(
            pytest.param(set_up, True, marks=pytest.mark.slow)
            for set_up in ("mirrored in front", "two modifiers")
        ),
    ],
)
def test_rigs(set_up, skinned):
    obj, armature = scenes.make_arm(sides=8, rings=11)
    SETUPS[set_up](obj, armature)
    if skinned:
        scenes.add_sinew(obj, "dq")
        properties.of(obj).scale_rule = "3.x"
        bpy.context.scene.frame_set(1)
    bpy.context.scene.frame_set(2)
    expected = shapes_of_methods(obj, [1, 6, 11])
    bpy.context.scene.frame_set(2)
    before = whole_file.content()
    compare(obj)
    assert_copies_show(obj, [1, 6, 11], expected)
    bpy.context.scene.frame_set(2)
    assert_ends_without_trace(before)


def test_other_methods_replace_the_copies():
    obj, _armature = scenes.make_arm()
    before = whole_file.content()
    compare(obj, {"dq"})
    assert bpy.ops.sinew.compare(methods={"lbs", "qv"}) == {"FINISHED"}
    assert list(copies(obj)) == ["lbs", "qv"]
    assert (state().first, state().second) == ("lbs", "qv")
    state().arrangement = comparison_state.OVERLAID
    # Nothing is selected: compares again what is compared already.
    obj.select_set(False)
    bpy.context.view_layer.objects.active = None
    assert bpy.ops.sinew.compare(methods={"blender"}) == {"FINISHED"}
    assert list(copies(obj)) == ["blender"]
    assert (state().first, state().second) == ("blender", "blender")
    assert state().arrangement == comparison_state.OVERLAID
    assert scenes.worst(without_offset(copies(obj)["blender"], 1), scenes.final_points(obj)) <= 1e-6
    compare(obj)
    assert (state().first, state().second) == ("lbs", METHODS[-2])
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
    assert_ends_without_trace(before)


def delete(*objects: bpy.types.Object) -> None:
    """As the artist does."""
    with bpy.context.temp_override(selected_objects=list(objects)):
        assert bpy.ops.object.delete() == {"FINISHED"}


@pytest.mark.parametrize("set_up", ["plain", "mirrored in front"])
def test_copies_that_the_artist_deletes_renames_and_moves(set_up):
    obj, armature = scenes.make_arm()
    SETUPS[set_up](obj, armature)
    bpy.context.scene.frame_set(1)
    before = whole_file.content()
    compare(obj)
    lbs, qv, dq = (copies(obj)[name] for name in ("lbs", "qv", "dq"))
    delete(lbs)
    qv.name = "My favourite"
    bpy.context.scene.collection.objects.link(dq)
    state().collection.objects.unlink(dq)
    state().collection.name = "Mine"
    lamp = bpy.data.objects.new("Lamp", None)
    state().collection.objects.link(lamp)
    bpy.context.scene.frame_set(11)
    assert comparison_state.methods_of(state()) == [m for m in METHODS if m not in ("lbs", "dq")]
    bpy.context.scene.frame_set(1)
    assert bpy.ops.sinew.end_comparison() == {"FINISHED"}
    # What the artist put into the collection stays in the scene.
    assert list(lamp.users_collection) == [bpy.context.scene.collection]
    bpy.data.objects.remove(lamp)
    whole_file.assert_same(before)


@pytest.mark.parametrize("copies_too", [False, True], ids=["collection", "copies"])
def test_the_comparison_after_its_collection_was_deleted(copies_too):
    obj, armature = scenes.make_arm()
    SETUPS["mirrored in front"](obj, armature)
    bpy.context.scene.frame_set(1)
    before = whole_file.content()
    compare(obj)
    if copies_too:
        delete(*copies(obj).values())
    bpy.data.collections.remove(state().collection)
    bpy.context.scene.frame_set(5)
    bpy.context.scene.frame_set(1)
    assert comparison_labels.labels(bpy.context) == []
    assert_ends_without_trace(before)


@pytest.mark.parametrize("skinned", [False, True], ids=["plain", "skinned"])
def test_the_original_is_deleted(tmp_path, skinned):
    obj, _armature = scenes.make_arm()
    if skinned:
        scenes.add_sinew(obj, "dq")
    path = scenes.save(tmp_path / "arm.blend")

    def opened() -> bpy.types.Object:
        files.open_file(path)
        return bpy.data.objects["Arm"]

    delete(opened())
    for mesh in bpy.data.meshes:
        # Those of a deleted object with Sinew; ending its comparison removes them, too.
        for name in [each.name for each in mesh.attributes if each.name.lstrip(".").startswith("sinew")]:
            mesh.attributes.remove(mesh.attributes[name])
    before = whole_file.content()
    obj = opened()
    compare(obj)
    delete(obj)
    bpy.context.scene.frame_set(5)
    bpy.context.scene.frame_set(1)
    assert bpy.ops.sinew.end_comparison() == {"FINISHED"}
    whole_file.assert_same(before)


def test_keys_of_the_method_are_the_originals_own():
    obj, _armature = scenes.skinned_arm("dq")
    scenes.key(properties.of(obj), "method", ((1, "dq"), (5, "lbs")))
    obj.keyframe_insert('modifiers["Armature"].show_expanded', frame=5)
    bpy.context.scene.frame_set(1)
    before = whole_file.content()
    compare(obj, {"qv", "dq"})
    bpy.context.scene.frame_set(11)
    got = without_offset(copies(obj)["dq"], 1)
    bpy.context.scene.frame_set(1)
    assert_ends_without_trace(before)
    attach.remove(obj)
    dq = scenes.modifier_shapes(obj, [11], preserve_volume=True)[0]
    assert scenes.worst(got, dq) <= scenes.TOLERANCE * scenes.diagonal(obj)


def test_clothes_stand_with_their_body():
    body, armature = scenes.make_arm()
    shirt = scenes.copied(body, "Shirt")
    hidden = scenes.copied(body, linked=True)
    hidden.hide_set(True)
    other, _other_armature = scenes.make_arm(name="Other")
    shirt.location.x = 3.0
    compare(shirt, {"lbs", "dq"})
    assert set(copies(body)) == set(copies(shirt)) == {"lbs", "dq"}
    assert not copies(hidden)
    assert not copies(other)
    assert state().spacing > 5.0
    for place, method in enumerate(("lbs", "dq"), 1):
        for obj in (body, shirt):
            moved = scenes.final_points(copies(obj)[method]) - scenes.final_points(obj)
            assert np.allclose(moved, (place * state().spacing, 0.0, 0.0), atol=1e-5)
    # Even with an armature, copies are not characters.
    compare(armature, {"dq"})
    assert set(operators.targets(bpy.context)) == {body, shirt, hidden}


def test_eyes_on_a_bone_stand_with_their_body():
    body, armature = scenes.make_arm()
    eye = scenes.added("Eye", body.data.copy())
    holder = scenes.added("Holder", None)
    eye.parent = holder
    holder.parent, holder.parent_type, holder.parent_bone = armature, "BONE", "bone.1"
    before = whole_file.content()
    compare(body, {"lbs", "dq"})
    for frame in (1, 11):
        bpy.context.scene.frame_set(frame)
        assert set(copies(eye)) == {"lbs", "dq"}
        for place, copy in enumerate(copies(eye).values(), 1):
            moved = characters.world_points([copy]) - characters.world_points([eye])
            assert np.allclose(moved, (place * state().spacing, 0.0, 0.0), atol=1e-5)
    bpy.context.scene.frame_set(1)
    assert_ends_without_trace(before)
    # An armature that deforms nothing has no character.
    delete(body)
    bpy.context.view_layer.objects.active = armature
    with pytest.raises(RuntimeError, match="deforms no mesh"):
        bpy.ops.sinew.compare()


def test_overlay_and_flip():
    obj, _armature = scenes.make_arm()
    compare(obj, {"lbs", "qv", "dq"})
    lbs, qv, dq = (copies(obj)[name] for name in ("lbs", "qv", "dq"))
    state().arrangement = comparison_state.OVERLAID
    assert state().collection.hide_render
    for copy in (lbs, qv, dq):
        assert copy.visible_get()
        assert copy.hide_select
        assert scenes.worst(without_offset(copy, 1), scenes.final_points(obj)) <= scenes.TOLERANCE * 2
    bpy.ops.sinew.flip_comparison()
    assert [copy.visible_get() for copy in (lbs, qv, dq)] == [True, False, False]
    bpy.ops.sinew.flip_comparison()
    assert [copy.visible_get() for copy in (lbs, qv, dq)] == [False, True, False]
    bpy.context.scene.frame_set(11)
    turned = without_offset(qv, 1)
    state().second = "dq"
    assert [copy.visible_get() for copy in (lbs, qv, dq)] == [False, False, True]
    assert scenes.worst(without_offset(dq, 1), turned) > 0.01
    # An object that was hidden while the frame changed.
    bpy.ops.sinew.flip_comparison()
    assert [copy.visible_get() for copy in (lbs, qv, dq)] == [True, False, False]
    assert scenes.worst(without_offset(lbs, 1), scenes.final_points(obj)) <= scenes.TOLERANCE * 2
    state().arrangement = comparison_state.SIDE_BY_SIDE
    assert all(copy.visible_get() for copy in (lbs, qv, dq))
    state().spacing = 7.0
    assert scenes.worst(without_offset(qv, 3), turned) <= 1e-5
    assert obj.visible_get()


def test_labels_stand_over_the_characters():
    obj, _armature = scenes.skinned_arm("qv")
    compare(obj, {"lbs", "dq"})
    bpy.context.scene.frame_set(11)
    with bpy.context.temp_override(scene=bpy.context.scene):
        found = comparison_labels.labels(bpy.context)
    names = [text for text, _colour, _place in found]
    assert names == ["Original: Quaternion-Vector", "Linear Blend", "Dual Quaternion"]
    for (_text, _colour, place), shown in zip(found, (obj, *copies(obj).values()), strict=True):
        points = characters.world_points([shown])
        middle = (points.min(axis=0) + points.max(axis=0)) / 2
        assert np.allclose(place, (*middle[:2], points[:, 2].max()), atol=1e-4)


def test_simulations_stay_with_the_original():
    obj, _armature = scenes.make_arm()
    for kind in ("CLOTH", "COLLISION"):
        obj.modifiers.new(kind, kind)
    obj.modifiers.new("Behind", "SUBSURF")
    compare(obj, {"dq", "blender"})
    for copy in copies(obj).values():
        assert {m.type for m in scenes.modifiers(copy)} == {"ARMATURE", "SUBSURF", "NODES"}


def test_what_can_not_be_compared():
    obj, _armature = scenes.make_arm()
    scenes.put_in_front(obj, "CLOTH", "Cloth")
    before = whole_file.content()
    with pytest.raises(RuntimeError, match="simulation"):
        compare(obj)
    with pytest.raises(RuntimeError, match="at least one method"):
        bpy.ops.sinew.compare(methods=set())
    whole_file.assert_same(before)
    fine, armature = scenes.make_arm(name="Fine")
    obj.modifiers["Armature"].object = armature
    compare(armature, {"dq"})
    assert list(copies(fine)) == ["dq"]
    assert not copies(obj)


def test_a_linked_character(tmp_path):
    """Without an override Sinew can not deform it; its copies are local."""
    obj, _armature = scenes.make_arm()
    expected = shapes_of_methods(obj, [1, 11])
    scenes.save(tmp_path / "library.blend")
    obj, _armature = scenes.link(tmp_path / "library.blend", "Arm", "Arm Rig")
    before = whole_file.content()
    compare(obj)
    assert_copies_show(obj, [1, 11], expected)
    bpy.context.scene.frame_set(1)
    assert bpy.ops.sinew.end_comparison() == {"FINISHED"}
    changed = whole_file.differences(before, whole_file.content())
    # Blender's record that something local used the linked mesh.
    assert [line for line in changed if "is_library_indirect" not in line] == []


def test_without_sinew_the_file_opens(tmp_path):
    """The copies in a saved comparison keep their positions, and have Blender's most similar shapes."""
    obj, _armature = scenes.make_arm()
    bpy.context.scene.frame_set(11)
    compare(obj, {"lbs", "dq"})
    shown = {copy.name: scenes.final_points(copy) for copy in copies(obj).values()}
    path = scenes.save(tmp_path / "compared.blend")
    sinew_addon.unregister()
    try:
        files.open_file(path)
        for name, points in shown.items():
            assert scenes.worst(scenes.final_points(bpy.data.objects[name]), points) <= 1e-5
            assert bpy.data.objects[name].modifiers["Armature"].object is not None
    finally:
        sinew_addon.register()
    bpy.ops.sinew.end_comparison()
    assert [o.name for o in bpy.data.objects if o.type == "MESH"] == ["Arm"]


def test_commands_leave_copies_out(tmp_path):
    """Also if they show every collection to take pictures."""
    obj, _armature = scenes.make_arm()
    compare(obj, {"qv", "dq"})
    path = scenes.save(tmp_path / "compared.blend")
    files.open_file(path)
    assert [o.name for o in characters.deformed_meshes(bpy.context.scene)] == ["Arm"]
    assert not state().collection.hide_render
    assert all(
        copy.hide_render and not copy.visible_get() for copy in copies(bpy.data.objects["Arm"]).values()
    )
    run_sinew("points", path, "--method", "dq", "--frames", "11", "--out", tmp_path / "points.npz")
    with np.load(tmp_path / "points.npz") as found:
        assert not [name for name in found.files if "Quaternion" in name]


def test_restore_ends_a_comparison(tmp_path):
    obj, _armature = scenes.skinned_arm("dq")
    compare(obj, {"qv"})
    path = scenes.save(tmp_path / "input" / "compared.blend")
    run_sinew("restore", path, "--out", tmp_path / "restored")
    files.open_file(tmp_path / "restored" / "compared.blend")
    assert [o.name for o in bpy.data.objects if o.type == "MESH"] == ["Arm"]
    assert not bpy.data.node_groups


def names() -> set[str]:
    kinds = ("objects", "collections", "meshes", "node_groups", "actions", "scenes")
    return {f"{kind} {each.name}" for kind in kinds for each in getattr(bpy.data, kind)}


def remove(_obj):
    assert bpy.ops.sinew.remove() == {"FINISHED"}


def delete_character(obj):
    bpy.data.batch_remove([obj, attach.armature_of(obj)])


def delete_by_hand(obj):
    """As the key X does."""
    five_meshes.select(obj, attach.armature_of(obj))
    bpy.ops.object.delete()


def delete_armature(obj):
    five_meshes.select(attach.armature_of(obj))
    bpy.ops.object.delete()


def delete_modifier(obj):
    """While Sinew is off, Sinew goes with it: its handler finds out."""
    properties.of(obj).enabled = False
    obj.modifiers.remove(obj.modifiers["Armature"])


def delete_scene(_obj):
    bpy.data.scenes.new("Other")
    bpy.data.scenes.remove(bpy.context.scene)


@pytest.mark.parametrize(
    "act", [remove, delete_character, delete_by_hand, delete_armature, delete_modifier, delete_scene]
)
def test_a_comparison_ends_with_its_character(act, tmp_path):
    obj, _armature = scenes.skinned_arm()
    before = names()
    compare(obj, {"lbs", "dq", "cor"})
    bpy.context.scene.frame_set(8)
    act(obj)
    bpy.context.view_layer.update()
    # Without a window, what was deleted is followed before the file is saved.
    scenes.save(tmp_path / "a.blend")
    assert [each.name for each in bpy.data.objects if properties.is_copy(each)] == []
    # What belongs to the mesh itself goes with Remove.
    if act is delete_armature:
        attach.remove(obj)
    assert names() - before == ({"scenes Other"} if act is delete_scene else set())
    assert state() is None


def test_a_comparison_stays_with_what_is_left_of_its_character():
    armature = five_meshes.make(vertices=200)
    first, second = (bpy.data.objects[name] for name in five_meshes.MESHES[:2])
    five_meshes.select(armature)
    bpy.ops.sinew.add()
    compare(first, {"dq"})
    attach.remove(first)
    bpy.data.objects.remove(second)
    bpy.context.view_layer.update()
    assert state() is not None
    assert set(copies(first)) == {"dq"}


@pytest.mark.skipif(not normals.ARE_SUPPORTED, reason="Blender takes no normals that are given")
def test_copies_are_no_reason_for_blender_to_compute_normals():
    obj, _armature = scenes.skinned_arm("dq")
    obj.data.shade_smooth()
    properties.of(obj).normals = properties.BY_SINEW
    assert session.plan_of(obj).normals_reason == ""
    compare(obj, {"lbs", "cor"})
    bpy.context.scene.frame_set(5)
    assert (session.plan_of(obj).normals_reason, session.plan_of(obj).normals.domain) == ("", "POINT")
