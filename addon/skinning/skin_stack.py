# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh's Armature modifiers and stages, one after the other: what they computed last, and from what."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np
import sinew

from .arrays import are_equal
from .engines import ENGINES, METHODS, imported, influences_kept
from .parameters import Value
from .rig import Weighting
from .scale_rule import BLENDER_4, IGNORED
from .stage_mesh import StageMesh
from .stages import StagesAfter, StageValues
from .twist_spread import TwistInputs
from .vectors import is_same_space, transformed
from .vertex_data import PROVIDERS, VertexData

LINEAR = "lbs"
# The purpose of the deformer that gives a mesh its shape, where there is only one.
MOTION = "motion"
NO_STAGES: StageValues = MappingProxyType({})


@dataclass
class ModifierFrame:
    """Everything that the deformation by an Armature modifier depends on in one frame, but its input.

    method            name of a method
    pose              float32 [bones + joints, 4, 4], armature space, as Blender gives it
    bones_from_model  float64 [4, 4], from the mesh's object space to armature space
    scale_rule        name of a scale rule
    mix               name of the second method, mixed in by the mix weights; empty for none
    parameters        values of parameters of both methods, by their full names
    model_from_bones  given where a scale is 0: as in Blender, all vertices are then at the origin of armature
                      space before the bones move them
    twists            inputs of the stage twist_spread, of the first that takes part; empty where it is off
    turns             float32 [bones, 4], as sinew.Deformer.deform takes them; None: unknown, or not asked for
    """

    method: str
    pose: np.ndarray
    bones_from_model: np.ndarray
    scale_rule: str = BLENDER_4.name
    mix: str = ""
    parameters: dict[str, Value] = field(default_factory=dict)
    model_from_bones: np.ndarray | None = None
    twists: TwistInputs = ()
    turns: np.ndarray | None = None


@dataclass(slots=True)
class _MethodDeformer:
    """A deformer, what it was made for, and its rest points.

    method, mix  as in ModifierFrame: reading the deformer's own takes longer
    kept         from _kept()
    """

    deformer: sinew.Deformer
    method: str
    mix: str
    kept: tuple[str, int]
    rest_points: np.ndarray


