# SPDX-License-Identifier: GPL-3.0-or-later
"""The mesh that the Armature modifier gets, where something before it changes the mesh.

A copy of the object, in no scene, has only the upstream modifiers. Sinew's own modifier names it, so Blender
evaluates it along with the object, and Sinew deforms its evaluated mesh. It has a copy of the mesh, too:
Blender applies no modifier to a mesh with a second user, and other people's tools do not expect one.
"""

import bpy

from ..base.errors import SinewError
from ..io import mesh_compare
from ..io.actions import animated_paths
from . import layout, node_group, properties, references, undeformed
from .layout import Layout

# A Multi Modifier directly behind one of these mixes with what it got, not with what it made.
_MIXED_BY_MULTI_MODIFIERS = {"LATTICE", "MESH_DEFORM"}

# A copy would run its own simulation, with its own cache.
SIMULATIONS = {
    "CLOTH",
    "SOFT_BODY",
    "FLUID",
    "DYNAMIC_PAINT",
    "PARTICLE_SYSTEM",
    "PARTICLE_INSTANCE",
    "EXPLODE",
}

# These can change weights from frame to frame, or exchange vertices without changing their number.
WEIGHT_CHANGERS = {
    "BOOLEAN",
    "DECIMATE",
    "REMESH",
    "WELD",
    "VERTEX_WEIGHT_EDIT",
    "VERTEX_WEIGHT_MIX",
    "VERTEX_WEIGHT_PROXIMITY",
    "DATA_TRANSFER",
    "NODES",
}

# Their levels depend on the scene's Simplify.
_SIMPLIFIED = {"SUBSURF", "MULTIRES"}

# They read from the mesh what scripts cannot: nobody could tell when a copy is out of date.
_READERS = {"MULTIRES", "SKIN"}

# The session_uid of meshes that are never copied: another add-on moves them with each frame, or they differ
# from any copy.
_shared: set[int] = set()

# Whether the copies were current when they were compared in this event, which takes long, by the session_uid
# of their proxies.
compared: dict[int, bool] = {}

# Marks a proxy's own copy of the mesh.
_COPY = "sinew_copy"
# A custom property of a proxy: what it was made from, as signature() returns it.
_MADE_FROM = "sinew_made_from"


def is_needed(obj: bpy.types.Object, now: Layout) -> bool:
    """Whether the Armature modifier gets anything other than the mesh and its relative shape keys."""
    keys = obj.data.shape_keys
    absolute = keys is not None and not keys.use_relative
    return absolute or now.parent_deforms or bool(now.changes_ahead)


def check_not_needed(obj: bpy.types.Object, why: str) -> None:
    """Raises SinewError where a proxy is needed.

    why  a clause: what does not work with it, and what to do
    """
    now = layout.read(obj)
    if is_needed(obj, now):
        names = ", ".join(each.name for each in now.changes_ahead) or "what its stack"
        raise SinewError(f"{obj.name}: {names} changes the mesh ahead of the armature, {why}")


def check(obj: bpy.types.Object, now: Layout) -> None:
    """Raises SinewError where the upstream modifiers cannot be evaluated separately."""
    first = obj.modifiers[now.replaced[0]] if now.replaced else None
    if first is not None and first.use_multi_modifier and now.parent_deforms:
        raise SinewError(
            f"{obj.name}: its first Armature modifier is a Multi Modifier, and its parent deforms it as well "
            "(parent type Armature); switch Multi Modifier off, or parent it by type Object"
        )
    # A parent deforms before all modifiers.
    changes = () if first is None else now.changes_ahead
    if first is not None and first.use_multi_modifier and changes:
        ahead = now.modifiers[now.modifiers.index(now.skins[0]) - 1]
        if ahead == changes[-1] and ahead.kind in _MIXED_BY_MULTI_MODIFIERS:
            raise SinewError(
                f"{obj.name}: {first.name} is a Multi Modifier directly behind {ahead.name}, so it mixes "
                "with the shape before that; switch Multi Modifier off, or put another modifier between them"
            )
    for modifier in changes:
        if modifier.kind in SIMULATIONS:
            raise SinewError(
                f"{obj.name}: modifier {modifier.name} in front of {first.name} is a simulation, which Sinew "
                "can not run twice; apply it or move it behind"
            )


