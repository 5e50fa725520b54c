# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the inputs of each Armature modifier in one evaluation: pose, method, scale rule."""

from dataclasses import replace

import bpy
import numpy as np

from ..attach import attach, properties, stack, stage_settings
from ..attach.icons import ICONS, Deformer, Icons
from ..attach.layout import method_of
from ..base.errors import SinewError
from ..io import armature_io, spaces
from ..skinning import parameters
from ..skinning.engines import ENGINES
from ..skinning.rig import Bones
from ..skinning.scale_rule import BLENDER_4
from ..skinning.skin_stack import NO_STAGES, ModifierFrame, follows_hierarchy
from ..skinning.stages import ORDER, StageValues
from ..skinning.twist_spread import TwistInputs
from ..skinning.vectors import SAME_SPACE
from .bound import Bound
from .skinned_object import SkinnedObject

Modifiers = list[tuple[properties.SinewReplacedModifier, bpy.types.Object | None]]
"""What Sinew stores about each Armature modifier, and its armature."""

Frames = list[ModifierFrame | None]
"""One for each Armature modifier, None for one that takes no part."""


def read(
    evaluated: bpy.types.Object,
    settings: properties.SinewSettings,
    modifiers: Modifiers,
    skinned: SkinnedObject,
    icons: tuple[Icons, Icons],
    mode: str = "",
) -> Frames:
    """What Blender can not compute with, Sinew leaves at rest: bones and transforms that are not finite.

    settings   the object's, evaluated
    modifiers  evaluated
    icons      of the viewport and of renders
    mode       the depsgraph's; empty within an evaluation, which does not know it

    Raises SinewError where a driver sets a method or a scale rule that does not exist.
    """
    method, scale_rule = settings.method, settings.scale_rule
    if not (method and scale_rule):
        raise SinewError(
            f"{evaluated.name}: the driver of its method or scale gives a number that stands for none; "
            f"methods are {', '.join(f'{m.number} {m.label}' for m in properties.METHODS.values())}"
        )
    frames: Frames = []
    parts = modifiers, settings.methods, _taking_part(icons, mode)
    for skin, (replaced, armature), own, takes_part in zip(
        skinned.bound.skin_stack.skins, *parts, strict=False
    ):
        if armature is None or armature.data.is_editmode or not takes_part:
            frames.append(None)
            continue
        space, back = spaces.bones_from_model(evaluated, armature), None
        if space is None:
            space, back = SAME_SPACE, spaces.model_from_bones(evaluated, armature)
            if not spaces.is_usable(back):
                frames.append(None)
                continue
        pose = _finite(armature_io.read_pose(armature, skin.deformer.bones), skin.deformer.bones)
        number = len(frames)
        is_mixed = skin.deformer.mix_weights is not None and own == method
        if skinned.noted.volume_keyed[number] and own in attach.MODIFIERS_OWN:
            own = method_of(evaluated.modifiers[replaced.name])
        mix = settings.mixed_method if is_mixed else ""
        data = skin.deformer.vertex_data
        if data is not None and not data.is_ready(own):
            # The modifier's own method, until what the chosen one needs is computed.
            own, mix = method_of(evaluated.modifiers[replaced.name]), ""
        elif data is not None and mix and not data.is_ready(mix):
            mix = ""
        values = _parameters(evaluated, settings, own, mix)
        own_rule = scale_rule
        if own in ENGINES:
            mix, own_rule = "", BLENDER_4.name
            pose = armature_io.decomposed(pose, skin.deformer.bones.parents)
        twists: TwistInputs = ()
        if settings.twist_spread.enabled and all(frame is None for frame in frames):
            # The stage follows the bones of the first that takes part.
            twists = armature_io.read_twists(armature, skin.deformer.bones)
        turns = None
        if follows_hierarchy(own, mix, values):
            turns = armature_io.read_turns(armature, skin.deformer.bones)
        frames.append(ModifierFrame(own, pose, space, own_rule, mix, values, back, twists, turns))
    return frames


def _finite(pose: np.ndarray, bones: Bones) -> np.ndarray:
    """Returns the pose with bones at rest where theirs is not finite."""
    if np.isfinite(pose).all():
        return pose
    is_finite = np.isfinite(pose).all(axis=(1, 2), keepdims=True)
    return np.where(is_finite, pose, bones.rest)


def of_modifiers(obj: bpy.types.Object, frames: Frames) -> Frames:
    """Returns the same poses with the methods of the Armature modifiers themselves, without stages."""
    methods = [method_of(modifier) for modifier in stack.armature_modifiers(obj)]
    return [
        frame and replace(frame, method=method, mix="", parameters={}, scale_rule=BLENDER_4.name)
        for frame, method in zip(frames, methods, strict=False)
    ]


def _parameters(
    evaluated: bpy.types.Object, settings: properties.SinewSettings, method: str, mix: str
) -> dict[str, parameters.Value]:
    if method not in stage_settings.METHODS and mix not in stage_settings.METHODS:
        return {}
    values = stage_settings.method_values(settings, (method, mix))
    for name, value in values.items():
        if value == "":
            raise SinewError(
                f"{evaluated.name}: the driver of {name} gives a number that stands for no choice"
            )
    return values


def lacks_data(bound: Bound, frames: Frames) -> bool:
    """Whether one of the methods needed vertex data that it does not have."""
    for skin, frame in zip(bound.skin_stack.skins, frames, strict=False):
        data = skin.deformer.vertex_data
        if data is not None and data.missed and frame is not None and not all(map(data.has, data.missed)):
            return True
    return False


def stage_values(settings: properties.SinewSettings) -> StageValues:
    """Returns the parameters of the active stages that follow the blend.

    settings  the object's, evaluated

    Raises SinewError where a driver sets a choice that does not exist.
    """
    names = stage_settings.names_on(settings, among=ORDER)
    if not names or settings.method in ENGINES:
        return NO_STAGES
    values = {name: stage_settings.values_of(settings, name) for name in names}
    for name, of_stage in values.items():
        for parameter, value in of_stage.items():
            if value == "":
                raise SinewError(f"{name}.{parameter}: its driver gives a number that stands for no choice")
    return values


def icons_of(
    evaluated: bpy.types.Object, modifiers: Modifiers, skinned: SkinnedObject
) -> tuple[Icons, Icons]:
    """Returns the icons in the viewport and in renders, as the artist or an animation set them."""
    own = evaluated.modifiers[skinned.noted.layout.sinew]
    if own.show_in_editmode:
        # in_depsgraph.py has switched them since Blender copied them.
        left_out = skinned.left_out.get(evaluated.as_pointer())
        return skinned.noted.layout.icons_in_this_frame if left_out is None else left_out.icons
    replaced = [evaluated.modifiers[each.name] for each, _armature in modifiers]
    viewport, render = (
        Icons(getattr(own, icon), tuple(getattr(modifier, icon) for modifier in replaced)) for icon in ICONS
    )
    return viewport, render


def _taking_part(icons: tuple[Icons, Icons], mode: str) -> tuple[bool, ...]:
    """Returns which of the modifiers Sinew deforms by. Without a mode it may be for both views: where Sinew
    deforms in both, they agree."""
    if mode:
        return icons[mode == "RENDER"].modifiers
    for each in icons:
        if each.deformer is Deformer.SINEW:
            return each.modifiers
    return (False,) * len(icons[0].modifiers)
