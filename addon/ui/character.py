# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings of a whole character, as the panel shows them: properties without stored values.

Each property reads the value of one mesh, the lead, and writes to all meshes that follow the character. So
one change of a slider or menu changes all of them, in one undo step. Keys and drivers belong to a mesh's own
settings.
"""

import inspect
from typing import Any

import bpy

from ..attach import properties, property_groups
from ..attach.feature import Feature
from ..attach.properties import SETTING_GROUPS, SHARED
from ..attach.subscribers import subscribers
from ..deform import session
from . import operators

# Arguments that a computed property cannot have.
_NOT_COMPUTED = {"update", "override", "default", "options"}


def followers(context: bpy.types.Context) -> list[bpy.types.Object]:
    """Returns the meshes of the selected characters that have Sinew, without those with their own
    settings."""
    return [obj for obj in operators.sinew_targets(context) if not properties.of(obj).is_own]


def lead(context: bpy.types.Context) -> bpy.types.Object | None:
    """Returns the mesh whose values are shown: the active one, else the first that follows; else the
    first."""
    return min(known_meshes(context), key=lambda obj: properties.of(obj).is_own, default=None)


def set_method(context: bpy.types.Context, method: str) -> None:
    """Sets `method` for all meshes that follow, with all of their Armature modifiers: wherever it is chosen
    for the character."""
    with session.changing(context):
        for obj in followers(context):
            properties.of(obj).method = method


class _Known:
    """The character's meshes as last found, by their names, and the selection at that time; valid until
    Blender evaluates something. Finding them goes through the whole scene, and each button reads its value
    several times."""

    selection: tuple[object, ...] = ()
    names: tuple[str, ...] = ()


def find_meshes(context: bpy.types.Context) -> list[bpy.types.Object]:
    """Returns the meshes of the selected characters that have Sinew, and stores them for known_meshes()."""
    found = operators.sinew_targets(context)
    _Known.selection, _Known.names = _selection(context), tuple(obj.name for obj in found)
    return found


def known_meshes(context: bpy.types.Context) -> list[bpy.types.Object]:
    """Returns the same from memory, as long as nothing has changed, the selection is the same and all still
    have Sinew."""
    if _Known.names and _Known.selection == _selection(context):
        found = [context.scene.objects.get(name) for name in _Known.names]
        if all(obj is not None and properties.has_sinew(obj) for obj in found):
            return found
    return find_meshes(context)


def _forget(*_args: object) -> None:
    """Forgets the meshes, as others may belong to the character now."""
    _Known.names = ()


def _selection(context: bpy.types.Context) -> tuple[object, ...]:
    active = operators.active_object(context)
    names = (obj.name for obj in operators.selected(context))
    return (context.scene.session_uid, active.name if active is not None else "", *names)


def _computed(deferred: Any, group: str, name: str) -> object:
    """Returns the character's property for a mesh's property.

    deferred  what bpy.props made for the mesh's
    group     its group within the settings; empty for the settings themselves
    """

    def of_mesh(settings: properties.SinewSettings) -> bpy.types.PropertyGroup:
        return getattr(settings, group) if group else settings

    def get(_own: bpy.types.PropertyGroup) -> object:
        obj = lead(bpy.context)
        settings = None if obj is None else properties.of(obj)
        prop = CLASSES_OF[group].bl_rna.properties[name]
        value = prop.default if settings is None else getattr(of_mesh(settings), name)
        return prop.enum_items[value].value if prop.type == "ENUM" else value

    def set_all(_own: bpy.types.PropertyGroup, value: object) -> None:
        prop = CLASSES_OF[group].bl_rna.properties[name]
        if prop.type == "ENUM":
            # An item without identifier is a heading.
            value = next(i.identifier for i in prop.enum_items if i.identifier and i.value == value)
        if (group, name) == ("", "method"):
            set_method(bpy.context, value)
            return
        each = [of_mesh(properties.of(obj)) for obj in followers(bpy.context)]
        if any(getattr(settings, name) != value for settings in each):
            with session.changing(bpy.context):
                for settings in each:
                    property_groups.assign(settings, name, value)

    facts = {key: value for key, value in deferred.keywords.items() if key not in _NOT_COMPUTED}
    return deferred.function(get=get, set=set_all, options=set(), **facts)


# The classes of a mesh's settings by the name of the group; empty for the settings themselves.
CLASSES_OF = {"": properties.SinewSettings, **SETTING_GROUPS}


def _class_of(group: str, names: tuple[str, ...]) -> type:
    source = inspect.get_annotations(CLASSES_OF[group], eval_str=True)
    annotations = {name: _computed(source[name], group, name) for name in names}
    title = group.title().replace("_", "")
    return type(f"SinewCharacter{title}", (bpy.types.PropertyGroup,), {"__annotations__": annotations})


_GROUP_CLASSES = {name: _class_of(name, tuple(cls.__annotations__)) for name, cls in SETTING_GROUPS.items()}
SinewCharacter = _class_of("", SHARED)


def _is_on(_own: bpy.types.PropertyGroup) -> bool:
    return any(properties.of(obj).enabled for obj in known_meshes(bpy.context))


def _switch(_own: bpy.types.PropertyGroup, on: bool) -> None:
    with session.changing(bpy.context):
        for obj in operators.sinew_targets(bpy.context):
            if properties.of(obj).enabled != on:
                properties.of(obj).enabled = on


def _row(own: bpy.types.PropertyGroup) -> int:
    obj = chosen(own.id_data)
    return -1 if obj is None else own.id_data.objects.find(obj.name)


def _choose_row(own: bpy.types.PropertyGroup, row: int) -> None:
    objects = own.id_data.objects
    own.chosen = objects[row].name if 0 <= row < len(objects) else ""


def chosen(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """Returns the mesh of the list whose details are shown; the active one where another character's was
    chosen."""
    meshes = operators.targets(bpy.context)
    return next((obj for obj in meshes if obj.name == of(scene).chosen), meshes[0] if meshes else None)


SinewCharacter.__annotations__.update(
    {
        "enabled": bpy.props.BoolProperty(
            name="On",
            description="Deform all meshes of the character with Sinew where the icon of its modifier is on. "
            "Where that of an Armature modifier is switched on, that deforms instead; where Sinew's is "
            "switched off, nothing does. Off: Blender's Armature modifier deforms, to compare the two",
            get=_is_on,
            set=_switch,
            options=set(),
        ),
        "row": bpy.props.IntProperty(
            name="Mesh",
            description="The mesh whose details are shown, among the scene's objects",
            get=_row,
            set=_choose_row,
            options={"HIDDEN"},
        ),
        "chosen": bpy.props.StringProperty(options={"HIDDEN", "SKIP_SAVE"}),
        **{
            name: bpy.props.PointerProperty(type=cls, description=SETTING_GROUPS[name].__doc__)
            for name, cls in _GROUP_CLASSES.items()
        },
    }
)


def of(scene: bpy.types.Scene) -> SinewCharacter:
    """Reading it makes it, in a scene that had none."""
    return scene.sinew_character


def _clear() -> None:
    """Removes the group from the file where nothing needs it any more."""
    if not any(properties.has_sinew(obj) for obj in bpy.data.objects):
        for scene in bpy.data.scenes:
            if scene.library is None and scene.is_property_set("sinew_character"):
                scene.property_unset("sinew_character")


FEATURE = Feature(
    (*_GROUP_CLASSES.values(), SinewCharacter),
    {"Scene.sinew_character": bpy.props.PointerProperty(type=SinewCharacter)},
    subscriptions=(
        (subscribers.after_removal, _clear),
        (subscribers.evaluated, _forget),
        (subscribers.stepped, _forget),
        (subscribers.loaded, _forget),
    ),
)
