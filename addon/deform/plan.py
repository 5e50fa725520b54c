# SPDX-License-Identifier: GPL-3.0-or-later
"""Decides how an object is deformed: one pure function of plain facts, without Blender."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property

from ..attach.icons import Deformer
from ..skinning.shading import NO_NORMALS, GivenNormals

# In these modes Blender's tools work through the Armature modifier, so it deforms the mesh meanwhile.
ARMATURE_MODIFIER_MODES = frozenset({"EDIT", "SCULPT"})


class State(Enum):
    """Who deforms an object, and when."""

    OFF = "off"  # the Armature modifier: the artist switched Sinew off
    REFUSED = "refused"  # the Armature modifier: an error prevents Sinew
    LINKED = "linked"  # the Armature modifier: the object belongs to another file
    EDITING = "editing"  # the Armature modifier: tools of the object's mode need it
    BUILT_IN = "built-in"  # the Armature modifier: it has the same shape in less time, or the mode needs it
    WAITING = "waiting"  # Sinew, once Blender has evaluated what it deforms
    IN_DEPSGRAPH = "in depsgraph"  # Sinew, within Blender's evaluation: the usual case
    AFTER_UPDATE = "after update"  # Sinew, after the evaluation; Blender then evaluates once more


# Nothing of the object is read then.
_UNREAD = (State.OFF, State.REFUSED, State.LINKED, State.EDITING)


_IN_BOTH = {
    Deformer.NOTHING: "Not deformed: the icons of its Armature modifier are off",
    Deformer.ARMATURE: "Its Armature modifier deforms: the icons of Sinew's modifier are off",
}
_IN_VIEWPORT = {
    Deformer.NOTHING: "Not deformed in the viewport: the icon of its Armature modifier is off",
    Deformer.ARMATURE: "Its Armature modifier deforms in the viewport: the icon of Sinew's modifier is off",
}
_IN_RENDERS = {
    Deformer.NOTHING: "Not deformed in renders: the icon of its Armature modifier is off",
    Deformer.ARMATURE: "Its Armature modifier deforms in renders: the icon of Sinew's modifier is off",
}


@dataclass(frozen=True)
class Plan:
    """Who deforms an object, when, and where its points and normals are stored.

    reason          one clause for the panel; the error of REFUSED; empty for the usual case and for what the
                    user chose
    in_buffer       a separate object stores the points (point_buffer.py), not an attribute of the mesh
    lacks           what its method needs and is not computed yet, as a clause; meanwhile Sinew deforms it by
                    the Armature modifier's method
    normals         the normals given along with the points
    normals_reason  why Blender computes the normals although the user wants Sinew to; a clause for the panel
    leaves_out      Blender leaves the Armature modifiers out while Sinew deforms within its evaluation:
                    nothing reads what they make
    viewport        what deforms it in the viewport, or would if Blender did not do it for Sinew
    render          the same in renders
    """

    state: State
    reason: str = ""
    in_buffer: bool = False
    lacks: str = ""
    normals: GivenNormals = NO_NORMALS
    normals_reason: str = ""
    leaves_out: bool = True
    viewport: Deformer = Deformer.SINEW
    render: Deformer = Deformer.SINEW

    def gives_as(self, other: Plan) -> bool:
        """Whether Sinew gives the same points as by another plan, wherever they are shown: the icons decide
        that within the evaluation."""
        views = (self.viewport, self.render)
        is_same = self == replace(other, viewport=self.viewport, render=self.render)
        return is_same and (self.is_in_depsgraph or views == (other.viewport, other.render))

    @cached_property
    def uses_builtin(self) -> bool:
        """Whether Sinew does not deform it: its Armature modifiers do, where their icons are on."""
        return not self.is_read or self.state is State.BUILT_IN

    @cached_property
    def is_read(self) -> bool:
        """Whether mesh, weights and bones are read."""
        return self.state not in _UNREAD

    @property
    def view_reasons(self) -> list[str]:
        """A sentence for the panel on each view in which something else deforms than Sinew, as the icons
        say; one for both views where they agree."""
        if self.viewport is self.render:
            return [_IN_BOTH[self.viewport]] if self.viewport in _IN_BOTH else []
        found = (_IN_VIEWPORT.get(self.viewport), _IN_RENDERS.get(self.render))
        return [sentence for sentence in found if sentence is not None]

    @cached_property
    def is_in_depsgraph(self) -> bool:
        """Whether Sinew deforms within Blender's evaluation."""
        return self.state is State.IN_DEPSGRAPH

    @cached_property
    def is_written(self) -> bool:
        """Whether Sinew deforms after it."""
        return self.state is State.AFTER_UPDATE


