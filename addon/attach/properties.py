# SPDX-License-Identifier: GPL-3.0-or-later
"""What Sinew stores about an object, in the .blend file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import bpy

from ..skinning.engines import METHODS
from ..skinning.scale_rule import SCALE_RULES
from ..skinning.variants import BLENDER, WHOLE
from . import property_groups, stage_settings
from .feature import Feature
from .stage_settings import OFF, OVERRIDABLE, method_items


def method_label(name: str) -> str:
    if name in WHOLE:
        return WHOLE[name]
    return METHODS[name].label if name in METHODS else "a method of a newer Sinew"


def method_choices() -> list[tuple[str, str, str, str, int]]:
    """Returns the Armature modifier and all methods, as items of an enum property. The stored number stays
    that of the method, even if the list of methods changes."""
    blender = "What Blender's modifier does, as its options say"
    return [
        (BLENDER, method_label(BLENDER), blender, "NONE", 0),
        *((name, m.label, m.description, "NONE", m.number + 1) for name, m in METHODS.items()),
    ]


def has_known_methods(settings: SinewSettings) -> bool:
    """Whether this Sinew has all methods that the settings name: a file of a newer one can name others, which
    Blender reads as empty."""
    return bool(settings.method) and all(each.method for each in settings.replaced_modifiers)


@dataclass
class Listeners:
    """Functions that are called when settings change or are read; set on registration, as they read settings
    themselves."""

    method_changed: Callable[[bpy.types.Object, bpy.types.Context], None] = lambda _obj, _context: None
    error_requested: Callable[[bpy.types.Object], str] = lambda _obj: ""
    object_requested: Callable[[bpy.types.Object], None] = lambda _obj: None
    mesh_requested: Callable[[bpy.types.Mesh], None] = lambda _mesh: None
    heat_changed: Callable[[bpy.types.Object, bpy.types.Context], None] = lambda _obj, _context: None
    twist_changed: Callable[[bpy.types.Context], None] = lambda _context: None


listeners = Listeners()


def _method_changed(settings: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    listeners.method_changed(settings.id_data, context)


def _object_method_changed(settings: SinewSettings, context: bpy.types.Context) -> None:
    """A method that is chosen for the object goes to all of its Armature modifiers."""
    for replaced in settings.replaced_modifiers:
        if replaced.method != SAME_METHOD:
            # By key: assigning to the property itself calls the listeners.
            replaced["method"] = 0
    _method_changed(settings, context)


def _heat_changed(settings: SinewSettings, context: bpy.types.Context) -> None:
    listeners.heat_changed(settings.id_data, context)


def _error(settings: SinewSettings) -> str:
    return listeners.error_requested(settings.id_data)


def _requested(listener: str) -> Callable[[bpy.types.bpy_struct], float]:
    """Returns a getter by which a driver requests points."""

    def get(owner: bpy.types.bpy_struct) -> float:
        getattr(listeners, listener)(owner.id_data)
        return 0.0

    return get


# A list of an override that gets items of its own.
_INSERTABLE = {"LIBRARY_OVERRIDABLE", "USE_INSERTION"}
SAME_METHOD = "SAME"


def _hidden(kind: Callable, description: str = "", **settings: object) -> object:
    """Returns a property that only Sinew uses; overridable, too."""
    return kind(description=description, options={"HIDDEN"}, override=OVERRIDABLE, **settings)


def _setting(kind: Callable, update: Callable = _method_changed, **settings: object) -> object:
    """Returns a property that the artist sets, which keys and drivers can not."""
    return kind(options=set(), update=update, override=OVERRIDABLE, **settings)


# Who computes normals.
BY_SINEW, SKINNED_NORMALS, LEAVE_NORMALS = "BY_SINEW", "SKINNED", "LEAVE"


class SinewReplacedModifier(bpy.types.PropertyGroup):
    """What Sinew stores about an Armature modifier that it replaces, called `name`."""

    armature: bpy.props.PointerProperty(
        name="Armature",
        description="The armature that deforms this mesh",
        type=bpy.types.Object,
        poll=lambda _self, obj: obj.type == "ARMATURE",
        override=OVERRIDABLE,
    )
    uid: _hidden(
        bpy.props.IntProperty,
        "By which the Armature modifier is known however it is moved and renamed; 0 where it is "
        "known by its name",
    )
    was_off: _hidden(
        bpy.props.BoolProperty,
        "It was off in both views before Sinew, which switched it on; removal switches it off again",
    )
    preserve_volume: _hidden(
        bpy.props.BoolProperty, "The Armature modifier's own choice, while it has the one nearest to Sinew's"
    )
    was_nearest: _hidden(
        bpy.props.BoolProperty, "The artist's choice was the nearest one, so that it is not restored"
    )
    method: bpy.props.EnumProperty(
        name="Method",
        description="How this modifier blends, where several chained Armature modifiers deform the mesh. "
        "A method that is chosen for the mesh or the character goes to all of them again",
        items=[
            (SAME_METHOD, "Same Method", "The method that is chosen for the object", 0),
            *method_items(1),
        ],
        default=SAME_METHOD,
        update=_method_changed,
        override=OVERRIDABLE,
    )


class SinewSwitchedOff(bpy.types.PropertyGroup):
    """What Sinew stores about another modifier that it switched off, called `name`: the Corrective Smooth
    that the stage delta_mush replaces, or a cache of baked shapes. An empty name means none."""

    uid: _hidden(bpy.props.IntProperty)
    # The modifier's own flags, restored on removal.
    show_viewport: _hidden(bpy.props.BoolProperty, default=True)
    show_render: _hidden(bpy.props.BoolProperty, default=True)


STAGE_GROUPS = stage_settings.groups("Stage", stage_settings.STAGES, _method_changed)
METHOD_GROUPS = stage_settings.groups("Method", stage_settings.METHODS, _method_changed)


class SinewIdentity(bpy.types.PropertyGroup):
    """What the object is to Sinew."""

    token: _hidden(
        bpy.props.IntProperty, "The session_uid of the object, for its evaluated copies, which have none"
    )
    is_helper: _hidden(bpy.props.BoolProperty, "Made by Sinew for another object")
    copied: _hidden(
        bpy.props.PointerProperty,
        "The object that this one is a comparison's copy of",
        type=bpy.types.Object,
    )
    method: _hidden(
        bpy.props.StringProperty, "The method that this copy is there to show; empty for all but copies"
    )


class SinewStack(bpy.types.PropertyGroup):
    """Sinew's modifiers on the object, and their icons. The persistent_uid of each: they may have no node
    group, and be renamed."""

    modifier_uid: _hidden(bpy.props.IntProperty)
    neutral_uid: _hidden(bpy.props.IntProperty, "The modifier that changes nothing (undeformed.py)")
    mark_uid: _hidden(bpy.props.IntProperty, "The modifier that marks the mesh (undeformed.py)")
    replaces_modifiers: _hidden(bpy.props.BoolProperty, "Sinew deforms now, wherever its icon is on")
    # The icons that the artist gave Sinew's modifier, while Sinew has them off.
    show_viewport: _hidden(bpy.props.BoolProperty, default=True)
    show_render: _hidden(bpy.props.BoolProperty, default=True)


class SinewBefore(bpy.types.PropertyGroup):
    """What Sinew restores when it is taken off."""

    parent_type: _hidden(
        bpy.props.StringProperty, "The object's parent type before Sinew made an Armature modifier of it"
    )
    had_animation: _hidden(bpy.props.BoolProperty, "The object had animation data, be it empty")
    marks_rest: _hidden(bpy.props.BoolProperty, "Sinew has Blender add rest positions")
    adds_rest_position: _hidden(
        bpy.props.BoolProperty, "The artist's own choice of Add Rest Position while Sinew sets it"
    )
    has_nearest_volume: _hidden(
        bpy.props.BoolProperty,
        "The Armature modifiers have the Preserve Volume nearest to Sinew's method, not the "
        "artist's own: in saved files, and in modes of tools that need them",
    )
    smooth: _hidden(bpy.props.PointerProperty, type=SinewSwitchedOff)
    baked: bpy.props.CollectionProperty(type=SinewSwitchedOff, options={"HIDDEN"}, override=_INSERTABLE)


class SinewStorage(bpy.types.PropertyGroup):
    """Where the points are, and what Sinew deforms."""

    attribute: _hidden(
        bpy.props.StringProperty, "Attribute that holds the points; empty where the point buffer does"
    )
    point_buffer: _hidden(
        bpy.props.PointerProperty,
        "The object whose vertices are the deformed points (point_buffer.py)",
        type=bpy.types.Object,
    )
    upstream_proxy: _hidden(
        bpy.props.PointerProperty,
        "The copy that has only the upstream modifiers (upstream_proxy.py)",
        type=bpy.types.Object,
    )
    world_scale: _hidden(
        bpy.props.FloatProperty,
        "How many units of the world one of the mesh is, for settings that are lengths; 0 in files of "
        "versions in which these were in units of the mesh",
    )


class SinewDriver(bpy.types.PropertyGroup):
    """What pose_driver's driver is on, or reads."""

    pose: bpy.props.FloatProperty(options={"HIDDEN", "ANIMATABLE"}, description="Carries the driver")
    request: bpy.props.FloatProperty(
        get=_requested("object_requested"), options={"HIDDEN"}, description="Read to request points"
    )


