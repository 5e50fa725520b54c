# SPDX-License-Identifier: GPL-3.0-or-later
"""What artists do with Sinew itself: its settings, its features, characters."""

from __future__ import annotations

import random

import bpy
from walk_sides import METHODS, OF_BLENDER, STAGES, animated_paths, armature_modifiers
from walker import FRAMES, Walker, and_undo, operation, some_vertices

# --- Sinew


def _method(r: random.Random) -> str:
    """Half of the time a method that Blender itself has."""
    return r.choice(OF_BLENDER if r.random() < 0.5 else METHODS[len(OF_BLENDER) :])


def _is_behind_hair(obj: bpy.types.Object) -> bool:
    """Sinew refuses hair in front of the first Armature modifier with an armature, preferably one that is on.
    Where that is animated, which one that is can not be told."""
    kinds = [modifier.type for modifier in obj.modifiers]
    found = [(m, n) for n, m in enumerate(obj.modifiers) if m.type == "ARMATURE" and m.object is not None]
    is_on = [m.show_viewport or m.show_render for m, _number in found]
    is_told = not any(".show_" in path for path in animated_paths(obj))
    chosen = found[is_on.index(True) if True in is_on else 0] if is_told else found[-1]
    return "PARTICLE_SYSTEM" in kinds[: chosen[1]]


@operation(6)
def add(w: Walker, r: random.Random) -> None:
    obj = w.mesh(
        r,
        lambda o: (
            o.parent_type != "ARMATURE"
            and not w.side.has_sinew(o)
            and any(m.object for m in armature_modifiers(o))
            and not _is_behind_hair(o)
        ),
    )
    method, leave = r.choice((None, _method(r))), r.random() < 0.15
    w.object_mode()
    if not any(m.show_viewport or m.show_render for m in armature_modifiers(obj)):
        # Sinew would deform it nevertheless, until it is removed.
        for modifier in armature_modifiers(obj):
            modifier.show_viewport = modifier.show_render = True
    flags = {w.side.preserve_volume(m) for m in armature_modifiers(obj)}
    if len(flags) > 1 and method is None:
        method = "lbs"
    w.side.add(obj, method, leave)


@operation(2)
def remove(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: w.side.has_sinew(o) and o.override_library is None and w.may_lose_sinew(o))
    w.object_mode()
    w.side.remove(obj)


@operation(0.4)
def remove_all(w: Walker, r: random.Random) -> None:
    w.object_mode()
    w.side.end_comparison()
    # Includes objects outside the current view layer.
    for obj in [o for o in w.objects("MESH") if w.side.has_sinew(o) and o.library is None]:
        # An object from a library with Sinew has it again when the file is loaded.
        if obj.override_library is None:
            w.side.remove(obj)
        else:
            w.side.set_enabled(obj, False)


@operation(6)
def method(w: Walker, r: random.Random) -> None:
    obj, name = w.mesh(r, lambda o: w.side.has_sinew(o) and not w.side.is_method_keyed(o)), _method(r)
    w.side.set_method(obj, name)


@operation(3)
def edit_between_methods(w: Walker, r: random.Random) -> None:
    """All at once, as by a script: an edit that leaves every count as it is, before or between choices."""
    obj = w.mesh(
        r,
        lambda o: (
            w.side.has_sinew(o)
            and not w.side.is_method_keyed(o)
            and o.mode == "OBJECT"
            and not o.data.is_editmode
            and o.data.library is None
            and o.override_library is None
            and len(o.data.vertices) > 0
        ),
    )
    names, what = (_method(r), _method(r)), r.choice(("points", "weights", "mesh", "nothing"))
    if r.random() < 0.5:
        w.side.set_method(obj, names[0])
    mesh, vertices = obj.data, some_vertices(w, r, obj)
    if what == "mesh":
        mesh = obj.data.copy()
        mesh.name = w.new_name("mesh")
    if what in ("points", "mesh"):
        for index in vertices:
            mesh.vertices[index].co.x += r.uniform(-0.1, 0.1)
        mesh.update()
        obj.data = mesh
    elif what == "weights" and obj.vertex_groups:
        w.one(r, obj.vertex_groups).add(vertices, r.uniform(0.0, 1.0), "REPLACE")
        if not obj.visible_get():
            mesh.update()
    w.side.set_method(obj, names[1])