# That of an object before its first evaluation.
UNSEEN = Plan(State.WAITING)


@dataclass(frozen=True)
class ObjectFacts:
    """What plan() has to know about an object.

    error                       why Sinew can not deform it, as a sentence; empty where it can
    is_linked                   it belongs to another file, without a library override
    builtin_is_faster           its Armature modifiers give the same shape in less time
    has_upstream                modifiers, absolute shape keys or a parent change the mesh before Sinew
    upstream_changes_weights    these can also change its weights from frame to frame
    mesh_is_shared              other objects use the mesh
    mesh_is_editable            attributes can be added to the mesh: it is not linked
    is_comparison_copy          it is a copy that a comparison shows
    visibility_is_keyed         an animation switches one of the Armature modifiers, or one of Sinew's
    viewport, render            what the modifiers' icons say that deforms it in each view
    deformed_is_read            Blender reads the mesh that the Armature modifiers make
    is_deforming_body           a rigid body reads that mesh: Blender simulates it before it places the
                                object, and Sinew's points wait for that place
    views_differ                one of several Armature modifiers is on only in the viewport or only in
                                renders
    safe_mode                   nothing of Sinew may run within Blender's evaluation
    failure                     the error within Blender's evaluation; empty if there was none
    lacks, normals, normals_reason
                                those of the plan
    """

    enabled: bool = True
    error: str = ""
    is_linked: bool = False
    mode: str = "OBJECT"
    builtin_is_faster: bool = False
    has_upstream: bool = False
    upstream_changes_weights: bool = False
    mesh_is_shared: bool = False
    mesh_is_editable: bool = True
    is_comparison_copy: bool = False
    has_heat_map: bool = False
    visibility_is_keyed: bool = False
    viewport: Deformer = Deformer.SINEW
    render: Deformer = Deformer.SINEW
    deformed_is_read: bool = False
    is_deforming_body: bool = False
    views_differ: bool = False
    safe_mode: bool = False
    failure: str = ""
    lacks: str = ""
    normals: GivenNormals = NO_NORMALS
    normals_reason: str = ""


def plan(facts: ObjectFacts) -> Plan:
    leaves_out = not facts.deformed_is_read
    return replace(_plan(facts), leaves_out=leaves_out, viewport=facts.viewport, render=facts.render)


def _plan(facts: ObjectFacts) -> Plan:
    if not facts.enabled:
        return Plan(State.OFF)
    if facts.is_linked:
        reason = (
            "Linked from another file: its Armature modifier deforms it; make a library override to use Sinew"
        )
        return Plan(State.LINKED, reason)
    if facts.error:
        return Plan(State.REFUSED, facts.error)
    if facts.mode in ARMATURE_MODIFIER_MODES:
        return Plan(State.EDITING, "In this mode the Armature modifier deforms it")
    if facts.builtin_is_faster and Deformer.ARMATURE not in (facts.viewport, facts.render):
        reason = "Small: the Armature modifier has the same shape in less time, and deforms it"
        return Plan(State.BUILT_IN, reason)
    reason = _why_not_in_depsgraph(facts)
    has_own_mesh = facts.mesh_is_editable and not facts.mesh_is_shared
    in_buffer = bool(reason) or facts.has_upstream or not has_own_mesh
    state = State.AFTER_UPDATE if reason else State.IN_DEPSGRAPH
    return Plan(state, reason, in_buffer, facts.lacks, facts.normals, facts.normals_reason)


def _why_not_in_depsgraph(facts: ObjectFacts) -> str:
    """Returns the reason; empty where Sinew can deform within Blender's evaluation."""
    reasons = (
        (facts.safe_mode, "Safe mode"),
        (bool(facts.failure), f"Within Blender's evaluation it failed: {facts.failure}"),
        (facts.is_comparison_copy, "A copy for comparison"),
        (facts.upstream_changes_weights, "Modifiers in front of the Armature modifier change weights"),
        (facts.has_heat_map, "Slower while its heat map is shown"),
        (facts.is_deforming_body, "Its rigid body is simulated from the deformed mesh"),
        (facts.visibility_is_keyed, "The visibility of its modifier is animated"),
        (facts.views_differ, "An Armature modifier is on in the viewport or in renders alone"),
    )
    return next((reason for holds, reason in reasons if holds), "")