class SinewSettings(bpy.types.PropertyGroup):
    """How Sinew deforms this object, in place of the `replaced_modifiers`. Where there are none, the
    object has no Sinew."""

    method: bpy.props.EnumProperty(
        name="Method",
        description="How the bones' motions are blended at each vertex",
        items=method_items(),
        default=next(iter(METHODS)),
        update=_object_method_changed,
        override=OVERRIDABLE,
    )
    scale_rule: bpy.props.EnumProperty(
        name="Scale",
        description="What becomes of bones' scale under methods that blend rigid motions",
        items=[(r.name, r.label, r.description, r.number) for r in SCALE_RULES],
        update=_method_changed,
        override=OVERRIDABLE,
    )
    enabled: _setting(
        bpy.props.BoolProperty,
        name="On",
        description="Deform with Sinew where the icon of its modifier is on. Where that of an Armature "
        "modifier is switched on, that deforms instead; where Sinew's is switched off, nothing does. Off: "
        "Blender's Armature modifier deforms, to compare the two",
        default=True,
    )
    is_own: bpy.props.BoolProperty(
        name="Own Settings",
        description="This mesh keeps settings of its own: what is set for the character does not change it",
        options=set(),
        override=OVERRIDABLE,
    )
    normals: _setting(
        bpy.props.EnumProperty,
        name="Normals",
        description="Who computes the normals that the mesh is drawn with (Blender 4.5 and later)",
        items=[
            (BY_SINEW, "By Sinew", "Computed with the points: Blender's own, in less time", 0),
            (
                SKINNED_NORMALS,
                "Skinned",
                "Those of the rest pose move with the skin, as in game engines; imported ones are kept",
                2,
            ),
            (LEAVE_NORMALS, "By Blender", "Computed whenever they are read", 1),
        ],
        default=BY_SINEW,
    )
    heat: _setting(
        bpy.props.BoolProperty,
        name="Heat Map",
        description="Show a measure of the deformation as colours of the mesh",
        update=_heat_changed,
    )
    leave_small: _setting(
        bpy.props.BoolProperty,
        name="Leave to Blender Where Faster",
        description="Have the Armature modifier deform this mesh where it gives the same shape and, as the "
        "mesh is small, takes less time",
        default=True,
    )
    variants: _hidden(bpy.props.StringProperty, "The variants of the character, a line each")
    replaced_modifiers: bpy.props.CollectionProperty(
        type=SinewReplacedModifier, options={"HIDDEN"}, override=_INSERTABLE
    )
    error: bpy.props.StringProperty(
        description="Why Sinew can not deform it; empty where it can",
        options={"HIDDEN"},
        get=_error,
    )

    @property
    def replaces_modifiers(self) -> bool:
        """Whether Sinew deforms now, wherever the icons say so."""
        return self.stack.replaces_modifiers

    @property
    def methods(self) -> list[str]:
        """That of each Armature modifier which Sinew replaces; the first has the object's."""
        own = [replaced.method for replaced in self.replaced_modifiers]
        return [self.method if n == 0 or name == SAME_METHOD else name for n, name in enumerate(own)]

    @property
    def mixed_method(self) -> str:
        """The second method of the mix; empty where the mix is off."""
        return "" if self.mix.method == OFF else self.mix.method

    @property
    def armature(self) -> bpy.types.Object | None:
        """The armature of the first modifier that Sinew replaces."""
        return self.replaced_modifiers[0].armature if self.replaced_modifiers else None

    @property
    def armatures(self) -> list[bpy.types.Object]:
        """All armatures that deform the object, each once."""
        return list(dict.fromkeys(s.armature for s in self.replaced_modifiers if s.armature is not None))


