# SPDX-License-Identifier: GPL-3.0-or-later
"""A vertex group that something uses as a mask is no fault, even though no bone has its name."""

from __future__ import annotations

import bpy
import pytest
import scenes
from sinew_addon.deform import session, survey
from sinew_addon.features.diagnose import diagnose
from sinew_addon.features.measure import subjects

pytestmark = pytest.mark.long_term

GROUP = "a mask"


def modifier(kind, field, settings=None):
    def use(obj, armature):
        made = obj.modifiers.new("User", kind)
        setattr(made if settings is None else getattr(made, settings), field, GROUP)

    use.__name__ = f"{kind.lower()} {field}"
    return use


def armature_mask(obj, armature):
    obj.modifiers["Armature"].vertex_group = GROUP


def geometry_nodes_input(obj, armature):
    tree = bpy.data.node_groups.new("Nodes", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    socket = tree.interface.new_socket("Mask", in_out="INPUT", socket_type="NodeSocketFloat")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    made = obj.modifiers.new("Nodes", "NODES")
    made.node_group = tree
    if hasattr(made, "properties"):  # Blender 5.2 moved the inputs
        given = getattr(made.properties.inputs, socket.identifier)
        given.type, given.attribute_name = "ATTRIBUTE", GROUP
    else:
        made[f"{socket.identifier}_use_attribute"] = True
        made[f"{socket.identifier}_attribute_name"] = GROUP


def particles(obj, armature):
    obj.modifiers.new("Hair", "PARTICLE_SYSTEM")
    obj.particle_systems[0].vertex_group_density = GROUP


def dynamic_paint(obj, armature):
    made = obj.modifiers.new("Paint", "DYNAMIC_PAINT")
    bpy.context.view_layer.objects.active = obj
    bpy.ops.dpaint.type_toggle(type="CANVAS")
    made.canvas_settings.canvas_surfaces[0].output_name_a = GROUP


def shape_key(obj, armature):
    obj.shape_key_add(name="Basis")
    obj.shape_key_add(name="Smile").vertex_group = GROUP


def constraint_of_an_object(obj, armature):
    empty = scenes.added("Empty", None)
    made = empty.constraints.new("COPY_LOCATION")
    made.target, made.subtarget = obj, GROUP


def constraint_of_a_bone(obj, armature):
    other, _mesh = scenes.make_arm(name="Other")
    other = bpy.data.objects["Other Rig"]
    made = other.pose.bones[0].constraints.new("DAMPED_TRACK")
    made.target, made.subtarget = obj, GROUP


def bone_of_a_second_armature(obj, armature):
    bpy.context.view_layer.objects.active = other = scenes.make_arm(name="Other")[1]
    other.data.bones[0].name = GROUP
    obj.modifiers.new("Second", "ARMATURE").object = other


USES = [
    armature_mask,
    modifier("SMOOTH", "vertex_group"),
    modifier("DISPLACE", "vertex_group"),
    modifier("MASK", "vertex_group"),
    modifier("SOLIDIFY", "shell_vertex_group"),
    modifier("VERTEX_WEIGHT_MIX", "vertex_group_b"),
    modifier("VERTEX_WEIGHT_EDIT", "mask_vertex_group"),
    modifier("CLOTH", "vertex_group_mass", "settings"),
    modifier("SOFT_BODY", "vertex_group_goal", "settings"),
    geometry_nodes_input,
    particles,
    dynamic_paint,
    shape_key,
    constraint_of_an_object,
    constraint_of_a_bone,
    bone_of_a_second_armature,
]


def reported(obj) -> dict[str, list[str]]:
    """In everything that reports on groups: the panel's facts, Diagnostics, and pages."""
    facts = survey.describe_in_file(obj).warnings
    diagnose.check(bpy.context.scene, [obj], 4)
    found = {finding.name: finding for finding in diagnose.of(obj).findings}
    (part,) = subjects.gather(bpy.context.scene, [obj]).parts
    on_page = {finding.name: finding for finding in part.edited.findings(4)}
    return {
        "facts": [
            name for name in (GROUP, "forgotten") for text in facts if "Groups" in text and name in text
        ],
        "diagnostics": list(found["boneless_groups"].groups) if "boneless_groups" in found else [],
        "page": list(on_page["boneless_groups"].groups) if "boneless_groups" in on_page else [],
    }


@pytest.mark.parametrize("use", USES, ids=lambda use: use.__name__)
def test_what_is_used_is_no_fault(use):
    obj, armature = scenes.make_arm()
    obj.vertex_groups.new(name=GROUP).add([1, 2, 3], 1.0, "REPLACE")
    obj.vertex_groups.new(name="forgotten").add([4], 1.0, "REPLACE")
    assert set(map(tuple, reported(obj).values())) == {(GROUP, "forgotten")}
    use(obj, armature)
    assert set(map(tuple, reported(obj).values())) == {("forgotten",)}


def test_while_sinew_is_at_work():
    obj, _armature = scenes.make_arm()
    obj.vertex_groups.new(name=GROUP).add([1, 2, 3], 1.0, "REPLACE")
    obj.modifiers["Armature"].vertex_group = GROUP
    scenes.add_sinew(obj, "dq")
    assert survey.facts_of(obj, session.skinned_of(obj)).warnings == ()
    obj.modifiers["Armature"].vertex_group = ""
    bpy.context.view_layer.update()
    scenes.rebind(obj)
    assert any(GROUP in warning for warning in survey.facts_of(obj, session.skinned_of(obj)).warnings)