def ensure(obj: bpy.types.Object, now: Layout) -> bpy.types.Object | None:
    """Returns the copy, made again where the upstream modifiers differ from its own, or the mesh does."""
    storage = properties.of(obj).storage
    if not is_needed(obj, now):
        remove(obj)
        return None
    check(obj, now)
    wanted, shares, proxy = signature(obj, now), _has_to_share_mesh(obj, now), storage.upstream_proxy
    is_made = proxy is not None and proxy.get(_MADE_FROM) == wanted and shares_mesh(obj) == shares
    if not (is_made and is_current(obj)):
        # Never the old one with another mesh: see references.py.
        references.note(obj)
        remove(obj)
        proxy = storage.upstream_proxy = _make(obj, now, shares)
        proxy[_MADE_FROM] = wanted
        if not shares and not mesh_compare.is_good_copy(obj.data, proxy.data):
            share_mesh(obj)
            return ensure(obj, now)
        compared[proxy.session_uid] = True
    return storage.upstream_proxy


def shares_mesh(obj: bpy.types.Object) -> bool:
    """Whether the object has a proxy, and that is a second user of its mesh."""
    proxy = properties.of(obj).storage.upstream_proxy
    return proxy is not None and proxy.data == obj.data


def share_mesh(obj: bpy.types.Object) -> None:
    """From now on, no proxy has a copy of the object's mesh."""
    _shared.add(obj.data.session_uid)


def _has_to_share_mesh(obj: bpy.types.Object, now: Layout) -> bool:
    """Whether a copy of the mesh would have to be made again with each stroke, could be out of date, or would
    be of no use, as others use the mesh, too."""
    mesh = obj.data
    if (
        obj.mode != "OBJECT"
        or not mesh.is_editable
        or mesh.session_uid in _shared
        or any(each.kind in _READERS for each in now.ahead)
    ):
        return True
    has_copy = _has_copy(properties.of(obj).storage.upstream_proxy)
    return not has_copy and mesh.users - mesh.use_fake_user - shares_mesh(obj) > 1


def is_current(obj: bpy.types.Object) -> bool:
    """Whether the proxy's mesh, if it has one, is like the object's, has vertex groups of the same names, and
    follows the same shape keys."""
    proxy = properties.of(obj).storage.upstream_proxy
    if proxy is None or proxy.data == obj.data:
        return True
    uid = proxy.session_uid
    if uid not in compared:
        # Blender renames groups along with bones only where an Armature modifier has these.
        has_same_groups = proxy.vertex_groups.keys() == obj.vertex_groups.keys()
        is_like = has_same_groups and _has_copy(proxy) and _follows_keys(obj, proxy)
        compared[uid] = is_like and mesh_compare.are_alike(obj.data, proxy.data)
    return compared[uid]


def compare_again(obj: bpy.types.Object) -> None:
    """Called where its mesh may have changed within this event."""
    proxy = properties.of(obj).storage.upstream_proxy
    if proxy is not None:
        compared.pop(proxy.session_uid, None)


def _follows_keys(obj: bpy.types.Object, proxy: bpy.types.Object) -> bool:
    """Whether the shape keys of the proxy's mesh, if it has any, follow those of the object's mesh, which may
    be another one by now."""
    keys = proxy.data.shape_keys
    animation = None if keys is None else keys.animation_data
    drivers = () if animation is None else animation.drivers
    targets = (curve.driver.variables[0].targets[0].id for curve in drivers)
    # All have the same target.
    return next(targets, obj.data.shape_keys) == obj.data.shape_keys


def follow_points(obj: bpy.types.Object) -> None:
    """Gives the proxy's copy of the mesh, which is not current, the points of the mesh. Another add-on's
    handler can move these with each frame, also of a render."""
    proxy = properties.of(obj).storage.upstream_proxy
    if _has_copy(proxy):
        mesh_compare.write_points(obj.data, proxy.data)
        compare_again(obj)


def _has_copy(proxy: bpy.types.Object | None) -> bool:
    """Whether a proxy has a mesh of its own. Another one is the artist's, and need not be its object's any
    more."""
    return proxy is not None and bool(proxy.data.get(_COPY))


def remove(obj: bpy.types.Object) -> None:
    storage = properties.of(obj).storage
    copy, storage.upstream_proxy = storage.upstream_proxy, None
    if copy is not None and copy.library is None:
        remove_helper(copy)


