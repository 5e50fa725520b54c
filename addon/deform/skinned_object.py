# SPDX-License-Identifier: GPL-3.0-or-later
"""What Sinew knows about one skinned object between Blender's events."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import isclose

import bpy
import numpy as np
import sinew

from ..attach import attach, layout, normals, properties, stage_settings, undeformed, upstream_proxy
from ..attach.icons import Icons
from ..attach.layout import Layout
from ..base.errors import SinewError
from ..io import armature_io, mesh_io
from ..io.actions import animated_paths
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
    first_point   its first point; a different one means that somebody else wrote the points
    number        serial number: each new shape gets another one
    milliseconds  time that computing it took
    """

    frames: list[ModifierFrame | None] | None = None
    rest_points: np.ndarray | None = None
    stage_values: StageValues = field(default_factory=lambda: NO_STAGES)
    first_point: bytes | None = None
    number: int = 0
    milliseconds: float = 0.0


@dataclass
class Evaluation:
    """How Blender's last evaluation of an object went.

    is_only_user         the mesh has as many users as when the plan was applied
    mesh                 the address of the evaluated mesh that was given points, or 0; compared only within
                         the same event, while Blender keeps the mesh
    mesh_shown           the address of the evaluated mesh that viewports showed last, or 0
    icons                of the viewport and of renders, as the artist or an animation set them
    left_out             the names of the modifiers that are switched off in an evaluated copy, by its address
    is_event_known       Blender called handlers before the evaluation, or Sinew caused it
    was_tagged           Sinew has tagged the object for another evaluation since
    changed_unannounced  the mesh was replaced without any event before the evaluation
    skip_reason          why the mesh was not given points; empty if it was
    user_error           what the user has to fix before it can be deformed
    failures, failure    how often deforming raised an error, and the last error
    failures_in_a_row    how often in a row the mesh was not given points
    """

    is_only_user: bool = True
    mesh: int = 0
    mesh_shown: int = 0
    icons: tuple[Icons, Icons] | None = None
    left_out: dict[int, set[str]] = field(default_factory=dict)
    is_event_known: bool = True
    was_tagged: bool = False
    changed_unannounced: bool = False
    skip_reason: str = ""
    user_error: SinewError | None = None
    failures: int = 0
    failure: str = ""
    failures_in_a_row: int = 0

    def fail(self, error: Exception) -> None:
        if isinstance(error, SinewError):
            self.user_error = error
        self.mesh = 0
        self.note_failure(f"{type(error).__name__}: {error}")

    def note_failure(self, failure: str) -> None:
        self.skip_reason = self.failure = failure
        self.failures += 1


@dataclass(frozen=True)
class Noted:
    """An object as it was when its plan was applied. Immutable: it is replaced as a whole.

    layout               its stack
    attribute            the mesh's point attribute; empty where the point buffer has the points
    normals_domain       the normals that drew the mesh, as from normals.domain_of()
    mesh_users           the number of users of the mesh; with several, another could read while Sinew writes
    volume_keyed         for each Armature modifier, whether an animation chooses between its two methods
    rests                from rests_of()
    state                what else the artist can change about the object itself, from _own_facts()
    surroundings         from surroundings_of()
    groups               the names of its vertex groups
    loses_marks          as from undeformed.loses_marks()
    dependencies         the session_uid of everything that the shape depends on
    builtin_fingerprint  why its Armature modifiers deform it (small_meshes.fingerprint()); else empty
    data_versions        versions of the methods' vertex data, for each Armature modifier
    volume               of one cubic unit of the object in the world
    """

    name: str
    layout: Layout
    attribute: str
    normals_domain: str
    mesh_users: int
    volume_keyed: list[bool]
    rests: list[int | None]
    state: list
    surroundings: list
    groups: list[str]
    loses_marks: bool
    dependencies: set[int]
    builtin_fingerprint: list[str]
    data_versions: list[int]
    volume: float

    @classmethod
    def of(cls, obj: bpy.types.Object, now: Layout, plan: Plan, bound: Bound) -> Noted:
        storage, mesh = properties.of(obj).storage, obj.data
        own = {obj.session_uid, mesh.session_uid, uid(mesh.shape_keys), uid(storage.upstream_proxy)}
        return cls(
            name=obj.name,
            layout=now,
            attribute=storage.attribute,
            normals_domain=normals.domain_of(mesh),
            mesh_users=mesh.users,
            volume_keyed=[attach.is_volume_followed(obj, skin) for skin in now.skins],
            rests=rests_of(obj),
            state=_own_facts(obj, now),
            surroundings=surroundings_of(obj),
            groups=obj.vertex_groups.keys(),
            loses_marks=undeformed.loses_marks(obj, now),
            dependencies=own | set(bound.armatures),
            builtin_fingerprint=small_meshes.fingerprint(obj) if plan.uses_builtin else [],
            data_versions=bound.data_versions,
            volume=obj.matrix_world.determinant(),
        )

    @property
    def are_options_keyed(self) -> bool:
        """Whether an animation sets options of an Armature modifier beside Preserve Volume."""
        return any(skin.armature.options is None for skin in self.layout.skins)


