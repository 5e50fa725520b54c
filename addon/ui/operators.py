# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel's operators: poll, gather, one call, report."""

from collections.abc import Callable, Collection, Iterator
from typing import ClassVar

import bpy

from ..attach import attach, corrective_smooth, properties, references, stack, stage_settings
from ..attach.feature import Feature
from ..attach.layout import parent_deforms
from ..attach.stage_settings import method_items
from ..attach.updates import is_rendering_in_window, updates_suspended
from ..base.errors import SinewError
from ..deform import session
from ..io import addon_preferences
from .translations import counted, tr


def selected(context: bpy.types.Context) -> list[bpy.types.Object]:
    """Returns the selected objects, also in a context without a window's members, as of a script."""
    found = getattr(context, "selected_objects", None)
    return list(context.view_layer.objects.selected if found is None else found)


def active_object(context: bpy.types.Context) -> bpy.types.Object | None:
    """Returns the active object, as selected() does."""
    return getattr(context, "active_object", context.view_layer.objects.active)


def _chosen(context: bpy.types.Context) -> list[bpy.types.Object]:
    """Returns the selected objects and the active one."""
    chosen, active = selected(context), active_object(context)
    if active is not None and active not in chosen:
        chosen.append(active)
    return chosen


def _armature_meant(obj: bpy.types.Object) -> bpy.types.Object | None:
    """Returns the armature that an object is, that deforms it, or that it is parented to."""
    if obj.type == "ARMATURE":
        return obj
    found, parent = attach.armature_of(obj), obj.parent
    while found is None and parent is not None:
        found, parent = (parent if parent.type == "ARMATURE" else None), parent.parent
    return found


def armatures(context: bpy.types.Context) -> list[bpy.types.Object]:
    """Returns the selected or active armatures, and those of selected meshes; the active one first."""
    found = {_armature_meant(obj) for obj in _chosen(context)} - {None}
    return sorted(found, key=lambda o: (o != active_object(context), o.name))


def _each_target(context: bpy.types.Context) -> Iterator[bpy.types.Object]:
    """Yields the meshes of targets(), selected ones first, as most callers need only one."""
    chosen, meant = _chosen(context), set(armatures(context))
    yield from attach.deformed_meshes([obj for obj in chosen if obj.name in context.scene.objects])
    if not meant:
        return
    for obj in context.scene.objects:
        if obj.type == "MESH" and obj not in chosen and _is_of(obj, meant):
            yield obj


def _is_of(obj: bpy.types.Object, meant: Collection[bpy.types.Object]) -> bool:
    """Whether one of the armatures deforms a mesh; for most meshes of a scene this is decided at once."""
    if not (stack.has_armature_modifier(obj) or parent_deforms(obj) or properties.has_sinew(obj)):
        return False
    return attach.armature_of(obj) in meant and bool(attach.deformed_meshes([obj]))


def targets(context: bpy.types.Context) -> list[bpy.types.Object]:
    """Returns the meshes to act on: all that the armatures() deform, as clothes, hair and eyes belong to the
    selected body; the active one first."""
    active, found = active_object(context), list(_each_target(context))
    order = {name: place for place, name in enumerate(context.scene.objects.keys())} if found else {}
    return sorted(found, key=lambda obj: (obj != active, order[obj.name]))


def sinew_targets(context: bpy.types.Context) -> list[bpy.types.Object]:
    return [obj for obj in targets(context) if properties.has_sinew(obj)]


def has_sinew_targets(context: bpy.types.Context) -> bool:
    return any(properties.has_sinew(obj) for obj in _each_target(context))


