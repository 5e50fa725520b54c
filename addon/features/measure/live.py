# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures skinned objects in their current shape, from what Sinew knows about them, without any evaluation
by Blender.

Shapes are the results of skinning alone, in world space; several objects are measured as one.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import bpy
import numpy as np

from ...attach import corrective_smooth, properties, stack, stage_settings, upstream_proxy
from ...attach.layout import method_of
from ...base.errors import SinewError
from ...deform import pose, session
from ...deform.bound import Bound
from ...deform.skinned_object import SkinnedObject
from ...io import armature_io, mesh_io, spaces
from ...skinning import influences
from ...skinning.engines import ENGINES
from ...skinning.rig import Bones
from ...skinning.scale_rule import BLENDER_4
from ...skinning.skin_stack import SkinStack
from ...skinning.stages import StageValues
from ...skinning.surface import Surface, joined
from ...skinning.twist_spread import NOT_TOLD, TwistInputs
from ...skinning.variants import Variant
from ...skinning.vectors import is_same_space, transformed, transformed_axes
from .metrics import FrameOfRig, Gauge, Measured, Pose, Shape

# Sets of objects that are kept prepared: those of the heat map and those of the panel.
MOST_SUBJECTS = 2

SkinnedObjects = Sequence[tuple[bpy.types.Object, SkinnedObject]]


@dataclass
class Part:
    """One of the objects: its binding when it was read, and a skin stack for other methods."""

    obj: bpy.types.Object
    skinned: SkinnedObject
    bound: Bound
    surface: Surface
    skin_stack: SkinStack


@dataclass(frozen=True)
class _Inputs:
    """What the shape of an object depends on; it is deformed only when needed."""

    part: Part
    rest_points: np.ndarray
    frames: pose.Frames
    stages: StageValues

    @classmethod
    def shown(cls, part: Part) -> Self:
        shown = part.skinned.shown
        return cls(part, shown.rest_points, shown.frames, shown.stage_values)

    def under(self, method: str | None) -> Self:
        """method: as of Moment.points()"""
        obj = self.part.obj
        if method is None:
            return self
        if method == properties.BLENDER:
            frames = pose.of_modifiers(obj, self.frames)
            return replace(self, frames=frames, stages=corrective_smooth.stage_values(obj))
        own = stage_settings.method_values(properties.of(obj), (method,))
        frames = [frame and replace(frame, method=method, mix="", parameters=own) for frame in self.frames]
        return replace(self, frames=frames)

    def under_variant(self, variant: Variant) -> Self:
        """The same under a method with its stages, or under the Armature modifiers."""
        if variant.method == properties.BLENDER:
            return self.under(properties.BLENDER)
        obj, is_engine = self.part.obj, variant.method in ENGINES
        scale = properties.of(obj).storage.world_scale or 1.0
        own = {
            name: value / scale if name in stage_settings.LENGTHS else value
            for name, value in variant.all_values.items()
        }
        of_method = {name: value for name, value in own.items() if name.startswith(f"{variant.method}.")}
        frames: pose.Frames = []
        for skin, frame in zip(self.part.skin_stack.skins, self.frames, strict=False):
            if frame is None:
                frames.append(None)
                continue
            deformer, rule = skin.deformer, variant.settings.get("scale_rule", frame.scale_rule)
            is_mixed = variant.mix and deformer.mix_weights is not None and not is_engine
            bones = frame.pose
            if is_engine:
                rule, bones = BLENDER_4.name, armature_io.decomposed(bones, deformer.bones.parents)
            of_mix = {name: value for name, value in own.items() if name.startswith(f"{variant.mix}.")}
            frames.append(
                replace(
                    frame,
                    method=variant.method,
                    mix=variant.mix if is_mixed else "",
                    parameters=of_method | of_mix,
                    scale_rule=rule,
                    pose=bones,
                )
            )
        stages = {
            stage: {name: own[f"{stage}.{name}"] for name in values}
            for stage, values in variant.stage_values.items()
        }
        return replace(self, frames=frames, stages={} if is_engine else stages)

    def of_mix(self, second: str) -> Self:
        """Under the first method of a mix or, where one is given, under the second. Armature modifiers with a
        method of their own are not mixed."""
        settings = properties.of(self.part.obj)
        frames = [frame and replace(frame, mix="") for frame in self.frames]
        if second:
            own = stage_settings.method_values(settings, (second,))
            frames = [
                replace(frame, method=second, parameters=own)
                if frame is not None and frame.method == settings.method
                else frame
                for frame in frames
            ]
        return replace(self, frames=frames)

    def points(self) -> np.ndarray:
        """float32 [vertices, 3], object space."""
        self.part.skin_stack.deform(self.rest_points, self.frames, values=self.stages)
        return self.part.skin_stack.points