@operation(5)
def stages(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, w.side.has_sinew)
    # Without them the shape is Blender's.
    number = r.randrange(1, len(STAGES)) if r.random() < 0.5 else 0
    w.side.set_stages(obj, number)


@operation(0.5)
def parameters(w: Walker, r: random.Random) -> None:
    """Parameters of methods: changes are visible where the method is used."""
    obj, value = w.mesh(r, w.side.has_sinew), r.choice(("nlerp", "slerp"))
    # Sinew evaluates immediately, and with it what was changed before.
    w.evaluate()
    if w.side.is_sinew:
        obj.sinew.sdef.interpolation = value
    else:
        w.side.set_option(obj, "sdef.interpolation", value)


@operation(0.5)
def compute_beside(w: Walker, r: random.Random) -> None:
    on = r.random() < 0.6
    w.side.compute_beside(on)


@operation(1.5)
def sdef_keys(w: Walker, r: random.Random) -> None:
    """Data as mmd_tools stores it."""
    obj = w.editable(r)
    w.skip_if(obj.data.library is not None or obj.mode != "OBJECT" or w.users(obj.data) > 1)
    w.skip_if(obj.data.shape_keys is not None and len(obj.data.shape_keys.key_blocks) > 4)
    if obj.data.shape_keys is None:
        obj.shape_key_add(name="Basis")
    for name in ("mmd_sdef_c", "mmd_sdef_r0", "mmd_sdef_r1"):
        block = obj.shape_key_add(name=name, from_mix=False)
        for point in block.data:
            point.co.z += r.uniform(-0.2, 0.2)
        block.mute = True


@operation(4)
def enabled(w: Walker, r: random.Random) -> None:
    obj = w.with_sinew(r)
    on = not w.side.is_on(obj) or r.random() < 0.1
    w.side.set_enabled(obj, on)


VIEWS = ("viewport", "render")


@operation(1.5)
def icons(w: Walker, r: random.Random) -> None:
    """Clicks on the icons of Sinew's and of the Armature modifier, then on those that bring Sinew back."""
    obj = w.mesh(
        r,
        lambda o: (
            w.side.is_on(o)
            and o.visible_get()
            and o.override_library is None
            and len(armature_modifiers(o)) == 1
            and armature_modifiers(o)[0].object is not None
            and all(m.show_viewport and m.show_render for m in armature_modifiers(o))
            and not w.side.has_other_shape(o)
            and not w.side.is_method_keyed(o)
            and not any(".show_" in path for path in animated_paths(o))
        ),
    )
    clicks = [(r.choice(("Sinew", "Armature")), r.choice(VIEWS)) for _click in range(r.randint(1, 6))]
    w.object_mode()
    # One that is left to Blender has a meaning of its own for them.
    w.side.set_option(obj, "leave_small", False)
    sinew, armature = dict.fromkeys(VIEWS, True), dict.fromkeys(VIEWS, True)

    def deformers() -> dict[str, str]:
        return {v: "" if not armature[v] else "Sinew" if sinew[v] else "Armature" for v in VIEWS}

    def click(modifier: str, view: str) -> None:
        icons = sinew if modifier == "Sinew" else armature
        icons[view] = not icons[view]
        w.side.click(obj, modifier, view, deformers())
        bpy.context.view_layer.update()

    w.evaluate()
    for number, (modifier, view) in enumerate(clicks):
        click(modifier, view)
        w.rendered[f"{obj.name_full} in the render, click {number + 1}"] = w.shown_points(obj)
    w.side.before_render(obj, deformers())
    bpy.ops.render.render()
    for view in VIEWS:
        for modifier, icons in (("Sinew", sinew), ("Armature", armature)):
            if not icons[view]:
                click(modifier, view)


@operation(1)
def rebind(w: Walker, r: random.Random) -> None:
    obj = w.with_sinew(r)
    w.side.rebind(obj)


@operation(1)
def scale_rule(w: Walker, r: random.Random) -> None:
    obj, number = w.with_sinew(r), r.randrange(3)
    if w.side.is_sinew:
        rules = [item.identifier for item in obj.sinew.bl_rna.properties["scale_rule"].enum_items]
        obj.sinew.scale_rule = rules[number]
    else:
        w.side.set_option(obj, "scale_rule", number)