class SkinDeformer:
    """A mesh bound to bones. It computes only frames that differ from the last.

    mix_weights  float32 [vertices] from 0 to 1: the share of a frame's second method; None for no share
    vertex_data  the methods' vertex data; None where no method that has any is used
    last_frame   that was computed last
    rest_points  float32 [vertices, 3], object space: its input
    """

    def __init__(
        self,
        weighting: Weighting,
        mix_weights: np.ndarray | None = None,
        vertex_data: VertexData | None = None,
    ) -> None:
        self.weighting = weighting
        self.mix_weights = mix_weights
        self.vertex_data = vertex_data
        self.bones = weighting.bones
        # The packed mesh with its rest points, for each purpose, set of methods with vertex data, and what an
        # engine keeps of the influences; the deformer for each purpose.
        self._packed: dict[tuple[str, frozenset[str], tuple[str, int]], tuple[sinew.Binding, np.ndarray]] = {}
        self._deformers: dict[str, _MethodDeformer] = {}
        # Skinned normals, with the deformer and the rest normals that they were made for.
        self._skinned: tuple[sinew.SkinnedNormals, sinew.Deformer, np.ndarray] | None = None
        self.last_frame: ModifierFrame | None = None
        # The version of the vertex data in the packed meshes.
        self._data_version = 0
        self._points = self.rest_points = np.empty((len(weighting.entries.counts), 3), dtype=np.float32)
        # The last frame was written to another array than _points.
        self._points_outdated = False

    def another(self) -> SkinDeformer:
        """Returns a copy with results of its own."""
        return SkinDeformer(self.weighting, self.mix_weights, self.vertex_data)

    @cached_property
    def _moving(self) -> np.ndarray:
        if self.weighting.use_envelopes:
            return np.flatnonzero(self.bones.deform)
        return np.flatnonzero(np.bincount(self.weighting.entries.bones))

    @cached_property
    def moving_bones(self) -> list[str]:
        """Names of the bones that can move a vertex."""
        return [self.bones.names[bone] for bone in self._moving]

    @property
    def bends(self) -> bool:
        """Whether one of these bends in segments."""
        return bool((self.bones.segments[self._moving] > 1).any())

    @property
    def points(self) -> np.ndarray:
        """The shape of the last frame, float32 [vertices, 3], object space."""
        if self._points_outdated and self.last_frame is not None:
            self._shape(self.last_frame, self._points)
        self._points_outdated = False
        return self._points

    def deform(self, rest_points: np.ndarray, frame: ModifierFrame, out: np.ndarray | None = None) -> bool:
        """Computes `points`. Returns False where the frame equals the last one.

        rest_points  float32 [vertices, 3], object space, shape keys applied
        out          float32 [vertices, 3], C-contiguous: always written, instead of `points`, which are then
                     computed when they are read

        Raises ValueError where `out` has another shape.
        """
        last, known = self.last_frame, self.rest_points
        is_packed_anew = self._take_new_data(frame)
        is_written = out is not None or is_packed_anew
        if not is_written and last is not None and are_equal(rest_points, known) and _same(last, frame):
            return False
        if self.weighting.depends_on_points and (
            last is None
            or rest_points is not known
            or not np.array_equal(frame.bones_from_model, last.bones_from_model)
        ):
            # The influences differ from the last frame's.
            self._deformers.clear()
            self._packed.clear()
        self.last_frame, self.rest_points = None, rest_points
        self._shape(frame, self._points if out is None else out)
        self.last_frame, self._points_outdated = frame, out is not None
        return True

    def write_skinned_normals(
        self, points: np.ndarray, rest_normals: np.ndarray, vertices: np.ndarray | None, out: np.ndarray
    ) -> bool:
        """Writes normals moved by the blends of their vertices in the last frame. Returns False where the
        shape is not made by a single blend.

        points        float32 [vertices, 3], object space, of that frame
        rest_normals  float32 [n, 3], object space
        vertices      int32 [n], the vertex of each; None: one normal per vertex
        out           float32 [n, 3], C-contiguous
        """
        frame = self.last_frame
        if frame is None or frame.scale_rule != BLENDER_4.name:
            return False
        deformer = self._deformers[MOTION].deformer
        if self._skinned is None or not (self._skinned[1] is deformer and self._skinned[2] is rest_normals):
            packed, _points = self._packed[MOTION, frozenset(self._vertex_data_of(frame)), _kept(frame)]
            mixed = deformer.mixed_method
            mix = (mixed, self.mix_weights) if mixed and self.mix_weights is not None else None
            made = sinew.SkinnedNormals(
                packed, rest_normals, vertices=vertices, method=deformer.method, mix=mix
            )
            self._skinned = (made, deformer, rest_normals)
        self._skinned[0].deform_normals(
            frame.pose,
            points,
            out=out,
            rest_inverses=self.bones.rest_from_armature,
            **self._arguments_of(frame),
        )
        return True

    def _shape(self, frame: ModifierFrame, out: np.ndarray) -> None:
        weights = self.mix_weights
        if frame.mix and (weights is None or frame.mix == frame.method):
            frame = replace(frame, mix="")
        are_of_two_kinds = frame.scale_rule != BLENDER_4.name and LINEAR in (frame.method, frame.mix)
        if weights is None or not (frame.mix and are_of_two_kinds):
            self._shape_with_one_kind(frame, out, MOTION)
            return
        # With these rules linear blending takes other bone matrices than the other methods.
        self._shape_with_one_kind(replace(frame, mix=""), out, MOTION)
        second = np.empty_like(out)
        self._shape_with_one_kind(replace(frame, method=frame.mix, mix=""), second, "second motion")
        out += weights[:, None] * (second - out)

    def _shape_with_one_kind(self, frame: ModifierFrame, out: np.ndarray, purpose: str) -> None:
        """Writes the shape for methods that take the same kind of bone matrices."""
        rest_points, bones = self.rest_points, frame.pose
        rest_inverses: np.ndarray | None = self.bones.rest_from_armature
        if frame.scale_rule != BLENDER_4.name:
            motions = frame.pose.astype(np.float64) @ self.bones.rest_from_armature
            split = sinew.affine.split_scale(motions, self.bones.rest_axes.astype(np.float64))
            if frame.scale_rule == IGNORED.name:
                bones, rest_inverses = split.rigid.astype(np.float32), None
            elif frame.method != LINEAR and split.has_scale.any():
                rest_points = np.empty_like(self._points)
                scale = split.scale.astype(np.float32)
                linear = replace(frame, method=LINEAR, mix="")
                self._deform("scale", linear, self.rest_points, scale, None, rest_points)
                bones, rest_inverses = split.rigid.astype(np.float32), None
        self._deform(purpose, frame, rest_points, bones, rest_inverses, out)

    def _deform(
        self,
        purpose: str,
        frame: ModifierFrame,
        rest_points: np.ndarray,
        bones: np.ndarray,
        rest_inverses: np.ndarray | None,
        out: np.ndarray,
    ) -> None:
        """Deforms `rest_points` with the deformer of `purpose`, which is made again where it does not fit."""
        bound = self._deformers.get(purpose)
        if bound is None or (bound.method, bound.mix, bound.kept) != (frame.method, frame.mix, _kept(frame)):
            data = self._vertex_data_of(frame)
            key = (purpose, frozenset(data), _kept(frame))
            if key not in self._packed:
                self._packed[key] = (self._pack(frame, rest_points, data), rest_points)
            packed, points = self._packed[key]
            mix = (frame.mix, self.mix_weights) if frame.mix and self.mix_weights is not None else None
            deformer = sinew.Deformer(packed, _native(frame.method), mix=mix)
            bound = self._deformers[purpose] = _MethodDeformer(
                deformer, frame.method, frame.mix, _kept(frame), points
            )
        if bound.rest_points is not rest_points:
            bound.deformer.set_rest_points(rest_points)
            bound.rest_points = rest_points
        bound.deformer.deform(bones, out=out, rest_inverses=rest_inverses, **self._arguments_of(frame))

    def _arguments_of(self, frame: ModifierFrame) -> dict[str, Any]:
        """Returns those that the library takes for points and for normals alike."""
        same_space = is_same_space(frame.bones_from_model)
        along = follows_hierarchy(frame.method, frame.mix, frame.parameters)
        return {
            "bones_from_model": None if same_space else frame.bones_from_model.astype(np.float32),
            "parameters": None if frame.method in ENGINES else frame.parameters or None,
            "parents": self.bones.twists.parents if along else None,
            "turns": frame.turns,
        }

    def _take_new_data(self, frame: ModifierFrame) -> bool:
        """Whether the methods' vertex data has changed; meshes are then packed again."""
        if self.vertex_data is None:
            return False
        if frame.method in PROVIDERS or frame.mix in PROVIDERS:
            self._vertex_data_of(frame)
        version, known = self.vertex_data.version, self._data_version
        if version == known:
            return False
        self._data_version = version
        self._packed.clear()
        self._deformers.clear()
        return True

    def _vertex_data_of(self, frame: ModifierFrame) -> dict[str, np.ndarray | None]:
        """Returns the data by the name of the method. None for a mesh without data of MikuMikuDance: it is
        blended linearly."""
        names = [name for name in (frame.method, frame.mix) if name and METHODS[name].vertex_floats]
        if self.vertex_data is None:
            return {name: None for name in names if name not in PROVIDERS}
        for name in names:
            self.vertex_data.take_parameters(name, frame.parameters)
        return {name: self.vertex_data.of(name, frame.bones_from_model) for name in names}

    def _pack(
        self, frame: ModifierFrame, rest_points: np.ndarray, vertex_data: dict[str, np.ndarray | None]
    ) -> sinew.Binding:
        points = self.rest_points
        if self.weighting.depends_on_points:
            points = transformed(points, frame.bones_from_model)
        engine = ENGINES.get(frame.method)
        if engine is None:
            influences = self.weighting.influences_over_joints(points)
        else:
            influences = imported(self.weighting.influences(points), engine, _kept(frame)[1])
        return sinew.Binding(
            rest_points,
            influences.offsets,
            influences.bones,
            influences.weights,
            rest_bones=self.bones.rest_axes,
            vertex_data=vertex_data,
        )


