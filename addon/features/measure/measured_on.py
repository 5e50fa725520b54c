# SPDX-License-Identifier: GPL-3.0-or-later
"""What a result was measured on, and what of that is different now: a panel says so beside an old result."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import bpy
import numpy as np

from ...attach import properties, stage_settings
from ...attach.subscribers import subscribers
from ...base.errors import SinewError
from ...deform import pose, session
from ...deform.bound import Bound, methods_of
from ...io import actions
from ...skinning.arrays import are_equal
from ...ui import stepped
from ...ui.sidebar import draw_text
from ...ui.translations import joined

# What of an object's settings a result depends on: nothing but what all methods share; the stages, too; or
# all, as its own method is measured.
CHOICE, STAGES, OWN = range(3)


@dataclass(frozen=True)
class _Mesh:
    bound: Bound
    settings: tuple
    armatures: tuple[int, ...]


@dataclass
class MeasuredOn:
    """
    meshes  by the session_uid of their objects
    depth   of CHOICE, STAGES and OWN
    over    one of stepped.OVER; empty: poses of no frame
    frames  that it stands for
    keys    what plays the armatures
    """

    meshes: dict[int, _Mesh]
    depth: int
    over: str
    frames: list[int]
    keys: list

    def __post_init__(self) -> None:
        self._seen = _Animation.number

    @classmethod
    def of(
        cls, scene: bpy.types.Scene, objects: Sequence[bpy.types.Object], depth: int, over: str = ""
    ) -> MeasuredOn:
        """Call it with objects that Sinew deforms, before anything else is done with them."""
        depsgraph = bpy.context.evaluated_depsgraph_get()
        meshes = {
            obj.session_uid: _Mesh(state.bound, _settings(obj, depth), _armatures(obj))
            for obj, state in session.deformed_now(objects, depsgraph)
        }
        return cls(meshes, depth, over, _frames(scene, objects, over), _keys(objects) if over else [])

    def changes(self, scene: bpy.types.Scene, chosen: Iterable[bpy.types.Object]) -> list[str]:
        """Returns words for what is different now.

        chosen  the objects that would be measured now
        """
        objects = {obj.session_uid: obj for obj in chosen if properties.of(obj).enabled}
        if objects.keys() != self.meshes.keys():
            return ["meshes"] if objects else []
        found: dict[str, bool] = dict.fromkeys(("mesh", "weights", "bones", "stages", "settings"), False)
        for uid, obj in objects.items():
            state, known = session.skinned_of(obj), self.meshes[uid]
            if state is None:
                continue
            if state.bound is not known.bound:
                parts = _differing(state.bound, known.bound)
                found |= dict.fromkeys(parts, True)
                if not parts:
                    # As after undo. It need not be compared again.
                    self.meshes[uid] = replace(known, bound=state.bound)
            settings = _settings(obj, self.depth)
            found["stages"] |= settings[:1] != known.settings[:1]
            found["settings"] |= settings[1:] != known.settings[1:]
            found["bones"] |= _armatures(obj) != known.armatures
        if self.over:
            found["action"] = self._has_other_keys(list(objects.values()))
            found["frames"] = _frames(scene, list(objects.values()), self.over) != self.frames
        return [word for word, is_other in found.items() if is_other]

    def _has_other_keys(self, objects: Sequence[bpy.types.Object]) -> bool:
        """Reading keys takes long, so only where an action may have changed."""
        players = [name for name, _keys in _played(objects)]
        if self._seen == _Animation.number and players == [name for name, _keys in self.keys]:
            return False
        if not _are_alike(_keys(objects), self.keys):
            return True
        self._seen = _Animation.number
        return False

    def draw(
        self, layout: bpy.types.UILayout, scene: bpy.types.Scene, chosen: Iterable[bpy.types.Object]
    ) -> bool:
        """Says what has changed. Returns whether anything has."""
        words = self.changes(scene, chosen)
        if words:
            text = "Changed since this was measured: {what}. Measure again"
            draw_text(layout, text, icon="FILE_REFRESH", alert=True, what=joined(words))
        return bool(words)


class _Animation:
    """How often an action may have changed."""

    number = 0


def _differing(now: Bound, before: Bound) -> list[str]:
    """What of two that were read at different times is not the same."""
    source, known = now.source, before.source
    keys = [each.shape_keys for each in (source, known)]
    has_same_keys = keys[0] is keys[1] or (None not in keys and keys[0].equals(keys[1]))
    is_same_mesh = source.topology.equals(known.topology) and has_same_keys
    pairs = zip(now.skin_stack.skins, before.skin_stack.skins, strict=False)
    return [
        *(["mesh"] if not (is_same_mesh and are_equal(source.surface_points, known.surface_points)) else []),
        *(["weights"] if not source.has_same_weights(known) or now.groups != before.groups else []),
        *(["bones"] if not all(a.deformer.bones.equals(b.deformer.bones) for a, b in pairs) else []),
        *(["settings"] if now.options != before.options else []),
    ]


def _settings(obj: bpy.types.Object, depth: int) -> tuple:
    settings = properties.of(obj)
    stages = pose.stage_values(settings) if depth >= STAGES else None
    parameters = stage_settings.method_values(settings, stage_settings.METHODS)
    own = (settings.mix.method, methods_of(obj)) if depth >= OWN else None
    return stages, parameters, settings.scale_rule, own


def _armatures(obj: bpy.types.Object) -> tuple[int, ...]:
    return tuple(armature.session_uid for armature in properties.of(obj).armatures)


def _frames(scene: bpy.types.Scene, objects: Sequence[bpy.types.Object], over: str) -> list[int]:
    try:
        return stepped.frames_over(scene, armatures_of(objects), over) if over else []
    except SinewError:
        return []


def armatures_of(objects: Sequence[bpy.types.Object]) -> list[bpy.types.Object]:
    return list(dict.fromkeys(armature for obj in objects for armature in properties.of(obj).armatures))


def _played(objects: Sequence[bpy.types.Object]) -> list[tuple[tuple, list[bpy.types.FCurve]]]:
    """What plays the armatures, each with its curves."""
    found = []
    for rig in armatures_of(objects):
        for player in actions.players(rig.animation_data) if rig.animation_data is not None else ():
            action, slot = player.action, actions.slot_of(player)
            uid = action.session_uid if action is not None else 0
            times = [getattr(player, name, 0) for name in ("frame_start", "frame_end", "mute", "influence")]
            name = (rig.session_uid, uid, actions.handle_of(slot), *times)
            found.append((name, actions.all_curves(action, slot)))
    return found


def _keys(objects: Sequence[bpy.types.Object]) -> list[tuple[tuple, list[tuple[tuple, np.ndarray]]]]:
    return [
        (name, [((curve.data_path, curve.array_index, curve.mute), _points(curve)) for curve in curves])
        for name, curves in _played(objects)
    ]


def _points(curve: bpy.types.FCurve) -> np.ndarray:
    """float32 [3, keys * 2]: the keys and their handles."""
    found = np.zeros((3, 2 * len(curve.keyframe_points)), np.float32)
    for row, name in zip(found, ("co", "handle_left", "handle_right"), strict=True):
        curve.keyframe_points.foreach_get(name, row)
    return found


def _are_alike(now: list, before: list) -> bool:
    return len(now) == len(before) and all(
        name == known
        and len(curves) == len(others)
        and all(a[0] == b[0] and np.array_equal(a[1], b[1]) for a, b in zip(curves, others, strict=True))
        for (name, curves), (known, others) in zip(now, before, strict=True)
    )


def _on_evaluated(depsgraph: bpy.types.Depsgraph) -> None:
    _Animation.number += depsgraph.id_type_updated("ACTION")


def _on_stepped() -> None:
    _Animation.number += 1


SUBSCRIPTIONS = (
    (subscribers.evaluated, _on_evaluated),
    (subscribers.stepped, _on_stepped),
)
