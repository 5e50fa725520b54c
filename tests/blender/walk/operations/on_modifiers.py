# SPDX-License-Identifier: GPL-3.0-or-later
"""The stack of modifiers."""

from __future__ import annotations

import random

import bpy
from walk_sides import animated_paths, armature_modifiers, has_scaled_bones, key
from walker import SHAPED, NothingError, Walker, operation

KINDS = (
    *("SUBSURF", "CAST", "MIRROR", "SMOOTH", "ARMATURE", "WAVE", "SOLIDIFY", "MASK"),
    *("TRIANGULATE", "DECIMATE", "VERTEX_WEIGHT_EDIT", "HOOK", "NODES"),
)
# After these modifiers, the result depends on the last bit of the shape.
IN_FRONT = ("DECIMATE", "VERTEX_WEIGHT_EDIT")


def _make_nodes(name: str) -> bpy.types.NodeTree:
    """Moves vertices by half of their normals."""
    group = bpy.data.node_groups.new(name, "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    kinds = (
        *("NodeGroupInput", "GeometryNodeSetPosition", "NodeGroupOutput"),
        *("GeometryNodeInputNormal", "ShaderNodeVectorMath"),
    )
    source, move, out, normal, scale = (group.nodes.new(kind) for kind in kinds)
    scale.operation = "SCALE"
    scale.inputs["Scale"].default_value = 0.05
    group.links.new(normal.outputs["Normal"], scale.inputs[0])
    group.links.new(scale.outputs["Vector"], move.inputs["Offset"])
    group.links.new(source.outputs["Geometry"], move.inputs["Geometry"])
    group.links.new(move.outputs["Geometry"], out.inputs["Geometry"])
    return group


def _set_up(
    modifier: bpy.types.Modifier,
    w: Walker,
    r: random.Random,
    obj: bpy.types.Object,
    rig: bpy.types.Object | None,
) -> None:
    if modifier.type == "SUBSURF":
        modifier.levels = modifier.render_levels = 1
    elif modifier.type == "ARMATURE":
        modifier.object = rig
        w.side.set_preserve_volume(modifier, r.random() < 0.3)
    elif modifier.type == "WAVE":
        modifier.time_offset = -10.0
    elif modifier.type == "MASK" and obj.vertex_groups:
        modifier.vertex_group = w.one(r, obj.vertex_groups).name
        modifier.invert_vertex_group = True
    elif modifier.type == "DECIMATE":
        modifier.ratio = 0.7
    elif modifier.type == "VERTEX_WEIGHT_EDIT" and obj.vertex_groups:
        modifier.vertex_group, modifier.falloff_type = w.one(r, obj.vertex_groups).name, "SMOOTH"
    elif modifier.type == "HOOK":
        # After Geometry Nodes, Blender uses the first vertices as if they were those of a list.
        modifier.object, modifier.strength = rig, 0.3
        modifier.vertex_group = w.one(r, obj.vertex_groups).name if obj.vertex_groups else ""
    elif modifier.type == "NODES":
        modifier.node_group = _make_nodes(modifier.name)


@operation(3)
def add_modifier(w: Walker, r: random.Random) -> None:
    obj, rig = w.mesh(r), w.armature(r)
    kind, front = r.choice(KINDS), r.random() < 0.4
    w.skip_if(len(w.modifiers(obj)) > 5)
    once = ("SUBSURF", "MIRROR", "SOLIDIFY", *IN_FRONT)
    w.skip_if(kind in once and any(m.type == kind for m in w.modifiers(obj)))
    front |= kind in IN_FRONT
    w.skip_if(kind in ("HOOK", *IN_FRONT) and (obj.override_library is not None or not obj.vertex_groups))
    w.skip_if(kind == "DECIMATE" and obj.data.get(SHAPED))
    modifier = obj.modifiers.new(w.new_name(kind.title()), kind)
    w.skip_if(modifier is None)
    if kind == "TRIANGULATE":
        # Where both diagonals of a quad are as long, rounding would choose one.
        modifier.quad_method = "FIXED"
    _set_up(modifier, w, r, obj, rig)
    if front and obj.override_library is None:
        obj.modifiers.move(list(obj.modifiers).index(modifier), 0)
    elif kind == "HOOK":
        # Blender puts it after modifiers that only deform, which Sinew's is not (docs/parity.md).
        obj.modifiers.move(list(obj.modifiers).index(modifier), len(obj.modifiers) - 1)