def _native(method: str) -> str:
    """Returns the library's method that computes it."""
    return LINEAR if method in ENGINES else method


def _kept(frame: ModifierFrame) -> tuple[str, int]:
    """Returns the engine, and how many influences of a vertex it keeps; of nothing where it is none."""
    if frame.method not in ENGINES:
        return "", 0
    return frame.method, influences_kept(frame.method, frame.parameters)


def follows_hierarchy(method: str, mix: str, parameters: Mapping[str, Value]) -> bool:
    """Whether signs of rotations come from the hierarchy."""
    return any(parameters.get(f"{name}.signs") == "hierarchy" for name in (method, mix))


def _same(a: ModifierFrame, b: ModifierFrame) -> bool:
    return (
        (a.method, a.mix, a.parameters) == (b.method, b.mix, b.parameters)
        and a.scale_rule == b.scale_rule
        and np.array_equal(a.pose, b.pose)
        and are_equal(a.bones_from_model, b.bones_from_model)
        and are_equal(a.turns, b.turns)
    )


@dataclass
class ModifierSkin:
    """One of the Armature modifiers that deform a mesh one after the other.

    mask   float32 [vertices], the share of the deformation that each vertex gets; None for all of it
    multi  a Multi Modifier: it has the same input as the modifier before it
    """

    deformer: SkinDeformer
    mask: np.ndarray | None = None
    multi: bool = False