def remove_helper(helper: bpy.types.Object) -> None:
    """Removes a proxy or a point buffer, with its mesh. A mesh that a proxy shares is the artist's, who may
    still want it."""
    # A proxy follows its object, which point buffers do not.
    mesh, is_proxy = helper.data, len(helper.constraints) > 0
    is_own = not is_proxy or _has_copy(helper)
    bpy.data.objects.remove(helper)
    if is_own and mesh.users == 0:
        bpy.data.meshes.remove(mesh)


def evaluated_mesh(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> bpy.types.Mesh | None:
    """Returns the mesh that the Armature modifier gets; None as long as Blender has not evaluated it."""
    proxy = properties.of(obj).storage.upstream_proxy
    evaluated = proxy.evaluated_get(depsgraph)
    # If it was just made at the address of a deleted object, Blender returns what was evaluated for that.
    token = proxy.sinew.identity.token
    is_other = not isinstance(evaluated, bpy.types.Object) or evaluated.sinew.identity.token != token
    if is_other or not evaluated.is_evaluated:
        return None
    is_plain = evaluated.data == proxy.data.evaluated_get(depsgraph)
    return None if is_plain and not _is_requested(obj, depsgraph) else evaluated.data


def _is_requested(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> bool:
    """Whether Sinew's modifier needed the proxy's mesh in an evaluation. Blender may need only the transform,
    as a constraint's target: then it does not evaluate the upstream modifiers, and the mesh is their
    input."""
    evaluated = obj.evaluated_get(depsgraph)
    nodes = evaluated.modifiers.get(layout.read(evaluated).sinew)
    if depsgraph.mode == "RENDER":
        # visible_get() is of the viewport.
        is_shown = nodes is not None and nodes.show_render and not obj.hide_render
    else:
        is_shown = (
            nodes is not None and nodes.show_viewport and obj.visible_get(view_layer=depsgraph.view_layer)
        )
    return is_shown and node_group.get_input(nodes, "Upstream") is not None


def changes_weights(now: Layout) -> bool:
    """Whether weights can differ from frame to frame."""
    return any(each.kind in WEIGHT_CHANGERS for each in now.changes_ahead)


def copy_that_follows(obj: bpy.types.Object, name: str) -> bpy.types.Object:
    """Returns a copy, in no collection, that follows the object, whatever moves that."""
    copy = obj.copy()
    if copy.override_library is not None:
        copy.make_local(clear_liboverride=True)
    copy.name = name
    _leave_simulations(copy)
    for constraint in list(copy.constraints):
        copy.constraints.remove(constraint)
    copy.constraints.new("COPY_TRANSFORMS").target = obj
    return copy


def _leave_simulations(copy: bpy.types.Object) -> None:
    """Takes a copy out of the collections of rigid bodies and their constraints, where Blender (4.2 to 5.3)
    puts a copy of what is in them: it would be simulated, too (findings/copy_in_no_scene_is_simulated.sh)."""
    for world in (scene.rigidbody_world for scene in bpy.data.scenes):
        for collection in (world.collection, world.constraints) if world is not None else ():
            if collection is not None and copy.name_full in collection.objects:
                collection.objects.unlink(copy)


def _make(obj: bpy.types.Object, now: Layout, shares: bool) -> bpy.types.Object:
    """shares: it has no copy of the mesh, but the mesh."""
    copy = copy_that_follows(obj, f"{obj.name} Sinew upstream")
    if not shares:
        copy.data = _copy_of_mesh(obj)
    properties.clear(copy)
    copy.add_rest_position_attribute = undeformed.adds_rest_position(obj)
    identity = properties.of(copy).identity
    identity.is_helper, identity.token = True, copy.session_uid
    wanted = {each.name for each in now.ahead}
    for modifier in [m for m in copy.modifiers if m.name not in wanted]:
        copy.modifiers.remove(modifier)
    _keep_animation_of_modifiers(copy)
    _follow_simplify(copy)
    _clear_parent(copy)
    return copy


def _copy_of_mesh(obj: bpy.types.Object) -> bpy.types.Mesh:
    """Returns a copy whose shape keys follow those of the mesh, be they animated or set by hand."""
    copy, keys = obj.data.copy(), obj.data.shape_keys
    copy.name, copy[_COPY], copy.use_fake_user = f"{obj.name} Sinew upstream", True, False
    if keys is not None:
        copy.shape_keys.animation_data_clear()
        values = [key.path_from_id("value") for key in keys.key_blocks]
        for path in {*values, "eval_time", *animated_paths(keys)}:
            try:
                driver = copy.shape_keys.driver_add(path).driver
            except TypeError:
                # The curves of a deleted shape key stay.
                continue
            driver.type = "SUM"
            target = driver.variables.new().targets[0]
            target.id_type, target.id, target.data_path = "KEY", keys, path
    return copy


def _clear_parent(copy: bpy.types.Object) -> None:
    """Exporters also write children that are in no scene. An armature that deforms becomes a modifier; a
    lattice that does so stays the parent."""
    if layout.parent_deforms(copy):
        modifier = copy.modifiers.new("Parent", "ARMATURE")
        copy.modifiers.move(len(copy.modifiers) - 1, 0)
        modifier.object, modifier.use_bone_envelopes = copy.parent, True
    if copy.parent_type != "LATTICE":
        copy.parent = None


def _keep_animation_of_modifiers(copy: bpy.types.Object) -> None:
    animation = copy.animation_data
    if animation is None:
        return
    # Not Sinew's own driver, whose modifier the copy does not have (Blender 4.2 leaves it).
    paths = tuple(modifier.path_from_id() for modifier in copy.modifiers)
    for driver in [d for d in animation.drivers if not d.data_path.startswith(paths)]:
        animation.drivers.remove(driver)
    if not copy.modifiers:
        copy.animation_data_clear()


def _follow_simplify(copy: bpy.types.Object) -> None:
    """Has Blender evaluate the copy again where Simplify changes, as it does for objects that a scene has,
    and in each frame where Simplify is animated."""
    for modifier in copy.modifiers:
        if modifier.type not in _SIMPLIFIED:
            continue
        # A copy is never in edit mode.
        driver = modifier.driver_add("show_in_editmode").driver
        driver.type = "SUM"
        for name in ("use_simplify", "simplify_subdivision", "simplify_subdivision_render"):
            variable = driver.variables.new()
            variable.type = "CONTEXT_PROP"
            target = variable.targets[0]
            target.context_property, target.data_path = "ACTIVE_SCENE", f"render.{name}"


def signature(obj: bpy.types.Object, now: Layout) -> str:
    """Returns a text that differs where the copy would: by the settings of the upstream modifiers, the pinned
    shape key and Add Rest Position."""
    pinned = obj.active_shape_key_index if obj.show_only_shape_key else None
    animation = obj.animation_data
    action = animation.action.session_uid if animation is not None and animation.action is not None else 0
    animated = tuple(path for path in animated_paths(obj) if path.startswith("modifiers["))
    modifiers = [_modifier_values(obj.modifiers[each.name], animated) for each in now.ahead]
    parent = (obj.parent_type, obj.parent and obj.parent.session_uid, obj.parent_bone)
    return repr((pinned, undeformed.adds_rest_position(obj), action, parent, modifiers))


def _modifier_values(modifier: bpy.types.Modifier, animated: tuple[str, ...]) -> list:
    """Returns the values that the artist set; animated ones reach the copy by themselves."""
    start = f'modifiers["{bpy.utils.escape_identifier(modifier.name)}"]'
    return [
        (name, value)
        for name, value in _values(modifier, depth=3)
        if not any(path.startswith((f"{start}.{name}", f"{start}{name}")) for path in animated)
    ]


# How a modifier is displayed, and what Blender found when it evaluated it: not what it does.
_LEFT_OUT = {"rna_type", "show_expanded", "is_active", "persistent_uid", "execution_time", "face_count"}


def _values(struct: bpy.types.bpy_struct, depth: int) -> list:
    """Returns all values of a modifier's settings, nested; data-blocks by their identity."""
    values = [(f'["{key}"]', _id_property(value)) for key, value in _id_properties(struct)]
    for name, prop in struct.bl_rna.properties.items():
        if name in _LEFT_OUT:
            continue
        value = getattr(struct, name)
        if isinstance(value, bpy.types.ID):
            value = value.session_uid
        elif prop.type == "POINTER":
            value = _values(value, depth - 1) if value is not None and depth else None
        elif prop.type == "COLLECTION":
            value = [_values(item, depth - 1) for item in value] if depth else None
        elif getattr(prop, "is_array", False):
            value = tuple(value)
        values.append((name, value))
    return values


def _id_properties(struct: bpy.types.bpy_struct) -> list:
    try:
        return sorted(struct.items())
    except TypeError:
        return []


def _id_property(value: object) -> object:
    if isinstance(value, bpy.types.ID):
        return value.session_uid
    return value.to_list() if hasattr(value, "to_list") else value
