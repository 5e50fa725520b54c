# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps what is known of objects over undo and redo: binding them again takes longer than the step.

Blender keeps in memory what is the same in both steps, and lists everything else in the next evaluation. So
an object stays known if Sinew deforms it within the evaluation, and if it was shown before the step and after
it. Listed data is compared with what was read; bones, and what the artist can change about the object itself,
always are.
"""

import bpy

from ..attach import layout
from .changes import Changes
from .plan import State
from .skinned_object import SkinnedObject


def known_before(
    pairs: list[tuple[bpy.types.Object, SkinnedObject]], depsgraph_seen: int
) -> dict[int, SkinnedObject]:
    """Returns what stays known, by session_uid. Called before the step.

    depsgraph_seen  the address of the depsgraph that Sinew saw last
    """
    depsgraph = bpy.context.view_layer.depsgraph
    is_seen = depsgraph is not None and depsgraph.as_pointer() == depsgraph_seen
    # An experimental preference, which may go: Blender reads everything anew with each step.
    replaces_all = getattr(bpy.context.preferences.experimental, "use_undo_legacy", False)
    if not is_seen or replaces_all:
        return {}
    return {obj.session_uid: skinned for obj, skinned in pairs if _is_known(obj, skinned, depsgraph)}


def _is_known(obj: bpy.types.Object, skinned: SkinnedObject, depsgraph: bpy.types.Depsgraph) -> bool:
    plan, evaluation = skinned.plan, skinned.evaluation
    return (
        plan.state is State.IN_DEPSGRAPH
        and not plan.lacks
        and not (skinned.needs_recheck or skinned.needs_plan)
        and not (evaluation.skip_reason or evaluation.user_error or evaluation.changed_unannounced)
        and obj.mode == skinned.noted.layout.mode == "OBJECT"
        and _is_shown(obj, depsgraph)
    )


def is_known_after(
    obj: bpy.types.Object, skinned: SkinnedObject, depsgraph: bpy.types.Depsgraph, changes: Changes
) -> bool:
    """Whether this is still the known object with its shape. Called with the first evaluation after the
    step."""
    has_shape = skinned.was_deformed(obj, depsgraph) or skinned.noted.dependencies.isdisjoint(changes.touched)
    return _is_shown(obj, depsgraph) and has_shape and skinned.is_as_noted(obj, layout.read(obj))


def _is_shown(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> bool:
    return obj.visible_get(view_layer=depsgraph.view_layer) and obj.evaluated_get(depsgraph).is_evaluated
