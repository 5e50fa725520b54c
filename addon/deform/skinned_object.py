# SPDX-License-Identifier: GPL-3.0-or-later
"""What Sinew knows about one skinned object between Blender's events."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from math import isclose
from typing import NamedTuple

import bpy
import numpy as np
import sinew

from ..attach import (
    attach,
    layout,
    normals,
    point_store,
    properties,
    stage_settings,
    undeformed,
    upstream_proxy,
)
from ..attach.icons import Icons
from ..attach.layout import Layout
from ..base.errors import SinewError
from ..io import armature_io, mesh_io
from ..io.actions import animated_paths
from ..skinning.rig import RigFacts
from ..skinning.skin_stack import NO_STAGES, ModifierFrame
from ..skinning.stages import StageValues
from . import small_meshes
from .bound import Bound, uid
from .changes import Changes
from .plan import Plan


@dataclass(frozen=True)
class Shown:
    """The shape that an object was last given. Immutable: it is replaced as a whole, on any thread.

    frames        the inputs of each Armature modifier; None before the first shape
    rest_points   float32 [vertices, 3], the points it was deformed from
    stage_values  the parameters of the stages after the blend
    number        serial number: each new shape gets another one
    milliseconds  time that computing it took
    """

    frames: list[ModifierFrame | None] | None = None
    rest_points: np.ndarray | None = None
    stage_values: StageValues = field(default_factory=lambda: NO_STAGES)
    number: int = 0
    milliseconds: float = 0.0


@dataclass
class Failures:
    """How deforming an object within Blender's evaluation failed.

    count, last  how often, and the last error
    in_a_row     how often in a row its mesh was not given points, for whatever reason
    """

    count: int = 0
    last: str = ""
    in_a_row: int = 0

    def add(self, failure: str) -> None:
        self.count, self.last = self.count + 1, failure


@dataclass
class Evaluation:
    """Blender's evaluations of an object since handlers were last called before one. They can run at the same
    time, as for a render: each adds to `given`; the rest says what the handlers, which come next, have to do.

    is_only_user         the mesh has as many users as when the plan was applied
    given                the addresses of the evaluated meshes that were given points
    changed_unannounced  the mesh was changed behind Sinew's handlers, and is evaluated without an event
    skip_reason          why a mesh was not given points; empty if it was
    user_error           what the user has to fix before it can be deformed
    """

    is_only_user: bool = True
    given: set[int] = field(default_factory=set)
    changed_unannounced: bool = False
    skip_reason: str = ""
    user_error: SinewError | None = None


class LeftOut(NamedTuple):
    """What Sinew has switched in an evaluated copy of an object.

    modifiers  the names of the Armature modifiers that are off
    icons      of the viewport and of renders, as the artist set them
    """

    modifiers: set[str]
    icons: tuple[Icons, Icons]


class Own(NamedTuple):
    """What the artist can change about an object itself and what decides how it is deformed, but for its
    stack and its vertex groups. Data is known by its session_uid, 0 for none.

    parent               with its type
    shows_key_alone      the active shape key alone
    smooth               the Corrective Smooth that Sinew has taken over
    can_be_marked        as from undeformed.can_mark()
    upstream             as from upstream_proxy.signature(); empty without a proxy
    armature_modes       of each armature
    rests                as from rests_of()
    animated             the paths that are animated, of its modifiers and of Sinew's settings
    """

    replaces_modifiers: bool
    parent: tuple[str, int]
    mesh: int
    mesh_users: int
    shows_key_alone: bool
    instance_type: str
    has_absolute_keys: bool
    smooth: str
    adds_rest_position: bool
    can_be_marked: bool
    upstream: str
    armature_modes: list[str]
    rests: list[int]
    animated: list[str]

    @classmethod
    def of(cls, obj: bpy.types.Object, now: Layout) -> Own:
        settings, mesh, keys = properties.of(obj), obj.data, obj.data.shape_keys
        return cls(
            replaces_modifiers=settings.replaces_modifiers,
            parent=(obj.parent_type, uid(obj.parent)),
            mesh=mesh.session_uid,
            mesh_users=mesh.users,
            shows_key_alone=obj.show_only_shape_key,
            instance_type=obj.instance_type,
            has_absolute_keys=keys is not None and not keys.use_relative,
            smooth=settings.before.smooth.name,
            adds_rest_position=obj.add_rest_position_attribute,
            can_be_marked=undeformed.can_mark(obj),
            upstream=upstream_proxy.signature(obj, now) if settings.storage.upstream_proxy else "",
            armature_modes=[armature.mode for armature in settings.armatures],
            rests=rests_of(obj),
            # Adding an animation has no event of its own.
            animated=sorted(p for p in animated_paths(obj) if p.startswith(("sinew.", "modifiers"))),
        )


class Surroundings(NamedTuple):
    """What can change about other data with the scene's structure and decides how an object is deformed.

    point_buffer, upstream_proxy  the session_uid, 0 for none
    are_deleted                   whether each armature is
    is_read                       another object reads its normals
    """

    is_editable: bool
    mesh_is_editable: bool
    point_buffer: int
    upstream_proxy: int
    are_deleted: list[bool]
    is_read: bool

    @classmethod
    def of(cls, obj: bpy.types.Object) -> Surroundings:
        settings, mesh = properties.of(obj), obj.data
        has_normals = normals.are_given(settings) and normals.domain_of(mesh) != ""
        return cls(
            obj.is_editable,
            mesh.is_editable,
            uid(settings.storage.point_buffer),
            uid(settings.storage.upstream_proxy),
            [attach.is_deleted(armature) for armature in settings.armatures],
            has_normals and normals.is_read_by_others(obj),
        )


@dataclass(frozen=True)
class Noted:
    """An object as it was when its plan was applied. Immutable: it is replaced as a whole.

    layout               its stack
    own, surroundings    what else decides how it is deformed
    attributes           the mesh's attributes of points and of normals; empty where the point buffer has them
    normals_domain       the normals that drew the mesh, as from normals.domain_of()
    volume_keyed         for each Armature modifier, whether an animation chooses between its two methods
    groups               the names of its vertex groups
    loses_marks          as from undeformed.loses_marks()
    dependencies         the session_uid of everything that the shape depends on
    builtin_fingerprint  why its Armature modifiers deform it (small_meshes.fingerprint()); else empty
    data_versions        versions of the methods' vertex data, for each Armature modifier
    volume               of one cubic unit of the object in the world
    """

    name: str
    layout: Layout
    own: Own
    surroundings: Surroundings
    attributes: tuple[str, str]
    normals_domain: str
    volume_keyed: list[bool]
    groups: list[str]
    loses_marks: bool
    dependencies: set[int]
    builtin_fingerprint: list[str]
    data_versions: list[int]
    volume: float

    @classmethod
    def of(cls, obj: bpy.types.Object, now: Layout, plan: Plan, bound: Bound) -> Noted:
        storage, mesh = properties.of(obj).storage, obj.data
        uids = {obj.session_uid, mesh.session_uid, uid(mesh.shape_keys), uid(storage.upstream_proxy)}
        return cls(
            name=obj.name,
            layout=now,
            own=Own.of(obj, now),
            surroundings=Surroundings.of(obj),
            attributes=(storage.attribute, point_store.normals_name(storage.attribute)),
            normals_domain=normals.domain_of(mesh),
            volume_keyed=[attach.is_volume_followed(obj, skin) for skin in now.skins],
            groups=obj.vertex_groups.keys(),
            loses_marks=undeformed.loses_marks(obj, now),
            dependencies=uids | set(bound.armatures),
            builtin_fingerprint=small_meshes.fingerprint(obj) if plan.uses_builtin else [],
            data_versions=bound.data_versions,
            volume=obj.matrix_world.determinant(),
        )

    @cached_property
    def are_options_keyed(self) -> bool:
        """Whether an animation sets options of an Armature modifier beside Preserve Volume."""
        return any(skin.armature.options is None for skin in self.layout.skins)


@dataclass
class SkinnedObject:
    """An object that was read.

    bound, shown   what it is deformed by, and its shape; both change only under the lock, as Blender may
                   evaluate the object on another thread, or on two for a render
    plan           who deforms it
    noted          the object when the plan was applied
    left_out       what is switched off in evaluated copies, by their addresses
    viewport_mesh  the address of the evaluated mesh that viewports showed last, or 0. Once Blender has freed
                   it, a copy of an exporter may get the address: its Armature modifiers are then off
    group_losses   how often its modifier had lost its node group
    needs_plan     a new plan has to be made at the next event
    needs_recheck  the mesh may have changed since it was read: it is read again at the next event, or when it
                   is measured
    facts          as from survey.facts_of(); None until it is asked for
    """

    bound: Bound
    noted: Noted
    plan: Plan
    shown: Shown = field(default_factory=Shown)
    evaluation: Evaluation = field(default_factory=Evaluation)
    lock: sinew.Lock = field(default_factory=sinew.Lock)
    failures: Failures = field(default_factory=Failures)
    left_out: dict[int, LeftOut] = field(default_factory=dict)
    viewport_mesh: int = 0
    needs_plan: bool = False
    group_losses: int = 0
    needs_recheck: bool = False
    facts: RigFacts | None = None

    @property
    def has_new_data(self) -> bool:
        """Whether the methods' vertex data changed since the object was last updated."""
        return self.noted.data_versions != self.bound.data_versions

    def bind(self, bound: Bound) -> None:
        """Sets what the object is deformed by. Drops the shape where modifiers, bones or weights changed."""
        if bound is self.bound:
            return
        with self.lock:
            if bound.is_of_another_stack(self.bound):
                self.shown, self.evaluation = Shown(number=self.shown.number), Evaluation()
                self.facts = None
            bound.take_over(self.bound)
            self.bound = bound

    @property
    def points(self) -> np.ndarray:
        """The skin stack's points of the last frame, float32 [vertices, 3], object space."""
        with self.lock:
            return self.bound.skin_stack.points

    @property
    def normal_count(self) -> int:
        """How many normals Sinew gives with the points."""
        return self.bound.source.normal_count(self.plan.normals.domain)

    def fail(self, error: Exception) -> None:
        """Notes an error that was raised within Blender's evaluation."""
        if isinstance(error, SinewError):
            self.evaluation.user_error = error
        self.evaluation.skip_reason = f"{type(error).__name__}: {error}"
        self.failures.add(self.evaluation.skip_reason)

    def take_off_normals(self, mesh: bpy.types.Mesh) -> None:
        """Gives a mesh the custom normals that it would have without Sinew's.

        mesh  made from the object's evaluated mesh
        """
        if self.plan.normals.domain:
            mesh_io.restore_custom_normals(mesh, self.bound.source.shading.custom)

    def is_untouched_by(self, changes: Changes) -> bool:
        """Whether the changes include nothing that the shape depends on."""
        return (
            changes.complete
            and not (changes.structure or changes.armatures)
            and self.noted.dependencies.isdisjoint(changes.touched)
        )

    def is_untouched_by_frame(self, obj: bpy.types.Object, meshes: set[int] | None) -> bool:
        """Whether a change of frame left everything that the shape is made from as it was. Always true where
        Blender deforms.

        meshes  Changes.meshes_in() of this change of frame, which changed nothing else
        """
        if self.noted.own.rests != rests_of(obj):
            return False
        if meshes is None:
            return not self.needs_recheck
        if self.plan.uses_builtin:
            self.needs_recheck = True
            return True
        if self.needs_recheck or obj.data.session_uid in meshes:
            return False
        # Where vertex groups are added, removed or renamed, Blender lists the scene as changed, too.
        now = layout.read(obj)
        return self.noted.layout == now and self.noted.own == Own.of(obj, now)

    def was_only_posed(self, obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph, changes: Changes) -> bool:
        """Whether the last evaluation gave the object its shape, and nothing else has to be checked.

        changes  as from Changes.of_poses()
        """
        if self.needs_plan or self.needs_recheck or not self.is_attached(obj):
            return False
        if self.noted.dependencies.isdisjoint(changes.touched):
            return self.plan.is_in_depsgraph
        return (
            self.was_deformed(obj, depsgraph)
            and self.noted.name == obj.name
            and self.noted.layout.has_switches_of(obj)
            and isclose(obj.matrix_world.determinant(), self.noted.volume, rel_tol=stage_settings.SAME_SCALE)
            and not self.have_bones_changed(obj, depsgraph, changes)
        )

    def have_bones_changed(
        self,
        obj: bpy.types.Object,
        depsgraph: bpy.types.Depsgraph,
        changes: Changes,
        are_unknown: bool = False,
    ) -> bool:
        """Whether the bones of one of the armatures differ from those read. An armature in edit mode counts
        as unchanged.

        are_unknown  the changes do not say which armatures may have other bones
        """
        settings: properties.SinewSettings = obj.sinew
        changed, are_unknown = False, are_unknown or self.noted.own.rests != rests_of(obj)
        for skin, replaced in zip(self.bound.skin_stack.skins, settings.replaced_modifiers, strict=False):
            armature, known = replaced.armature, skin.deformer.bones
            if armature is None or armature.data.is_editmode:
                continue
            if are_unknown or armature.data.session_uid in changes.armatures or not known.complete:
                # Clothes and hair have the armature of the body.
                if armature.session_uid not in changes.bones:
                    bones = armature_io.read_current_bones(armature, depsgraph)
                    changes.bones[armature.session_uid] = bones
                changed |= not changes.bones[armature.session_uid].equals(known)
        return changed

    def is_as_noted(self, obj: bpy.types.Object, now: Layout) -> bool:
        """Whether the object itself is as it was when the plan was applied.

        now  its layout
        """
        if self.noted.layout != now or self.noted.groups != obj.vertex_groups.keys():
            return False
        if self.noted.own != Own.of(obj, now):
            return False
        # Going through the nodes in front takes long; without a proxy there are none.
        has_proxy = properties.of(obj).storage.upstream_proxy is not None
        return not has_proxy or self.noted.loses_marks == undeformed.loses_marks(obj, now)

    def has_same_surroundings(self, obj: bpy.types.Object) -> bool:
        """Whether the data around it is as it was when the plan was applied."""
        return self.noted.surroundings == Surroundings.of(obj)

    def was_deformed(self, obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> bool:
        """Whether the last evaluation gave the object its shape."""
        if self.plan.uses_builtin:
            return self.noted.builtin_fingerprint == small_meshes.fingerprint(obj)
        given = self.evaluation.given
        return bool(given) and obj.data.evaluated_get(depsgraph).as_pointer() in given

    def note_shown(self, obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> None:
        """Notes the mesh that this depsgraph, a viewport's, shows, if it was given points."""
        mesh = obj.data.evaluated_get(depsgraph).as_pointer()
        if mesh in self.evaluation.given:
            self.viewport_mesh = mesh

    def is_attached(self, obj: bpy.types.Object) -> bool:
        """Whether Sinew's modifier is there, with its node group where that is needed. Another add-on's
        handler can remove them without any event."""
        modifier = obj.modifiers.get(self.noted.layout.sinew)
        if self.plan.uses_builtin:
            return modifier is not None
        return getattr(modifier, "node_group", None) is not None


def rests_of(obj: bpy.types.Object) -> list[int]:
    """The session_uid of the data of each Armature modifier's armature, which have the bones at rest."""
    armatures = (each.armature for each in obj.sinew.replaced_modifiers)
    return [0 if armature is None else armature.data.session_uid for armature in armatures]
