# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads what a page that turns needs from the open file: meshes, influences, centres, poses.

Meshes are those of Sinew's objects: of the mesh itself or, where Sinew is off there, of a copy of it.
"""

from collections.abc import Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import bpy
import numpy as np

from ...attach import (
    attach,
    corrective_smooth,
    properties,
    stage_settings,
    upstream_proxy,
    variant_settings,
)
from ...attach.layout import method_of
from ...base.errors import SinewError
from ...deform import characters, session, source
from ...deform.bound import Bound
from ...deform.pose import stage_values
from ...deform.skinned_object import SkinnedObject
from ...io import armature_io, mesh_io, spaces
from ...skinning.bulge_limit import segments
from ...skinning.influences import Influences
from ...skinning.rig import Bones
from ...skinning.scale_rule import BLENDER_4
from ...skinning.twist_spread import NOT_TOLD, TwistInputs
from ...skinning.variants import Variant, is_key, parse, title_of
from ...skinning.vectors import transformed
from ...skinning.vertex_data import VertexData
from ..measure import battery, live
from .viewer_page import BLENDER, METHODS, MIX, Form, Found, Look, PageSheet, Part, Stages, Viewer

# The method of meshes that have none of their own; any of Sinew's would do.
PLAYED = "dq"
POSES_A_SECOND = 1.0
# A pose's name.
AT_REST = "At rest"
# The stages that the shaders have, each with the parameter of its strength.
STRENGTHS = {"twist_spread": "amount", "bulge_limit": "strength"}
SMOOTHING = "delta_mush"

Variants = Mapping[str, Mapping[bpy.types.Object, Variant]]
"""By keys of variants, what each is for objects for which it is not what the key says."""
NOTES = (
    "The browser skins the meshes by the shaders that Sinew has for engines: Linear Blend, Dual Quaternion, "
    "Centres of Rotation and the painted mix of two, Twist Spread and Limit Bulge. Shapes of other methods "
    "and of Delta Mush are recorded in each frame.",
    "Shapes are those right after the skinning, without the modifiers behind it.",
)


@dataclass(frozen=True)
class Pose:
    """A frame of the page that no frame of the scene has: bones of an armature are rotated, others at rest.

    armature   its name
    rotations  as of battery.Pose, by the bones' names
    """

    name: str
    armature: str = ""
    rotations: Mapping[str, np.ndarray] = field(default_factory=dict)

    def of(self, armature: bpy.types.Object, bones: Bones) -> np.ndarray:
        """float32 [bones + joints, 4, 4], armature space"""
        own = self.rotations if armature.name == self.armature else {}
        by_bone = {bones.names.index(name): rotation for name, rotation in own.items()}
        return battery.posed(bones, battery.Pose(self.name, by_bone))


@dataclass
class _Skinned:
    """A mesh that an armature deforms.

    obj       the object that Sinew deforms, the mesh itself or a copy
    armature  of its Armature modifier
    rest      float32 [vertices, 3], object space, of the first frame
    space     from its object space to that of the armature, of the first frame

    follows_turns  Twist Spread's setting
    variants       by their keys, and that of its own mix by MIX
    recorded       the names whose shapes the shaders lack
    """

    obj: bpy.types.Object
    armature: bpy.types.Object
    skinned: SkinnedObject
    rest: np.ndarray
    space: np.ndarray
    part: Part
    follows_turns: bool
    variants: Mapping[str, Variant]
    recorded: Sequence[str]
    has_moved: bool = False
    has_shifted: bool = False

    def add_frame(self, depsgraph: bpy.types.Depsgraph, chosen: Pose | None) -> None:
        armature, bones = self.armature.evaluated_get(depsgraph), self.skinned.bound.first_deformer.bones
        posed = chosen.of(self.armature, bones) if chosen else armature_io.read_pose(armature, bones)
        if not np.isfinite(posed).all():
            raise SinewError(f"{self.part.name}: the pose of a bone is not finite")
        points = source.rest_points(self.obj, self.skinned.bound.source, depsgraph)
        rest = None
        if not np.array_equal(points, self.rest):
            self.has_moved, rest = True, transformed(points, self.space).astype(np.float32)
        space = spaces.bones_from_model_in(depsgraph, self.obj, self.armature)
        self.has_shifted |= space is None or not np.allclose(space, self.space, atol=1e-5)
        twists: TwistInputs = ()
        if self.part.stages is not None:
            twists = armature_io.read_twists(armature, bones)
            if chosen or not self.follows_turns:
                twists = tuple((*own[:2], *NOT_TOLD) for own in twists)
        turns = None if chosen or self.part.parents is None else armature_io.read_turns(armature, bones)
        self.part.add_frame(posed, np.array(armature.matrix_world), rest, twists, turns)

    @property
    def rigs(self) -> list[tuple[Bones, bpy.types.Object]]:
        """The bones of each Armature modifier, with its armature."""
        pairs = attach.replaced_modifiers(self.obj)
        skins = self.skinned.bound.skin_stack.skins
        return [
            (skin.deformer.bones, replaced.armature)
            for skin, (_modifier, replaced) in zip(skins, pairs, strict=False)
        ]

    @property
    def notes(self) -> list[str]:
        """What the page has of it otherwise than Blender."""
        name, found = self.part.name, []
        if self.has_moved and self.skinned.bound.first_deformer.weighting.depends_on_points:
            found.append(f"{name}: weights of envelopes and bendy bones stay as in the first frame.")
        if self.has_shifted:
            found.append(f"{name}: it moves against its armature, and stays as in the first frame here.")
        return found


@dataclass
class _Attached:
    """A mesh that is parented to bones: it moves as a whole, with a single bone that stays at rest."""

    obj: bpy.types.Object
    part: Part

    def add_frame(self, depsgraph: bpy.types.Depsgraph, chosen: Pose | None) -> None:
        world = np.array(self.obj.evaluated_get(depsgraph).matrix_world)
        on_bone = self.obj
        while on_bone is not None and on_bone.parent_type != "BONE":
            on_bone = on_bone.parent
        if chosen is not None and on_bone is not None:
            armature = on_bone.parent.evaluated_get(depsgraph)
            bones, place = armature_io.read_bones(armature), np.array(armature.matrix_world)
            bone = bones.names.index(on_bone.parent_bone)
            posed, now = chosen.of(armature, bones)[bone], armature_io.read_pose(armature, bones)[bone]
            world = place @ posed @ np.linalg.pinv(place @ now) @ world
        self.part.add_frame(_STILL, world)


_STILL = np.identity(4, dtype=np.float32)[None]


def attached_to(scene: bpy.types.Scene, meshes: Sequence[bpy.types.Object]) -> list[bpy.types.Object]:
    """Returns the visible meshes that are parented to the armatures of `meshes`, such as eyes."""
    armatures = {attach.armature_of(obj) for obj in meshes}
    return [
        obj
        for obj in scene.objects
        if obj.type == "MESH"
        and not properties.is_copy(obj)
        and obj.visible_get()
        and attach.armature_of(obj) is None
        and attach.hangs_on(obj, armatures)
    ]


def page(
    scene: bpy.types.Scene,
    title: str,
    meshes: Mapping[bpy.types.Object, Sequence[bpy.types.Object]],
    attached: Sequence[bpy.types.Object],
    methods: Sequence[str],
    frames: Sequence[float] | Sequence[Pose],
    left_out: Sequence[str] = (),
    beside: Found | PageSheet | None = None,
    variants: Variants = MappingProxyType({}),
) -> Generator[float, None, str]:
    """Yields the progress, returns the text of the page. Sets frames; restoring is the caller's.

    meshes    each with the objects that Sinew may deform in its place
    attached  meshes that bones move as they are
    methods   those to choose from, or keys of variants; shapes that the shaders lack are recorded
    frames    of the scene, or poses beside the one that it has
    left_out  sentences on other meshes
    beside    what Flex found in these poses, or a contact sheet of them

    Raises SinewError where no mesh can be shown.
    """
    own: dict[bpy.types.Object, dict[str, Variant]] = {
        obj: {name: variants.get(name, {}).get(obj) or parse(name) for name in filter(is_key, methods)}
        for obj in meshes
    }
    if not isinstance(frames[0], Pose):
        characters.set_frame(scene, frames[0])
    skinned: list[_Skinned] = []
    notes = [*NOTES, *left_out]
    for obj, others in meshes.items():
        try:
            skinned.append(_read(obj, [obj, *others], methods, own[obj]))
        except SinewError as error:
            notes.append(f"{obj.name}: left out: {error}")
    if not skinned:
        raise SinewError("; ".join(notes[len(NOTES) :]))
    labels = {name: _label(name, [of[name] for of in own.values() if name in of]) for name in methods}
    # A variant says itself whether it is mixed.
    if any(each.part.mix is not None for each in skinned) and not all(map(is_key, methods)):
        labels = (
            {MIX: "Painted Mix", **labels} if isinstance(beside, Found) else {**labels, MIX: "Painted Mix"}
        )
    shown_meshes = [*skinned, *(_read_attached(obj) for obj in attached)]
    is_of_poses = isinstance(frames[0], Pose)
    rate = POSES_A_SECOND if is_of_poses else scene.render.fps / scene.render.fps_base
    parts = [each.part for each in shown_meshes]
    viewer = Viewer(title, parts, labels, rate, characters.length_unit(scene), notes, beside)
    for number, frame in enumerate(frames):
        pose = frame if isinstance(frame, Pose) else None
        if pose is None:
            characters.set_frame(scene, frame)
        depsgraph = bpy.context.evaluated_depsgraph_get()
        for each in shown_meshes:
            each.add_frame(depsgraph, pose)
        _record(skinned, depsgraph, pose)
        viewer.add_frame(frame if pose is None else pose.name)
        yield (number + 1) / len(frames)
    viewer.notes += [note for each in skinned for note in each.notes]
    return viewer.page()


def _label(name: str, chosen: Iterable[Variant]) -> str:
    """chosen: what a key is for each mesh"""
    return title_of(parse(name), chosen) if is_key(name) else properties.method_label(name)


def _has_look(variant: Variant, rule: str) -> bool:
    """Whether the shaders have it, but for Delta Mush. rule: for scale, of the mesh"""
    has_rule = variant.settings.get("scale_rule", rule) == BLENDER_4.name
    is_mixed = "mix" in variant.stages
    if variant.method == BLENDER:
        return True
    return has_rule and variant.method in METHODS and (not is_mixed or variant.mix in METHODS)


def _look(variant: Variant) -> Look:
    values, stages = variant.all_values, variant.stage_values
    twist, bulge = (float(stages.get(name, {}).get(of, 0.0)) for name, of in STRENGTHS.items())
    form: Form = "kim_han" if stages.get("bulge_limit", {}).get("form") == "kim_han" else "continuous"
    mix = variant.mix if "mix" in variant.stages and variant.mix != variant.method else ""
    own = (variant.method, mix)
    by_hierarchy = [name for name in own if values.get(f"{name}.signs") == "hierarchy"]
    return Look(variant.method, mix, by_hierarchy, (twist, bulge), form)


def _read(
    obj: bpy.types.Object,
    objects: Sequence[bpy.types.Object],
    methods: Sequence[str],
    variants: Mapping[str, Variant],
) -> _Skinned:
    """
    objects   those that Sinew may deform in the place of `obj`, and itself
    variants  those among the methods, by their keys
    """
    depsgraph = bpy.context.evaluated_depsgraph_get()
    found = session.deformed_now([each for each in objects if properties.has_sinew(each)], depsgraph)
    if not found:
        raise SinewError("Sinew deforms neither it nor a copy of it")
    obj_of_state, state = found[0]
    settings, bound = properties.of(obj_of_state), state.bound
    modifier, replaced = attach.replaced_modifiers(obj_of_state)[0]
    armature = replaced.armature
    space = spaces.bones_from_model_in(depsgraph, obj_of_state, armature)
    if space is None:
        raise SinewError("a scale of it or of its armature is 0")
    weighting, its_source = bound.first_deformer.weighting, bound.source
    rest = source.rest_points(obj_of_state, its_source, depsgraph)
    points = transformed(rest, space).astype(np.float32)
    influences = weighting.influences_over_joints(points)
    mesh = obj_of_state.data
    if its_source.from_upstream:
        mesh = upstream_proxy.evaluated_mesh(obj_of_state, depsgraph)
    triangles = mesh_io.read_triangles(mesh)
    mix = _mix_of(obj, bound)
    rule = settings.scale_rule
    looks = {name: _look(variant) for name, variant in variants.items() if _has_look(variant, rule)}
    needed = {*methods, *(mix or ()), *(name for look in looks.values() for name in (look.method, look.mix))}
    centres = None
    if "cor" in needed:
        data = VertexData(weighting, its_source.surface_points, triangles, its_source.stored)
        found_centres = data.of("cor", space)
        assert found_centres is not None
        centres = transformed(found_centres, space).astype(np.float32)
    signs = stage_settings.method_values(settings, METHODS)
    by_hierarchy = [name for name in METHODS if signs.get(f"{name}.signs") == "hierarchy"]
    has_signs = by_hierarchy or any(look.by_hierarchy for look in looks.values())
    shares = bound.first_deformer.mix_weights
    is_mixed = shares is not None and (mix is not None or any(look.mix for look in looks.values()))
    part = Part(
        obj.name,
        points,
        influences,
        triangles,
        its_source.topology.edges,
        weighting.bones.rest_axes,
        method_of(modifier),
        centres,
        mix,
        by_hierarchy,
        weighting.bones.twists.parents if has_signs else None,
        _stages_of(settings, bound, len(points), looks.values()),
        [stage_settings.STAGES[name].label for name in stage_values(settings)],
        np.clip(shares, 0.0, 1.0) if is_mixed else None,
        looks,
    )
    is_whole = len(bound.skin_stack.skins) == 1 and bound.skin_stack.skins[0].mask is None
    is_shaded = is_whole and rule == BLENDER_4.name and SMOOTHING not in stage_values(settings)
    # Blender's own smoothing behind it is Delta Mush.
    is_plain = is_whole and not corrective_smooth.stage_values(obj_of_state)

    def is_recorded(name: str) -> bool:
        if is_key(name):
            variant = variants[name]
            is_own = name in looks and (is_plain if variant.method == BLENDER else is_whole)
            return not is_own or SMOOTHING in variant.stages
        return not (is_plain if name == BLENDER else is_shaded and name in (*METHODS, MIX))

    return _Skinned(
        obj_of_state,
        armature,
        state,
        rest.copy(),
        space,
        part,
        settings.twist_spread.turns,
        {**variants, MIX: variant_settings.read(obj)} if mix else variants,
        [name for name in (*methods, *((MIX,) if mix else ()), BLENDER) if is_recorded(name)],
    )


def _record(skinned: Sequence[_Skinned], depsgraph: bpy.types.Depsgraph, chosen: Pose | None) -> None:
    """Adds shapes that the shaders lack, of the frame that was added last."""
    names = dict.fromkeys(name for each in skinned for name in each.recorded)
    if not names:
        return
    subject = live.measure([(each.obj, each.skinned) for each in skinned], BLENDER, depsgraph)
    if subject is None:
        raise SinewError("Sinew does not deform all meshes of the page")
    moment = live.Moment.of(subject)
    if chosen is not None:
        armatures = {id(bones): armature for each in skinned for bones, armature in each.rigs}
        moment = moment.posed(lambda bones: chosen.of(armatures[id(bones)], bones))
    for name in names:
        if is_key(name) or name == MIX:
            own = [each.variants.get(name, Variant.of(BLENDER)) for each in skinned]
            points = moment.points_under(own)
        else:
            points = moment.points([name] * len(skinned))
        for each, shape in zip(skinned, subject.split(points), strict=True):
            if name in each.recorded:
                each.part.record(name, shape)


def _stages_of(
    settings: properties.SinewSettings, bound: Bound, vertices: int, looks: Iterable[Look]
) -> Stages | None:
    """Returns the stages that are on or that a look has, of those that the shaders have."""
    after = bound.skin_stack.stages_after
    if after is None:
        return None
    values = stage_values(settings)
    of_file = [float(values[name][of]) if name in values else 0.0 for name, of in STRENGTHS.items()]
    if not any(name in values for name in STRENGTHS) and not any(any(look.strengths) for look in looks):
        return None
    masks = [np.broadcast_to(after.masks.get(name, 1.0), vertices) for name in STRENGTHS]
    form = values["bulge_limit"]["form"] if "bulge_limit" in values else "continuous"
    bones = bound.first_deformer.weighting.bones
    look = Look(settings.method, strengths=(of_file[0], of_file[1]), form=form)
    stacked = np.stack(masks, axis=1).astype(np.float32)
    return Stages(look, stacked, bones.twists, segments(bones))


def _read_attached(obj: bpy.types.Object) -> _Attached:
    mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    points, surface = mesh_io.read_points(mesh), mesh_io.read_surface(mesh)
    count = len(points)
    of_one = Influences(
        np.arange(count + 1, dtype=np.int32),
        np.zeros(count, dtype=np.int32),
        np.ones(count, dtype=np.float32),
    )
    return _Attached(obj, Part(obj.name, points, of_one, surface.triangles, surface.edges, _STILL, "lbs"))


def _mix_of(obj: bpy.types.Object, bound: Bound) -> tuple[str, str] | None:
    """Returns the painted mix that the mesh itself has, where the shaders have both methods."""
    if not properties.has_sinew(obj):
        return None
    settings, shares = properties.of(obj), bound.first_deformer.mix_weights
    first, second = settings.method, settings.mixed_method
    if shares is None or first == second or not {first, second} <= set(METHODS):
        return None
    return first, second