@operation(1.5)
def leave_small(w: Walker, r: random.Random) -> None:
    obj, on = w.with_sinew(r), r.random() < 0.4
    w.side.set_option(obj, "leave_small", on)


@operation(1.5)
def give_normals(w: Walker, r: random.Random) -> None:
    obj, who = w.with_sinew(r), r.choice(("BY_SINEW", "BY_SINEW", "SKINNED", "LEAVE"))
    w.side.set_option(obj, "normals", who)


@operation(3)
def shade(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: o.data.library is None and not o.data.is_editmode)
    mesh, what = obj.data, r.choice(("smooth", "smooth", "flat", "edges", "faces", "custom"))
    if what in ("smooth", "flat"):
        mesh.polygons.foreach_set("use_smooth", [what == "smooth"] * len(mesh.polygons))
    elif what == "custom":
        mesh.normals_split_custom_set([(r.random(), r.random(), 0.5 + r.random()) for _corner in mesh.loops])
    else:
        for each in mesh.edges if what == "edges" else mesh.polygons:
            if r.random() < 0.2:
                setattr(each, "use_edge_sharp" if what == "edges" else "use_smooth", r.random() < 0.5)
    mesh.update()


@operation(2)
def heat(w: Walker, r: random.Random) -> None:
    obj, on, quantity = w.with_sinew(r), r.random() < 0.5, r.choice(("stretch", "distance", "bulge"))
    w.side.set_heat(obj, on, quantity)


@operation(1)
def compare(w: Walker, r: random.Random) -> None:
    obj = w.mesh(
        r,
        lambda o: (
            bool(armature_modifiers(o))
            and o.override_library is None
            # Sinew refuses this.
            and not (o.parent_type == "ARMATURE" and armature_modifiers(o)[0].use_multi_modifier)
            and not _is_behind_hair(o)
        ),
    )
    methods = r.sample((*METHODS, "blender"), r.randint(1, 2))
    w.skip_if(not obj.visible_get())
    w.object_mode()
    w.side.start_comparison([obj], methods)
    # Its copies share the mesh, which some operations refuse.
    w.compared = True


@operation(1)
def end_comparison(w: Walker, r: random.Random) -> None:
    w.side.end_comparison()


@operation(0.4)
def arrange_comparison(w: Walker, r: random.Random) -> None:
    how = r.choice(("SIDE", "OVERLAY"))
    w.side.arrange_comparison(how)


# --- Characters: settings for all meshes of an armature


def _character(w: Walker, r: random.Random) -> bpy.types.Object | None:
    """The armature of a character that can be selected, and whose settings no keys or library determine."""

    def is_free(obj: bpy.types.Object) -> bool:
        return obj.library is None and obj.override_library is None and not w.side.is_method_keyed(obj)

    # As in a window between two clicks: by then Sinew knows a modifier's armature.
    w.evaluate()
    w.skip_if(not all(_has_its_armatures(obj) for obj in w.objects("MESH") if w.side.has_sinew(obj)))
    rigs = [rig for rig in w.armatures() if rig.visible_get()]
    meshes = {rig: w.side.character(rig) for rig in rigs}
    return w.one(r, [rig for rig in rigs if meshes[rig] and all(map(is_free, meshes[rig]))])


def _has_its_armatures(obj: bpy.types.Object) -> bool:
    """Sinew remembers the armature of a mesh that lost it, as part of its character."""
    modifiers = armature_modifiers(obj)
    return bool(modifiers) and all(modifier.object is not None for modifier in modifiers)


@operation(1.5)
def character_method(w: Walker, r: random.Random) -> None:
    rig, name = _character(w, r), _method(r)
    w.skip_if(not w.select(rig))
    w.side.set_character_method(rig, name)


@operation(1.5)
def own_settings(w: Walker, r: random.Random) -> None:
    rig = _character(w, r)
    obj = w.one(r, w.side.character(rig))
    w.skip_if(obj not in w.in_layer() or not w.select(obj))
    w.side.switch_own(rig, obj)