@dataclass
class SkinnedObject:
    """An object that was read.

    bound, shown   what it is deformed by, and its shape; both change only under the lock, as Blender may
                   evaluate the object on another thread, or on two for a render
    plan           who deforms it; already applied to it unless needs_apply
    noted          the object when the plan was applied
    group_losses   how often its modifier had lost its node group
    needs_recheck  the mesh may have changed since it was read: it is read again at the next event, or when it
                   is measured
    """

    bound: Bound
    noted: Noted
    plan: Plan
    shown: Shown = field(default_factory=Shown)
    evaluation: Evaluation = field(default_factory=Evaluation)
    lock: sinew.Lock = field(default_factory=sinew.Lock)
    needs_apply: bool = False
    group_losses: int = 0
    needs_recheck: bool = False

    @property
    def has_new_data(self) -> bool:
        """Whether the methods' vertex data changed since the object was last updated."""
        return self.noted.data_versions != self.bound.data_versions

    def bind(self, bound: Bound) -> None:
        """Sets what the object is deformed by. Drops the shape where modifiers, bones or weights changed."""
        with self.lock:
            if bound.is_of_another_stack(self.bound):
                self.shown = Shown(number=self.shown.number)
                # Earlier failures still count.
                old = self.evaluation
                self.evaluation = Evaluation(
                    icons=old.icons,
                    left_out=old.left_out,
                    failures=old.failures,
                    failure=old.failure,
                    failures_in_a_row=old.failures_in_a_row,
                )
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
        if self.noted.rests != rests_of(obj):
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
        return self.noted.layout == now and self.noted.state == _own_facts(obj, now)

    def was_only_posed(self, obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph, changes: Changes) -> bool:
        """Whether the last evaluation gave the object its shape, and nothing else has to be checked.

        changes  as from Changes.of_poses()
        """
        if self.needs_apply or self.needs_recheck or not self.is_attached(obj):
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
        changed, are_unknown = False, are_unknown or self.noted.rests != rests_of(obj)
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
        if self.noted.state != _own_facts(obj, now):
            return False
        # Going through the nodes in front takes long; without a proxy there are none.
        has_proxy = properties.of(obj).storage.upstream_proxy is not None
        return not has_proxy or self.noted.loses_marks == undeformed.loses_marks(obj, now)

    def has_same_surroundings(self, obj: bpy.types.Object) -> bool:
        """Whether the data around it is as it was when the plan was applied."""
        return self.noted.surroundings == surroundings_of(obj)

    def was_deformed(self, obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> bool:
        """Whether the last evaluation gave the object its shape."""
        if self.plan.uses_builtin:
            return self.noted.builtin_fingerprint == small_meshes.fingerprint(obj)
        given = self.evaluation.mesh
        return given != 0 and given == obj.data.evaluated_get(depsgraph).as_pointer()

    def note_shown(self, obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> None:
        """Notes the mesh that viewports show, at the end of an event."""
        given = self.evaluation.mesh
        is_new = given not in (0, self.evaluation.mesh_shown) and depsgraph.mode == "VIEWPORT"
        if is_new and given == obj.data.evaluated_get(depsgraph).as_pointer():
            self.evaluation.mesh_shown = given

    def is_attached(self, obj: bpy.types.Object) -> bool:
        """Whether Sinew's modifier is there, with its node group where that is needed. Another add-on's
        handler can remove them without any event."""
        modifier = obj.modifiers.get(self.noted.layout.sinew)
        if self.plan.uses_builtin:
            return modifier is not None
        return getattr(modifier, "node_group", None) is not None


def _own_facts(obj: bpy.types.Object, now: Layout) -> list:
    """Everything about the object itself that the artist can change and that decides how it is deformed, but
    for its vertex groups and its stack."""
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
        settings.before.smooth.name,
        obj.add_rest_position_attribute,
        undeformed.can_mark(obj),
    ]
    if settings.storage.upstream_proxy is not None:
        state.append(upstream_proxy.signature(obj, now))
    state += [armature.mode for armature in settings.armatures] + rests_of(obj)
    # Adding an animation has no event of its own.
    return state + sorted(path for path in animated_paths(obj) if path.startswith(("sinew.", "modifiers")))


def rests_of(obj: bpy.types.Object) -> list[int | None]:
    """The session_uid of the data of each Armature modifier's armature, which have the bones at rest."""
    kept = obj.sinew.replaced_modifiers
    return [each.armature and each.armature.data.session_uid for each in kept]


def surroundings_of(obj: bpy.types.Object) -> list:
    """Everything about other data that can change with the scene's structure and that decides how the object
    is deformed."""
    settings, mesh = properties.of(obj), obj.data
    gives_normals = normals.are_given(settings) and normals.domain_of(mesh) != ""
    return [
        obj.is_editable,
        mesh.is_editable,
        uid(settings.storage.point_buffer),
        uid(settings.storage.upstream_proxy),
        [attach.is_deleted(armature) for armature in settings.armatures],
        gives_normals and normals.is_read_by_others(obj),
    ]