# A group of settings for each stage, and for each method that has parameters, by its name.
SETTING_GROUPS = {**STAGE_GROUPS, **METHOD_GROUPS}
# What only Sinew uses.
_HIDDEN_GROUPS = {
    "identity": SinewIdentity,
    "stack": SinewStack,
    "before": SinewBefore,
    "storage": SinewStorage,
    "driver": SinewDriver,
}
SinewSettings.__annotations__.update(
    {
        **{
            name: bpy.props.PointerProperty(type=group, description=group.__doc__, override=OVERRIDABLE)
            for name, group in SETTING_GROUPS.items()
        },
        **{name: _hidden(bpy.props.PointerProperty, type=each) for name, each in _HIDDEN_GROUPS.items()},
    }
)


def of(obj: bpy.types.Object) -> SinewSettings:
    return obj.sinew


def has_sinew(obj: bpy.types.Object) -> bool:
    # Reading the settings of an object that has none would leave an empty group in the file.
    if obj.type != "MESH" or not obj.is_property_set("sinew"):
        return False
    return len(obj.sinew.replaced_modifiers) > 0 and not obj.sinew.identity.is_helper


def is_helper(obj: bpy.types.Object) -> bool:
    """Whether Sinew made this object for another one."""
    return obj.is_property_set("sinew") and obj.sinew.identity.is_helper