@operation(0.4)
def hair(w: Walker, r: random.Random) -> None:
    """Hair on a mesh. Its roots can be elsewhere behind Sinew, which has to say so; the mesh is the same."""
    obj = w.mesh(r, lambda o: w.is_editable(o) and o.mode == "OBJECT" and not o.data.is_editmode)
    source = r.choice(("VERT", "FACE"))
    there = next((m for m in w.modifiers(obj) if m.type == "PARTICLE_SYSTEM"), None)
    if there is not None:
        obj.modifiers.remove(there)
        return
    modifier = obj.modifiers.new(w.new_name("Hair"), "PARTICLE_SYSTEM")
    settings = modifier.particle_system.settings
    settings.type, settings.count, settings.emit_from = "HAIR", 5, source
    w.side.check_warned(obj, modifier)


@operation(0.4)
def needs_original_mesh(w: Walker, r: random.Random) -> None:
    """A modifier in front of which Sinew's can not be comes and goes, as for a sculpted character."""
    obj = w.mesh(r, lambda o: w.is_editable(o) and o.mode == "OBJECT" and not o.data.is_editmode)
    kind = r.choice(("MULTIRES", "SOFT_BODY"))
    modifier = obj.modifiers.new(w.new_name("Original"), kind)
    w.skip_if(modifier is None)
    w.side.check_refused(obj, modifier)
    obj.modifiers.remove(modifier)
    if w.side.has_sinew(obj):
        w.side.rebind(obj)


@operation(2)
def move_modifier(w: Walker, r: random.Random) -> None:
    """Moves it to just before or after another one of the artist's; Sinew's is not counted."""
    obj = w.mesh(r, lambda o: len(w.modifiers(o)) > 1 and o.override_library is None)
    w.skip_if(any(m.type in IN_FRONT for m in w.modifiers(obj)))
    here, there = r.sample(w.modifiers(obj), 2)
    names = [m.name for m in obj.modifiers]
    obj.modifiers.move(names.index(here.name), names.index(there.name))


@operation(1)
def delete_modifier(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: bool(w.modifiers(o)) and o.override_library is None and w.may_lose_sinew(o))
    # Rarely the last Armature modifier, since few operations remain for an object without any.
    candidates = [m for m in w.modifiers(obj) if m.type != "ARMATURE" or r.random() < 0.3]
    modifier = w.one(r, candidates)
    if modifier.type == "ARMATURE":
        w.side.delete_part(obj, "armature modifier")
    obj.modifiers.remove(modifier)


@operation(1)
def rename_modifier(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: bool(w.modifiers(o)) and o.override_library is None)
    w.one(r, w.modifiers(obj)).name = w.new_name("modifier")


@operation(2)
def toggle_modifier(w: Walker, r: random.Random) -> None:
    """Excludes those that Sinew has replaced, whose flags it stores."""
    obj = w.mesh(r)
    modifier = w.one(r, [m for m in w.modifiers(obj) if m.type != "ARMATURE" or not w.side.has_sinew(obj)])
    on = not modifier.show_viewport
    modifier.show_viewport = on
    if r.random() < 0.6:
        modifier.show_render = on


@operation(2)
def armature_options(w: Walker, r: random.Random) -> None:
    obj = w.skinned(r)
    modifier = w.one(r, armature_modifiers(obj))
    what = r.choice(("multi", "mask", "mask", "invert", "envelopes", "groups", "volume"))
    if what == "multi":
        modifier.use_multi_modifier = not modifier.use_multi_modifier
    elif what == "mask":
        group = w.one_or_none(r, obj.vertex_groups) if r.random() < 0.6 else None
        modifier.vertex_group = group.name if group is not None else ""
    elif what == "invert":
        modifier.invert_vertex_group = not modifier.invert_vertex_group
    elif what == "envelopes":
        modifier.use_bone_envelopes = not modifier.use_bone_envelopes
    elif what == "groups":
        modifier.use_vertex_groups = not modifier.use_vertex_groups
    # In a mode of the modifier, Sinew controls it temporarily, and switching it has another meaning.
    elif obj.mode in {"EDIT", "SCULPT"} or obj.data.is_editmode:
        raise NothingError
    else:
        w.side.set_preserve_volume(modifier, not w.side.preserve_volume(modifier))


@operation(0.7)
def key_modifier(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: o.override_library is None and not w.shares_action(o))
    modifier = w.one(r, [m for m in w.modifiers(obj) if m.type in ("CAST", "SMOOTH")])
    frames = sorted(r.sample(range(1, 12), 2))
    key(obj, modifier.path_from_id("factor"), [(frames[0], r.random()), (frames[1], r.random())])
    w.this_frame()


@operation(0.5)
def key_option(w: Walker, r: random.Random) -> None:
    """Keys an option of an Armature modifier that Sinew reads when it is bound."""
    obj = w.skinned(r)
    w.skip_if(obj.override_library is not None or w.shares_action(obj))
    modifier = w.one(r, armature_modifiers(obj))
    option = r.choice(("invert_vertex_group", "use_multi_modifier"))
    first, frames = r.random() < 0.5, sorted(r.sample(range(1, 12), 2))
    key(obj, modifier.path_from_id(option), [(frames[0], float(first)), (frames[1], float(not first))])
    w.this_frame()


