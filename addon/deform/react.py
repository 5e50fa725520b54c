# SPDX-License-Identifier: GPL-3.0-or-later
"""Decides what an event means for an object: one pure function of plain facts, without Blender."""

from dataclasses import dataclass
from enum import Enum

from .plan import Plan


class Action(Enum):
    """What is done for an object next."""

    NOTHING = "nothing"
    REPLAN = "replan"  # decide anew who deforms it, and apply that
    REBIND = "rebind"  # read all of it
    READ = "read"  # read mesh, weights and bones again; what did not change stays bound
    SETTLE = "settle"  # request what its methods need, and note the object as it is now
    TAG = "tag"  # have Blender evaluate it once more, within which Sinew deforms it
    WRITE = "write"  # deform it, and write the points for Blender's next evaluation


@dataclass(frozen=True)
class Facts:
    """What an event shows of an object.

    may_change            the file may be changed
    is_prevented          it is switched off, or an error prevents Sinew
    is_due                something has called for a new plan
    is_detached           Sinew's modifier is gone, or its node group
    was_skipped           it was not given points within Blender's evaluation
    lacks_points          Blender evaluated another pose without requesting points
    is_other              the object, its mode or other objects are not as they were for its plan
    is_untouched          nothing is listed that its shape depends on
    has_shape             the evaluation gave it its shape, and nothing else has to be read
    is_upstream_there     Blender has evaluated what it is made from
    has_other_modifiers   than those that were read, or other options
    have_bones_changed    since they were read
    has_other_mesh        points, weights, groups or shape keys may differ from those read
    is_slider_moved       Blender lists the mesh only because values of shape keys changed
    lacks_surface         one of its methods needs triangles, which were not read
    """

    may_change: bool = True
    is_prevented: bool = False
    is_due: bool = False
    is_detached: bool = False
    was_skipped: bool = False
    lacks_points: bool = False
    is_other: bool = False
    is_untouched: bool = False
    has_shape: bool = False
    is_upstream_there: bool = True
    has_other_modifiers: bool = False
    have_bones_changed: bool = False
    has_other_mesh: bool = False
    is_slider_moved: bool = False
    lacks_surface: bool = False

    @property
    def calls_for_plan(self) -> bool:
        """Whether the object itself may have changed, or could not be deformed as planned."""
        return (
            self.is_prevented
            or self.is_due
            or self.is_detached
            or self.was_skipped
            or self.lacks_points
            or self.is_other
        )


@dataclass(frozen=True)
class Known:
    """What Sinew knows of the object, and has done for it in this event.

    is_bound    it was read
    is_planned  its plan was made in this event
    is_read     it was read in this event
    is_settled  in this event
    differs     its shape may differ from the one that is shown
    is_given    it was tagged or written in this event
    """

    plan: Plan
    is_bound: bool = False
    is_planned: bool = False
    is_read: bool = False
    is_settled: bool = False
    differs: bool = False
    is_given: bool = False


def needs_nothing(facts: Facts, known: Known) -> bool:
    """Whether nothing is done for an object whose plan was not made in this event."""
    if not known.is_bound or facts.calls_for_plan:
        # While the file may not be changed, a new plan waits.
        return not facts.may_change and (not known.is_bound or facts.is_prevented)
    return facts.is_untouched or facts.has_shape


def react(facts: Facts, known: Known) -> Action:
    if known.is_given:
        return Action.NOTHING
    if known.is_settled:
        return _show(facts, known)
    if not (known.is_planned or known.is_read):
        if needs_nothing(facts, known):
            return Action.NOTHING
        if facts.may_change and (not known.is_bound or facts.calls_for_plan):
            return Action.REPLAN
    if not (known.plan.is_read and facts.is_upstream_there):
        return Action.NOTHING
    return Action.SETTLE if known.is_read else _read(facts, known)


def _read(facts: Facts, known: Known) -> Action:
    # In a render, keys may set other options while plans wait.
    may_be_other = known.is_planned or not facts.may_change
    if not known.is_bound or (may_be_other and facts.has_other_modifiers):
        return Action.REBIND
    # While a shape key's slider moves, weights are read only at the next event.
    has_other_mesh = facts.has_other_mesh and not facts.is_slider_moved
    if facts.have_bones_changed or has_other_mesh or facts.lacks_surface:
        return Action.READ
    return Action.SETTLE


def _show(facts: Facts, known: Known) -> Action:
    if known.plan.is_in_depsgraph:
        is_due_again = facts.was_skipped or facts.lacks_points or known.differs
        return Action.TAG if is_due_again else Action.NOTHING
    return Action.WRITE if known.plan.is_written else Action.NOTHING
