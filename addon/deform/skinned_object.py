# SPDX-License-Identifier: GPL-3.0-or-later
"""What is known of one skinned object between Blender's events."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field

import bpy
import numpy as np

from ..attach import attach, normals, properties, stack, upstream_proxy
from ..attach.modifier_options import ModifierOptions
from ..core.errors import SinewError
from ..core.session import NO_STAGES, SkinStageFrame
from ..core.stages import StageValues
from ..io import mesh_io
from ..io.animation_paths import animated_paths, is_visibility_animated
from . import small_meshes
from .bound import Bound, uid
from .changes import Changes
from .plan import Plan, State


@dataclass
class Shown:
    """The shape that an object has.

    frames        what decided it, for each Armature modifier; None before the first
    rest_points   float32 [vertices, 3], what it was deformed from
    stage_values  the parameters of the stages that followed
    first_point   its first point, by which it is known from one that somebody else wrote
    number        how many there have been: another shape has another number
    milliseconds  that it took
    """

    frames: list[SkinStageFrame | None] | None = None
    rest_points: np.ndarray | None = None
    stage_values: StageValues = field(default_factory=lambda: NO_STAGES)
    first_point: bytes | None = None
    number: int = 0
    milliseconds: float = 0.0


@dataclass
class Evaluation:
    """How the last evaluation of Blender's went for an object.

    mesh                 the address of the evaluated mesh that was given points, or 0: only compared within
                         the same event, while Blender keeps the mesh
    is_event_known       Blender called handlers before it, or Sinew itself caused it
    was_tagged           Sinew has had Blender evaluate the object since
    changed_unannounced  the mesh was another one, without any event before it
    skip_reason          why it was not given points; empty where it was
    user_error           what the user has to see to before it can be
    failures, failure    how often it failed, and what failed last
    failures_in_a_row    how often in a row it was not given points
    """

    mesh: int = 0
    is_event_known: bool = True
    was_tagged: bool = False
    changed_unannounced: bool = False
    skip_reason: str = ""
    user_error: SinewError | None = None
    failures: int = 0
    failure: str = ""
    failures_in_a_row: int = 0

    def begin_anew(self) -> Evaluation:
        """None was yet; what failed before still counts."""
        return Evaluation(
            failures=self.failures, failure=self.failure, failures_in_a_row=self.failures_in_a_row
        )

    def fail(self, error: Exception) -> None:
        if isinstance(error, SinewError):
            self.user_error = error
        self.skip_reason = self.failure = f"{type(error).__name__}: {error}"
        self.failures += 1

    def succeed(self, mesh: bpy.types.Mesh) -> None:
        self.mesh, self.skip_reason, self.failures_in_a_row = mesh.as_pointer(), "", 0


@dataclass
class SkinnedObject:
    """An object that has Sinew and is on.

    bound, shown         what it is deformed by, and its shape; both change under the lock alone, as Blender
                         may evaluate the object on another thread, or on two for a render
    plan                 who deforms it; applied to it unless needs_apply
    name, mode           the object's own, as they were then
    modifier             the name of Sinew's modifier, by which it is found again
    attribute            of the mesh, that has the points; empty where the point buffer has them
    normals_attribute    that has the normals; empty where none has
    normals_domain       which normals drew the mesh, as normals.domain_of()
    mesh_users           how many the mesh had; others could read while it is written
    is_only_user         it has as many now
    visibility_keyed     for each Armature modifier, whether an animation decides when it is on
    object_state         what the artist can change of the object itself, as object_state_of()
    dependencies         the session_uid of all that the shape depends on
    builtin_fingerprint  where its Armature modifiers deform it: what decided that; else empty
    group_losses         how often its modifier had lost its node group
    needs_recheck        the mesh may have changed since it was read: it is read with the next event, or when
                         somebody measures it
    dirtied_by_frames    the last change of frame moved the object or its rest points
    data_versions        of what methods keep of vertices, for each Armature modifier
    """

    bound: Bound
    name: str
    mode: str
    shown: Shown = field(default_factory=Shown)
    evaluation: Evaluation = field(default_factory=Evaluation)
    lock: threading.Lock = field(default_factory=threading.Lock)
    plan: Plan = field(default_factory=lambda: Plan(State.OFF))
    needs_apply: bool = True
    modifier: str = ""
    attribute: str = ""
    normals_attribute: str = ""
    normals_domain: str = ""
    mesh_users: int = 0
    is_only_user: bool = True
    visibility_keyed: list[bool] = field(default_factory=list)
    object_state: list = field(default_factory=list)
    dependencies: set[int] = field(default_factory=set)
    builtin_fingerprint: list[str] = field(default_factory=list)
    group_losses: int = 0
    needs_recheck: bool = False
    dirtied_by_frames: bool = False
    data_versions: list[int] = field(default_factory=list)

    @property
    def has_new_data(self) -> bool:
        """Whether methods keep other numbers of vertices than when the object was last seen to."""
        return self.data_versions != self.bound.data_versions

    def bind(self, bound: Bound) -> None:
        """Another shape comes next where the stack of modifiers or its bones are others."""
        with self.lock:
            if bound.is_of_another_stack(self.bound):
                self.shown = Shown(number=self.shown.number)
                self.evaluation = self.evaluation.begin_anew()
                self.dirtied_by_frames = False
            self.bound = bound

    def note_object(self, obj: bpy.types.Object, plan: Plan) -> None:
        """The plan is applied to the object, which is as it is now."""
        self.plan, self.needs_apply, self.name = plan, False, obj.name
        self.evaluation.was_tagged = True
        self.builtin_fingerprint = small_meshes.fingerprint(obj) if plan.state is State.BUILT_IN else []
        self.visibility_keyed = [is_visibility_animated(obj, m) for m in stack.armature_modifiers(obj)]
        self.normals_domain = normals.domain_of(obj.data)
        self.modifier, self.object_state = stack.sinew_modifier(obj).name, object_state_of(obj)
        proxy = properties.of(obj).upstream_proxy
        own = {obj.session_uid, obj.data.session_uid, uid(obj.data.shape_keys), uid(proxy)}
        self.dependencies = own | set(self.bound.armatures)

    @property
    def uses_builtin(self) -> bool:
        """Whether its Armature modifiers deform it, though Sinew is on."""
        return bool(self.builtin_fingerprint)

    @property
    def points(self) -> np.ndarray:
        """The shape of the last frame, float32 [vertices, 3], object space; the stack's own."""
        with self.lock:
            return self.bound.skin_stack.points

    @property
    def normal_count(self) -> int:
        """How many normals Sinew gives with the points."""
        return self.bound.source.normal_count(self.plan.normals.domain)

    def take_off_normals(self, mesh: bpy.types.Mesh) -> None:
        """Gives a mesh that was made of the object's evaluated one the custom normals that this would have
        without those that Sinew gave."""
        if self.plan.normals.domain:
            mesh_io.restore_custom_normals(mesh, self.bound.source.shading.custom)

    def is_untouched_by(self, changes: Changes) -> bool:
        """Whether nothing that the shape depends on is among the changes."""
        return (
            changes.complete
            and not (changes.structure or changes.armatures)
            and self.dependencies.isdisjoint(changes.touched)
        )

    def is_untouched_by_frame(self, obj: bpy.types.Object, meshes: set[int] | None) -> bool:
        """Whether a change of frame, whose Changes.meshes_in() these are and which changed nothing else, kept
        what the shape is made of as it was. What Blender deforms has its shape in any case."""
        if meshes is None:
            return not self.needs_recheck
        if self.uses_builtin:
            self.needs_recheck = True
            return True
        if self.needs_recheck or obj.data.session_uid in meshes:
            return False
        return self.mode == obj.mode and self.is_as_noted(obj)

    def is_as_noted(self, obj: bpy.types.Object) -> bool:
        """Whether what the artist can change of the object itself is as it was when the plan was applied."""
        return self.object_state == object_state_of(obj)

    def was_deformed(self, obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> bool:
        """Whether the last evaluation gave the object its shape."""
        if self.uses_builtin:
            return self.builtin_fingerprint == small_meshes.fingerprint(obj)
        given = self.evaluation.mesh
        return given != 0 and given == obj.data.evaluated_get(depsgraph).as_pointer()

    def is_attached(self, obj: bpy.types.Object) -> bool:
        """Whether Sinew's modifier is there, with its node group where that is needed: for what another
        add-on's handler takes away there is no event."""
        modifier = obj.modifiers.get(self.modifier)
        if self.uses_builtin:
            return modifier is not None
        return getattr(modifier, "node_group", None) is not None


def object_state_of(obj: bpy.types.Object) -> list:
    """What the artist can change of the object itself that decides how it is deformed."""
    settings = properties.of(obj)
    mesh, keys = obj.data, obj.data.shape_keys
    state = [
        settings.replaces_modifiers,
        obj.parent_type,
        uid(obj.parent),
        mesh.session_uid,
        mesh.users,
        obj.show_only_shape_key,
        obj.instance_type,
        keys is None or keys.use_relative,
    ]
    if settings.upstream_proxy is not None:
        state.append(upstream_proxy.signature(obj))
    state += [armature.mode for armature in settings.armatures]
    # What an animation sets has no other event.
    state += sorted(path for path in animated_paths(obj) if path.startswith(("sinew.", "modifiers")))
    state += obj.vertex_groups.keys()
    for modifier in obj.modifiers:
        state += (modifier.name, modifier.show_viewport, modifier.show_render)
        if modifier.type == "SUBSURF":
            # With none of them it is off.
            state += (modifier.levels, modifier.render_levels)
        if modifier.type == "ARMATURE":
            state += (uid(modifier.object), attach.method_of(modifier), *ModifierOptions.values(modifier))
    return state