@operation(0.7)
def preset(w: Walker, r: random.Random) -> None:
    rig = _character(w, r)
    w.skip_if(not w.select(rig))
    w.side.use_preset(rig, w.folder)


# --- Features that change the mesh


@operation(1.5)
def mend(w: Walker, r: random.Random) -> None:
    """Findings of diagnostics in the weights."""
    obj, how, most = w.editable(r), r.choice(("limit", "limit", "normalize", "fill")), r.choice((1, 2, 3))
    w.skip_if(obj.mode != "OBJECT" or obj.data.is_editmode or obj.parent_type == "ARMATURE")
    modifiers = armature_modifiers(obj)
    w.skip_if(len(modifiers) != 1 or modifiers[0].object is None or modifiers[0].object.data.is_editmode)
    w.evaluate()
    w.skip_if(w.side.mend(obj, how, most) is None)


@operation(0.5)
def play_motion_range(w: Walker, r: random.Random) -> None:
    obj, frame = w.mesh(r, lambda o: w.side.is_on(o) and o.visible_get()), r.randint(1, 40)
    w.skip_if(w.compared)
    and_undo(w, r, lambda: w.side.play_motion_range(obj, frame))


@operation(0.5)
def bake_to_bones(w: Walker, r: random.Random) -> None:
    obj, motion = w.mesh(r, lambda o: w.side.is_on(o) and o.visible_get()), r.choice(("keys", "pose"))
    w.skip_if(w.compared)
    is_alone = len(w.modifiers(obj)) == 1
    and_undo(w, r, lambda: w.side.bake_to_bones(obj, motion, is_alone))


@operation(0.5)
def corrective_key(w: Walker, r: random.Random) -> None:
    obj, driven = w.mesh(r, lambda o: w.side.is_on(o) and o.visible_get()), r.random() < 0.5
    w.skip_if(w.compared)
    rig = next((m.object for m in armature_modifiers(obj) if m.object is not None), None)
    bone = w.one_or_none(r, rig.pose.bones) if driven and rig is not None else None
    and_undo(w, r, lambda: w.side.add_corrective_key(obj, bone))


@operation(0.5)
def restart(w: Walker, r: random.Random) -> None:
    frame = r.choice((None, r.randint(*FRAMES)))
    w.object_mode()

    def between() -> None:
        if frame is not None:
            bpy.context.scene.frame_set(frame)

    w.side.restart(between)


@operation(0.3)
def delete_sinew_modifier(w: Walker, r: random.Random) -> None:
    # Blender's own button does not remove objects of a library from an override.
    obj = w.mesh(r, lambda o: w.side.has_sinew(o) and o.override_library is None and w.may_lose_sinew(o))
    w.skip_if(not w.side.is_on(obj))
    w.side.delete_part(obj, "modifier")


@operation(0.5)
def delete_points(w: Walker, r: random.Random) -> None:
    """What Sinew made for a mesh, and makes again."""
    obj = w.mesh(r, lambda o: w.side.has_sinew(o) and o.mode == "OBJECT" and o.data.library is None)
    part = r.choice(("attribute", "attribute", "driver", "nodes", "links", "sockets", "socket", "group"))
    w.skip_if(part != "attribute" and obj.override_library is not None)
    if w.side.is_sinew:
        w.side.delete_part(obj, part)


@operation(1)
def key_method(w: Walker, r: random.Random) -> None:
    obj = w.mesh(
        r,
        lambda o: (
            w.side.has_sinew(o)
            and w.side.is_on(o)
            and o.override_library is None
            # Keys of the method are keys of something else on the other side.
            and not w.shares_action(o)
        ),
    )
    frames = sorted(r.sample(range(1, 12), 2))
    w.side.key_method(obj, [(frames[0], r.choice(OF_BLENDER)), (frames[1], r.choice(OF_BLENDER))])
    w.this_frame()


@operation(1)
def unkey_method(w: Walker, r: random.Random) -> None:
    # A linked duplicate has the same keys, and on the other side a mark of its own.
    obj = w.mesh(r, lambda o: w.side.is_method_keyed(o) and not w.shares_action(o))
    name = r.choice(OF_BLENDER)
    w.skip_if(not w.side.has_sinew(obj))
    w.side.unkey_method(obj, name)