@dataclass
class Subject:
    """Objects that are measured as one, with concatenated vertices.

    stamp              what `measured` was made from
    inputs             of each part, of the same frame
    worlds, armatures  world matrices of the parts, and of their first armatures
    rest               world points at rest
    under_other        the measures of the same frame under the method that distances are measured to, once
                       needed
    """

    parts: list[Part]
    gauge: Gauge
    stamp: tuple | None = None
    inputs: list[_Inputs] = field(default_factory=list)
    worlds: list[np.ndarray] = field(default_factory=list)
    armatures: list[np.ndarray] = field(default_factory=list)
    rest: np.ndarray | None = None
    measured: Measured | None = None
    under_other: Measured | None = None

    def split(self, values: np.ndarray) -> list[np.ndarray]:
        """Splits values of all vertices by object."""
        return np.split(values, np.cumsum([part.surface.vertex_count for part in self.parts])[:-1])


_subjects: dict[tuple[int, ...], Subject] = {}


def forget() -> None:
    _subjects.clear()


def measure(pairs: SkinnedObjects, other: str, depsgraph: bpy.types.Depsgraph) -> Subject | None:
    """Returns the objects with `measured` of the current frame; the same result object where nothing differs
    from the last call.

    other  the method that distances are measured to

    None where there is nothing to measure, or where a mesh and its shape momentarily have different vertices.
    """
    key = tuple(obj.session_uid for obj, _skinned in pairs)
    subject = _subjects.pop(key, None)
    if subject is None or not all(map(_is_current, subject.parts, pairs)):
        subject = _read(pairs, depsgraph, subject)
    if subject is None:
        return None
    _subjects[key] = subject
    while len(_subjects) > MOST_SUBJECTS:
        _subjects.pop(next(iter(_subjects)))
    worlds = [_world(obj, depsgraph) for obj, _skinned in pairs]
    armatures = [_world(properties.of(obj).armature, depsgraph) for obj, _skinned in pairs]
    stamp = (
        other,
        *((skinned.shown.number, _modifiers_methods(obj, other)) for obj, skinned in pairs),
        *(matrix.tobytes() for matrix in (*worlds, *armatures)),
    )
    if stamp != subject.stamp:
        inputs = [_Inputs.shown(part) for part in subject.parts]
        if not _is_same_rest(subject, inputs, worlds):
            subject.rest = _in_world([own.rest_points for own in inputs], worlds)
        subject.inputs, subject.worlds, subject.armatures = inputs, worlds, armatures
        subject.gauge.set_frame(_frame_of_rig(inputs, armatures, subject.rest))
        shape = _in_world([skinned.points for _obj, skinned in pairs], worlds)
        others = [own.under(other) for own in inputs]
        subject.measured = subject.gauge.measure(shape, lambda: _shape_of(others, worlds))
        subject.stamp = stamp
        subject.under_other = None
    return subject


def measure_now(objects: Sequence[bpy.types.Object], other: str, what: str) -> Subject:
    """Measures objects in the scene as it is now. Raises SinewError where there is nothing to measure.

    what  is to be done, in words
    """
    depsgraph = bpy.context.evaluated_depsgraph_get()
    subject = measure(session.deformed_now(objects, depsgraph), other, depsgraph)
    if subject is None:
        raise SinewError(f"Nothing to {what}: Sinew deforms none of the chosen meshes")
    return subject