def _twists(frames: Sequence[ModifierFrame | None]) -> list[TwistInputs]:
    return [() if frame is None else frame.twists for frame in frames]


class SkinStack:
    """The Armature modifiers of one mesh, in their order, and the stages that follow the last.

    stages_after  None for none
    """

    def __init__(self, skins: Sequence[ModifierSkin], stages_after: StagesAfter | None = None) -> None:
        self.skins = skins
        self.stages_after = stages_after
        # The last active modifier, if it has no mask: its points are the result.
        self._end: SkinDeformer | None = None
        self._points: np.ndarray | None = None
        self._rest_points: np.ndarray | None = None
        self._active: list[int] = []
        self._frames: Sequence[ModifierFrame | None] = ()
        self._values = NO_STAGES
        # The shape of the last frame after the stages; None where they are off, or it was not needed yet.
        self._staged: np.ndarray | None = None
        # The stages' mesh has changed since the last frame.
        self._has_other_mesh = False

    @property
    def points(self) -> np.ndarray | None:
        """The shape of the last frame, float32 [vertices, 3], object space; None before the first."""
        if not self._values:
            return self._skin_points
        if self._staged is None:
            self._staged = np.array(self._skin_points, dtype=np.float32, order="C")
            self._apply_stages(self._staged)
        return self._staged

    @property
    def _skin_points(self) -> np.ndarray | None:
        """The points before the stages."""
        return self._points if self._end is None else self._end.points

    def another(self) -> SkinStack:
        """Returns a copy with results of its own."""
        skins = [ModifierSkin(one.deformer.another(), one.mask, one.multi) for one in self.skins]
        return SkinStack(skins, None if self.stages_after is None else self.stages_after.another())

    def set_stage_mesh(self, mesh: StageMesh) -> None:
        """Sets a mesh with other points or faces."""
        if self.stages_after is not None and self.stages_after.set_mesh(mesh) and self._values:
            self._has_other_mesh = True

    def deform(
        self,
        rest_points: np.ndarray,
        frames: Sequence[ModifierFrame | None],
        out: np.ndarray | None = None,
        values: StageValues = NO_STAGES,
    ) -> bool:
        """Computes `points`. Returns False where nothing differs from the last call.

        rest_points  float32 [vertices, 3], object space
        frames       one for each modifier, None for one that is switched off or has no pose
        out          see SkinDeformer.deform
        values       the parameters of the stages that follow
        """
        if self.stages_after is None:
            values = NO_STAGES
        changed = self._deform_skin(rest_points, frames, out)
        changed |= values != self._values or self._has_other_mesh or _twists(frames) != _twists(self._frames)
        self._frames, self._values, self._has_other_mesh = frames, values, False
        if changed or out is not None:
            self._staged = None
        if values and out is not None:
            self._apply_stages(out)
        return changed

    def write_skinned_normals(
        self, points: np.ndarray, rest_normals: np.ndarray, vertices: np.ndarray | None, out: np.ndarray
    ) -> bool:
        """As SkinDeformer's; also returns False for several modifiers, a mask or stages after them."""
        is_one = self._end is not None and sum(frame is not None for frame in self._frames) == 1
        if self._values or self._end is None or not is_one:
            return False
        return self._end.write_skinned_normals(points, rest_normals, vertices, out)

    def _apply_stages(self, points: np.ndarray) -> None:
        assert self.stages_after is not None
        assert self._rest_points is not None
        self.stages_after.apply(points, self._values, self._rest_points, self._frames)

    def _deform_skin(
        self, rest_points: np.ndarray, frames: Sequence[ModifierFrame | None], out: np.ndarray | None
    ) -> bool:
        """Deforms by the Armature modifiers alone."""
        active = [number for number, frame in enumerate(frames) if frame is not None]
        changed = self._rest_points is None or active != self._active
        if active:
            changed |= self._run(rest_points, frames, active, out)
        else:
            changed = changed or not are_equal(rest_points, self._rest_points)
            self._end, self._points = None, rest_points
        if self._end is None and out is not None:
            out[:] = self._points
        self._active, self._rest_points = active, rest_points
        return changed

    def _run(
        self,
        rest_points: np.ndarray,
        frames: Sequence[ModifierFrame | None],
        active: list[int],
        out: np.ndarray | None,
    ) -> bool:
        """active: the numbers of the modifiers that have a frame, at least one."""
        changed, result = False, rest_points
        starts: dict[int, np.ndarray] = {}
        last, last_frame = self.skins[active[-1]], frames[active[-1]]
        assert last_frame is not None
        is_whole = last.mask is None and last_frame.model_from_bones is None
        self._end = last.deformer if is_whole else None
        for number in active:
            skin, frame = self.skins[number], frames[number]
            assert frame is not None
            # The Multi Modifiers directly behind this modifier have the same input.
            for behind in range(number + 1, len(self.skins)):
                if not self.skins[behind].multi or behind in starts:
                    break
                starts[behind] = result
            start, back, mask = starts.get(number, result), frame.model_from_bones, skin.mask
            if back is not None:
                start = np.zeros_like(result)
                before = self._frames[number] if number < len(self._frames) else None
                changed |= before is None or not are_equal(back, before.model_from_bones)
            if skin.deformer is self._end:
                # Its points may be in `out` alone: reading them would compute them a second time.
                changed |= skin.deformer.deform(start, frame, out)
                break
            changed |= skin.deformer.deform(start, frame)
            moved = skin.deformer.points
            if back is not None:
                if mask is not None and number not in starts:
                    # As in Blender, only a vertex without any share is not brought to the origin.
                    moved, mask = mask[:, None] * moved, mask > 0.0
                moved = transformed(moved, back).astype(np.float32)
            # A copy, as the next modifier compares its input with the last one: the array must not be
            # overwritten.
            result = moved.copy() if mask is None else result + mask[:, None] * (moved - result)
        self._points = result
        return changed