@operation(1)
def another_armature(w: Walker, r: random.Random) -> None:
    obj, rig = w.skinned(r), w.armature(r)
    w.skip_if(obj.override_library is not None)
    modifier = w.one(r, armature_modifiers(obj))
    modifier.object = rig


@operation(0.7)
def key_visibility(w: Walker, r: random.Random) -> None:
    obj = w.skinned(r)
    w.skip_if(obj.override_library is not None)
    modifier = w.one(r, armature_modifiers(obj))
    path = f'modifiers["{bpy.utils.escape_identifier(modifier.name)}"].show_'
    frames = sorted(r.sample(range(1, 12), 2))
    values = [(frames[0], r.choice((0.0, 1.0))), (frames[1], 1.0)]
    for where in ("viewport", "render"):
        key(obj, path + where, values)
    w.this_frame()


@operation(0.5)
def drive_visibility(w: Walker, r: random.Random) -> None:
    """Sets or removes drivers by an armature's position. Not by a bone's: what follows a bone that was in
    edit mode, Blender does not update until something else changes."""
    obj, rig = w.skinned(r), w.armature(r)
    w.skip_if(obj.override_library is not None)
    modifier = w.one(r, armature_modifiers(obj))
    paths = [modifier.path_from_id(f"show_{where}") for where in ("viewport", "render")]
    # A driver can not set what a curve sets.
    if not animated_paths(obj).isdisjoint(paths):
        for path in paths:
            obj.driver_remove(path)
        modifier.show_viewport = modifier.show_render = True
        return
    for path in paths:
        curve = obj.driver_add(path)
        driver = curve.driver
        driver.type = "SUM"
        variable = driver.variables.new()
        variable.type = "TRANSFORMS"
        target = variable.targets[0]
        target.id, target.transform_type = rig, "LOC_X"
        for each in list(curve.modifiers):
            curve.modifiers.remove(each)
        while curve.keyframe_points:
            curve.keyframe_points.remove(curve.keyframe_points[0])
        for x, value in ((-10.0, 0.0), (-0.3, 1.0)):
            curve.keyframe_points.insert(x, value).interpolation = "CONSTANT"


@operation(0.5)
def copy_modifiers(w: Walker, r: random.Random) -> None:
    meshes = [o for o in w.meshes() if o.override_library is None and not w.side.has_sinew(o)]
    source = w.mesh(r, lambda o: o.override_library is None and not w.side.is_method_keyed(o))
    target = w.one(r, [o for o in meshes if o != source])
    w.skip_if(not w.select(target, source))
    w.skip_if(target.data.get(SHAPED) and any(m.type == "DECIMATE" for m in source.modifiers))
    bpy.ops.object.make_links_data(type="MODIFIERS")
    w.side.copied_modifiers(source, target)


@operation(0.4)
def apply_modifier(w: Walker, r: random.Random) -> None:
    """Applies what deforms, Sinew's modifier or the Armature modifier, after upstream ones."""
    obj = w.mesh(
        r,
        lambda o: (
            not w.compared
            and len(armature_modifiers(o)) == 1
            and w.modifiers(o)[-1].type == "ARMATURE"
            and o.parent_type != "ARMATURE"
            and w.users(o.data) == 1
            and o.data.shape_keys is None
            and o.override_library is None
            and w.side.is_on(o)
            and w.may_lose_sinew(o)
            and not w.side.has_other_shape(o)
            and not has_scaled_bones(o)
        ),
    )
    w.skip_if(not w.select(obj))
    in_front = [modifier.name for modifier in w.modifiers(obj)[:-1]]
    for name in in_front:
        bpy.ops.object.modifier_apply(modifier=name, single_user=True)
    w.before_evaluation()
    # A window has evaluated newly appended objects.
    bpy.context.view_layer.update()
    paths = [
        m.path_from_id(f"show_{where}") for m in armature_modifiers(obj) for where in ("viewport", "render")
    ]
    w.side.apply(obj)
    # Blender leaves drivers of what it applies, though not of what it removes.
    for path in paths:
        obj.driver_remove(path)
    obj.data.name, obj.data[SHAPED] = w.new_name("mesh"), True


@operation(0.4)
def convert_to_mesh(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: w.is_editable(o) and w.may_lose_sinew(o) and not has_scaled_bones(o))
    w.skip_if(w.side.has_other_shape(obj) or not w.select(obj))
    w.before_evaluation()
    bpy.ops.object.convert(target="MESH")
    obj = bpy.context.view_layer.objects.active
    obj.data.name, obj.data[SHAPED] = w.new_name("mesh"), True
    w.side.applied(obj)