@dataclass(frozen=True)
class Moment:
    """All that the shapes of one frame depend on but method and stages; or the same in a pose that no frame
    has. Measuring it changes nothing, and does not depend on the scene's frame.

    inputs     of each part
    armatures  world matrices of the first armature of each part
    """

    subject: Subject
    inputs: list[_Inputs]
    worlds: list[np.ndarray]
    armatures: list[np.ndarray]

    @classmethod
    def of(cls, subject: Subject) -> Self:
        """That of the last call of measure(), with the scene as it is evaluated now."""
        inputs, depsgraph = [], bpy.context.evaluated_depsgraph_get()
        for shown in subject.inputs:
            twists = _twists(shown.part, depsgraph)
            frames = [frame and replace(frame, twists=twists) for frame in shown.frames]
            inputs.append(replace(shown, frames=frames))
        return cls(subject, inputs, subject.worlds, subject.armatures)

    def posed(self, poses: Callable[[Bones], np.ndarray]) -> Self:
        """Returns the same in other poses. Rotations beyond half a turn are unknown there.

        poses  returns float32 [bones + joints, 4, 4], armature space
        """
        inputs = []
        for own in self.inputs:
            frames = [
                frame
                and replace(
                    frame,
                    pose=poses(skin.deformer.bones),
                    twists=tuple((*of_bone[:2], *NOT_TOLD) for of_bone in frame.twists),
                    turns=None,
                )
                for skin, frame in zip(own.part.skin_stack.skins, own.frames, strict=False)
            ]
            inputs.append(replace(own, frames=frames))
        return replace(self, inputs=inputs)

    @cached_property
    def pose(self) -> Pose:
        rest = _in_world([own.rest_points for own in self.inputs], self.worlds)
        return self.subject.gauge.pose_of(_frame_of_rig(self.inputs, self.armatures, rest))

    def points(self, methods: Sequence[str | None]) -> np.ndarray:
        """float64 [vertices, 3], world space.

        methods  of each part: one with the stages that are shown, None for the method that is shown, too, or
                 properties.BLENDER for the Armature modifiers
        """
        pairs = zip(self.inputs, methods, strict=True)
        return _shape_of([own.under(method) for own, method in pairs], self.worlds)

    def measured(self, method: str, stages: StageValues | None = None) -> Measured:
        """Measures the shape under a method and stages; without a mix.

        stages  None: those that are shown
        """
        inputs = self.inputs if stages is None else [replace(own, stages=stages) for own in self.inputs]
        points = replace(self, inputs=inputs).points([method] * len(inputs))
        return Measured(self.pose, Shape(self.subject.gauge.surface, points), None)

    def measured_under(self, variants: Sequence[Variant]) -> Measured:
        """Measures the shape under a variant of each part."""
        points = self.points_under(variants)
        return Measured(self.pose, Shape(self.subject.gauge.surface, points), None)

    def points_under(self, variants: Sequence[Variant]) -> np.ndarray:
        """As points(), under a variant of each part."""
        pairs = zip(self.inputs, variants, strict=True)
        return _shape_of([own.under_variant(variant) for own, variant in pairs], self.worlds)


def _twists(part: Part, depsgraph: bpy.types.Depsgraph) -> TwistInputs:
    armature = properties.of(part.obj).armature
    if armature is None:
        return ()
    return armature_io.read_twists(armature.evaluated_get(depsgraph), part.bound.first_deformer.bones)


def measured_of_mix(
    subject: Subject, second_of: Callable[[bpy.types.Object], str]
) -> tuple[Measured, Measured]:
    """Measures the frame of the last call of measure() under each of the two methods of a mix alone.

    second_of  of an object: its second method
    """
    first = [own.of_mix("") for own in subject.inputs]
    second = [own.of_mix(second_of(own.part.obj)) for own in subject.inputs]
    measure = subject.gauge.measure
    return measure(_shape_of(first, subject.worlds)), measure(_shape_of(second, subject.worlds))


def measured_under_other(subject: Subject, other: str) -> Measured | None:
    """Measures the frame of the last call of measure() under the method given there, once per frame;
    distances are to the current shape. None where everything is shown under this method."""
    shown = [frame for own in subject.inputs for frame in own.frames if frame is not None]
    if all(frame.method == other and not frame.mix for frame in shown):
        return None
    if subject.under_other is None:
        shape = _shape_of([own.under(other) for own in subject.inputs], subject.worlds)
        subject.under_other = subject.gauge.measure(shape, subject.measured.shape.points.T)
    return subject.under_other


def _is_current(part: Part, pair: tuple[bpy.types.Object, SkinnedObject]) -> bool:
    return part.skinned is pair[1] and part.bound is pair[1].bound