def shows_heat(obj: bpy.types.Object) -> bool:
    """Whether its heat map is on; objects without Sinew can show errors of a bake."""
    return obj.is_property_set("sinew") and obj.sinew.heat


def is_copy(obj: bpy.types.Object) -> bool:
    """Whether a comparison made this object, to show a method beside the original."""
    return obj.is_property_set("sinew") and bool(obj.sinew.identity.method)


def make_groups(settings: SinewSettings) -> None:
    """Makes all groups of settings of the object, by reading them: Blender 5.2 cannot give a library override
    a group that its library lacks."""
    for name in (*SETTING_GROUPS, *_HIDDEN_GROUPS):
        getattr(settings, name)


def clear(obj: bpy.types.Object) -> None:
    """Removes Sinew's settings from the object, as if they had never existed."""
    obj.property_unset("sinew")


FEATURE = Feature(
    (
        *(SinewReplacedModifier, SinewSwitchedOff),
        *(*SETTING_GROUPS.values(), *_HIDDEN_GROUPS.values()),
        SinewSettings,
    ),
    {
        "Object.sinew": bpy.props.PointerProperty(type=SinewSettings, override=OVERRIDABLE),
        # How a bone shares the twist of another, for all meshes of its armature. Not in a group, as Blender
        # cannot key what is in a pose bone's group.
        "PoseBone.sinew_twist_amount": bpy.props.FloatProperty(
            name="Twist Amount",
            description="How much of the twist this bone shares: 0 nothing, 1 all of it",
            default=1.0,
            min=0.0,
            max=1.0,
            subtype="FACTOR",
            update=lambda _bone, context: listeners.twist_changed(context),
            override=OVERRIDABLE,
        ),
        "PoseBone.sinew_twist_curve": bpy.props.FloatProperty(
            name="Twist Curve",
            description="Where along the bone the twist is: 0 evenly, below 0 more of it near the tail, "
            "above 0 near the head",
            default=0.0,
            min=-1.0,
            max=1.0,
            update=lambda _bone, context: listeners.twist_changed(context),
            override=OVERRIDABLE,
        ),
        # A property of meshes, so that its getter receives the evaluated mesh and nothing is stored.
        "Mesh.sinew_request": bpy.props.FloatProperty(
            get=_requested("mesh_requested"),
            options={"HIDDEN"},
            description="Read by pose_driver's driver, to request points",
        ),
    },
)


# Properties of SinewSettings; all stages and parameters of methods are shared, too.
SHARED = ("method", "scale_rule", "normals", "leave_small")


def share(source: bpy.types.Object, target: bpy.types.Object) -> None:
    """Copies the shared settings of a mesh to another. The caller suspends updates meanwhile."""
    own, other = of(target), of(source)
    for name in (*SHARED, "variants"):
        property_groups.assign(own, name, getattr(other, name))
    for group, cls in SETTING_GROUPS.items():
        for name in cls.__annotations__:
            property_groups.assign(getattr(own, group), name, getattr(getattr(other, group), name))