class OfSkinned:
    """A panel that is shown where Sinew deforms a target."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return has_sinew_targets(context)


def are_any_on(context: bpy.types.Context) -> bool:
    """Whether Sinew is on for any target: otherwise panels with its numbers are grey."""
    return any(properties.of(obj).enabled for obj in _each_target(context) if properties.has_sinew(obj))


def waits_for_render() -> str:
    """Returns what a button has to wait for, as the render's thread reads what it would change; otherwise
    ""."""
    return "Wait for the end of the render" if is_rendering_in_window() else ""


class Named:
    """A base class of operators, which Blender knows by the class's name. Subclasses have refusal(context),
    or run(context), which may raise SinewError, or both. run() returns what execute() does, or nothing."""

    def __init_subclass__(cls) -> None:
        cls.bl_idname = cls.__name__.replace("SINEW_OT_", "sinew.")

    @classmethod
    def refusal(cls, context: bpy.types.Context) -> str:
        """Returns why it can not run now; empty where it can."""
        return ""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return cls._can_run(cls.refusal(context))

    @classmethod
    def _can_run(cls, reason: str) -> bool:
        if reason:
            cls.poll_message_set(tr(reason))
        return not reason

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            return self.run(context) or {"FINISHED"}
        except SinewError as error:
            return self.failed(error)

    def failed(self, error: SinewError) -> set[str]:
        self.report({"ERROR"}, str(error))
        return {"CANCELLED"}


class Acting(Named):
    """A base class of operators that wait for the end of a render."""

    bl_options: ClassVar = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return cls._can_run(cls.refusal(context) or waits_for_render())

    def execute(self, context: bpy.types.Context) -> set[str]:
        result = super().execute(context)
        if self.options.is_invoke and result == {"FINISHED"}:
            # Blender makes an undo step now, but not where a script has called it.
            references.forget()
        return result


class OnSinewObjects(Acting):
    @classmethod
    def refusal(cls, context: bpy.types.Context) -> str:
        return "" if has_sinew_targets(context) else "Select a mesh that Sinew deforms, or its armature"


class OnDeformed(Acting):
    @classmethod
    def refusal(cls, context: bpy.types.Context) -> str:
        is_any = any(attach.armature_of(obj) is not None for obj in targets(context))
        return "" if is_any else "Select a mesh that an armature deforms, or the armature"


def can_take_over(obj: bpy.types.Object) -> bool:
    """Whether the mesh has a Corrective Smooth that Delta Mush could replace."""
    return properties.of(obj).enabled and not corrective_smooth.why_none(obj)


def _for_each(
    operator: bpy.types.Operator,
    objects: list[bpy.types.Object],
    action: Callable[[bpy.types.Object], None],
    done: str,
) -> set[str]:
    problems = []
    for obj in objects:
        try:
            action(obj)
        except SinewError as error:
            problems.append(str(error))
    count = len(objects) - len(problems)
    for problem in problems:
        operator.report({"WARNING" if count else "ERROR"}, problem)
    if count == 0:
        return {"CANCELLED"}
    meshes = counted(count, "{count} mesh", "{count} meshes")
    operator.report({"INFO"}, f"{tr(done)} {meshes}")
    return {"FINISHED"}


class OfOneMesh:
    """An operator on all meshes of a character, or on one by name."""

    name: bpy.props.StringProperty(
        name="Mesh",
        description="The only mesh to act on; empty: all of the character",
        options={"HIDDEN", "SKIP_SAVE"},
    )

    def meant(self, objects: list[bpy.types.Object]) -> list[bpy.types.Object]:
        return [obj for obj in objects if self.name in ("", obj.name)]


AS_BEFORE, RECOMMENDED = "AS_BEFORE", "RECOMMENDED"
# The choices of Add Sinew's first method.
FIRST_METHODS = [
    (
        AS_BEFORE,
        "As the Armature modifier is set",
        "Each mesh keeps its shape; one that joins others has their settings",
        0,
    ),
    (RECOMMENDED, "Recommended", "Method and stages are measured and set for the character", 1000),
    *method_items(1),
]


class SINEW_OT_add(Acting, OfOneMesh, bpy.types.Operator):
    bl_label = "Add Sinew"
    bl_description = (
        "Deform all meshes of the armature with Sinew, in the place of their Armature modifiers. Those stay "
        "in the stack, where other tools find them"
    )

    method: bpy.props.EnumProperty(
        name="Method",
        description="What to start with",
        items=FIRST_METHODS,
        default=AS_BEFORE,
        options={"SKIP_SAVE"},
    )

    @classmethod
    def refusal(cls, context: bpy.types.Context) -> str:
        has_target = False
        for obj in _each_target(context):
            if not properties.has_sinew(obj):
                return ""
            has_target = True
        if has_target:
            return "The meshes of the armature have Sinew already"
        for other in attach.not_meshes(selected(context)):
            return tr("{name} is no mesh: Sinew deforms meshes only", name=other.name)
        return "Select a mesh with an Armature modifier, or an armature that deforms one"

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        # Only for a click: a script's default must not depend on the user's preferences.
        if not self.properties.is_property_set("method"):
            self.method = addon_preferences.value("first_method", default=AS_BEFORE)
        return self.execute(context)

    def run(self, context: bpy.types.Context) -> set[str]:
        method = None if self.method in (AS_BEFORE, RECOMMENDED) else self.method
        objects = self.meant([obj for obj in targets(context) if not properties.has_sinew(obj)])
        followers = [obj for obj in sinew_targets(context) if not properties.of(obj).is_own]

        def add(obj: bpy.types.Object) -> None:
            attach.add(obj, method)
            same = [o for o in followers if attach.armature_of(o) == attach.armature_of(obj)]
            if method is None and same:
                properties.share(same[0], obj)

        with updates_suspended():
            result = _for_each(self, objects, add, "Sinew deforms")
        for obj in filter(properties.has_sinew, objects):
            for sentence in attach.notes(obj):
                self.report({"WARNING"}, f"{obj.name}: {tr(sentence)}")
        session.refresh(context)
        if self.method == RECOMMENDED and result == {"FINISHED"}:
            bpy.ops.sinew.recommend("INVOKE_DEFAULT")
        return result


class SINEW_OT_rebind(OnSinewObjects, OfOneMesh, bpy.types.Operator):
    bl_label = "Rebind"
    bl_description = "Read meshes, weights and bones anew, and switch on again after an error"

    def run(self, context: bpy.types.Context) -> set[str]:
        objects = self.meant(sinew_targets(context))
        with updates_suspended():
            result = _for_each(self, objects, session.read_again, "Rebound")
        session.refresh(context)
        failed = [properties.of(obj).error for obj in objects if properties.of(obj).error]
        if failed:
            self.report({"ERROR"}, failed[0])
            return {"CANCELLED"}
        return result


class SINEW_OT_remove(OnSinewObjects, OfOneMesh, bpy.types.Operator):
    bl_label = "Remove"
    bl_description = (
        "Take Sinew off all meshes of the character and give their Armature modifiers back as they were"
    )

    def run(self, context: bpy.types.Context) -> set[str]:
        objects = self.meant(sinew_targets(context))
        return _for_each(self, objects, attach.remove, "Removed Sinew from")


class SINEW_OT_take_over_smooth(OnSinewObjects, OfOneMesh, bpy.types.Operator):
    bl_label = "Take Over Corrective Smooth"
    bl_description = (
        "Have Delta Mush smooth in the place of the Corrective Smooth modifier, by its settings. It stays in "
        "the stack, switched off while Sinew deforms"
    )

    @classmethod
    def refusal(cls, context: bpy.types.Context) -> str:
        objects = sinew_targets(context)
        if not objects or any(can_take_over(obj) for obj in objects):
            return super().refusal(context)
        on = [obj for obj in objects if properties.of(obj).enabled]
        # Of several meshes, one with a Corrective Smooth has more to say.
        on.sort(key=lambda obj: corrective_smooth.candidate(obj) is None)
        return f"{on[0].name}: {tr(corrective_smooth.why_none(on[0]))}" if on else "Switch Sinew on first"

    def run(self, context: bpy.types.Context) -> set[str]:
        objects = self.meant(sinew_targets(context))
        if not self.name:
            objects = [obj for obj in objects if can_take_over(obj)]
        with session.changing(context):
            return _for_each(self, objects, corrective_smooth.take_over, "Took over Corrective Smooth of")


class SINEW_OT_make_group(OnSinewObjects, OfOneMesh, bpy.types.Operator):
    bl_label = "Make Vertex Group"
    bl_description = (
        "Make the vertex group that says where the stage acts, and choose it. The shape stays as it is until "
        "you paint: for a mix it has no weights, for other stages all"
    )

    stage: bpy.props.StringProperty(options={"HIDDEN", "SKIP_SAVE"}, description="Name of the stage")

    def run(self, context: bpy.types.Context) -> set[str]:
        if self.stage not in stage_settings.STAGES:
            raise SinewError(tr("There is no stage {name}", name=repr(self.stage)))
        objects = self.meant(sinew_targets(context))
        if not self.name:
            objects = [obj for obj in objects if not properties.of(obj).is_own] or objects
        with session.changing(context):
            return _for_each(self, objects, self._make, "Made the vertex group of")

    def _make(self, obj: bpy.types.Object) -> None:
        stage, settings = stage_settings.STAGES[self.stage], getattr(properties.of(obj), self.stage)
        if obj.data.library is not None or obj.data.is_editmode:
            why = (
                "in edit mode; leave it"
                if obj.data.is_editmode
                else "linked from another file; make it local"
            )
            raise SinewError(f"{obj.name}: its mesh is {why} first")
        name = settings.group or stage.label
        group = obj.vertex_groups.get(name) if settings.group else None
        if group is None:
            group = obj.vertex_groups.new(name=name)
            if stage.name != "mix":
                group.add(range(len(obj.data.vertices)), 1.0, "REPLACE")
        settings.group = group.name


FEATURE = Feature(
    (
        SINEW_OT_add,
        SINEW_OT_rebind,
        SINEW_OT_remove,
        SINEW_OT_take_over_smooth,
        SINEW_OT_make_group,
    )
)