def _read(pairs: SkinnedObjects, depsgraph: bpy.types.Depsgraph, old: Subject | None) -> Subject | None:
    """Reads topology and weights; keeps the old gauge where they are unchanged."""
    parts = []
    for obj, skinned in pairs:
        mesh = (
            obj.data
            if properties.of(obj).storage.upstream_proxy is None
            else upstream_proxy.evaluated_mesh(obj, depsgraph)
        )
        shown = skinned.shown
        if mesh is None or shown.frames is None or len(mesh.vertices) != len(shown.rest_points):
            return None
        skin_stack = skinned.bound.skin_stack
        surface = mesh_io.read_surface(mesh)
        for skin in skin_stack.skins:
            if skin.deformer.vertex_data is not None:
                # Distances may be measured to a method that needs them.
                skin.deformer.vertex_data.add_triangles(surface.triangles)
        parts.append(Part(obj, skinned, skinned.bound, surface, skin_stack.another()))
    if not parts:
        return None
    if old is not None and all(map(_is_alike, parts, old.parts)):
        for part, known in zip(parts, old.parts, strict=True):
            known.skinned, known.bound = part.skinned, part.bound
        return old
    entries, bone_counts = [], []
    for part in parts:
        weighting, shown = part.bound.first_deformer.weighting, part.skinned.shown
        space = _space(part, depsgraph)
        entries.append(weighting.influences_over_joints(transformed(shown.rest_points, space)))
        bone_counts.append(len(weighting.bones.rest))
    surface = joined([part.surface for part in parts])
    return Subject(parts, Gauge(surface, influences.joined(entries, bone_counts)))


def _is_alike(part: Part, known: Part) -> bool:
    return (
        part.bound.skin_stack is known.bound.skin_stack
        and np.array_equal(part.surface.triangles, known.surface.triangles)
        and np.array_equal(part.surface.edges, known.surface.edges)
    )


def _space(part: Part, depsgraph: bpy.types.Depsgraph) -> np.ndarray:
    """From the object's space to armature space."""
    frame = part.skinned.shown.frames[0]
    if frame is not None:
        return frame.bones_from_model
    armature = properties.of(part.obj).armature
    if armature is None:
        # It was deleted, and other armatures deform the mesh.
        return np.identity(4)
    space = spaces.bones_from_model_in(depsgraph, part.obj, armature)
    return np.identity(4) if space is None else space


def _modifiers_methods(obj: bpy.types.Object, other: str) -> tuple[str, ...]:
    """Returns the methods of the Armature modifiers themselves, if `other` is Blender."""
    if other != properties.BLENDER:
        return ()
    return tuple(method_of(modifier) for modifier in stack.armature_modifiers(obj))


def _shape_of(inputs: Sequence[_Inputs], worlds: Sequence[np.ndarray]) -> np.ndarray:
    return _in_world([own.points() for own in inputs], worlds)


def _is_same_rest(subject: Subject, inputs: list[_Inputs], worlds: list[np.ndarray]) -> bool:
    """Whether nothing has moved the points at rest since the last frame."""
    if subject.rest is None:
        return False
    pairs = zip(inputs, subject.inputs, strict=True)
    same_shapes = all(own.rest_points is known.rest_points for own, known in pairs)
    return same_shapes and all(map(np.array_equal, worlds, subject.worlds))


def _frame_of_rig(inputs: Sequence[_Inputs], armatures: list[np.ndarray], rest: np.ndarray) -> FrameOfRig:
    rigs = []
    for own, armature in zip(inputs, armatures, strict=True):
        bones, frame = own.part.bound.first_deformer.bones, own.frames[0]
        at_rest = armature @ bones.rest
        rigs.append((bones, at_rest, at_rest if frame is None else armature @ frame.pose))
    return FrameOfRig.of(rest, rigs)


def _world(obj: bpy.types.Object | None, depsgraph: bpy.types.Depsgraph) -> np.ndarray:
    """Returns the world matrix; the identity for a deleted armature, which has no bones."""
    if obj is None:
        return np.identity(4)
    return np.array(obj.evaluated_get(depsgraph).matrix_world, dtype=np.float64)


def _in_world(shapes: Sequence[np.ndarray], worlds: Sequence[np.ndarray]) -> np.ndarray:
    """float64 [vertices of all, 3], stored axis by axis, as measuring needs them."""
    return np.concatenate(
        [
            np.ascontiguousarray(shape.T, dtype=np.float64)
            if is_same_space(world)
            else transformed_axes(shape, world)
            for shape, world in zip(shapes, worlds, strict=True)
        ],
        axis=1,
    ).T
