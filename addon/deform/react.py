# SPDX-License-Identifier: GPL-3.0-or-later
"""Decides what an event means for an object: pure functions of plain facts, without Blender."""

from dataclasses import dataclass
from enum import Enum


class Step(Enum):
    """What an event is answered with."""

    NOTHING = "nothing"
    REPLAN = "replan"  # decide anew who deforms it, apply that, and bring it up to date
    UPDATE = "update"  # bring it up to date by the plan that it has


class Reading(Enum):
    """What is read of an object that is brought up to date."""

    NOTHING = "nothing"
    CHANGED = "changed"  # mesh, weights and bones; what did not change stays bound
    ALL = "all"


@dataclass(frozen=True)
class Facts:
    """What an event shows of an object, and what Sinew knows of it.

    may_change     the file may be changed
    is_bound       the object was read
    is_prevented   it is switched off, or an error prevents Sinew
    is_due         something has called for a new plan
    is_detached    Sinew's modifier is gone, or its node group
    was_skipped    it was not given points within Blender's evaluation
    lacks_points   Blender evaluated another pose without requesting points
    is_other       the object, its mode or other objects are not as they were for its plan
    is_up_to_date  nothing is listed that its shape depends on; or the evaluation gave it its shape, and
                   nothing else has to be read
    """

    may_change: bool = True
    is_bound: bool = True
    is_prevented: bool = False
    is_due: bool = False
    is_detached: bool = False
    was_skipped: bool = False
    lacks_points: bool = False
    is_other: bool = False
    is_up_to_date: bool = False

    @property
    def calls_for_plan(self) -> bool:
        """Whether the object itself may have changed, or could not be deformed as planned."""
        return (
            not self.is_bound
            or self.is_prevented
            or self.is_due
            or self.is_detached
            or self.was_skipped
            or self.lacks_points
            or self.is_other
        )


def step_of(facts: Facts) -> Step:
    if not facts.calls_for_plan:
        return Step.NOTHING if facts.is_up_to_date else Step.UPDATE
    if facts.may_change:
        return Step.REPLAN
    # A new plan waits.
    return Step.UPDATE if facts.is_bound and not facts.is_prevented else Step.NOTHING


@dataclass(frozen=True)
class Inputs:
    """How what an object is deformed by may differ from what was read of it.

    has_other_modifiers  or other options; it matters only where a plan was made, or has to wait
    have_bones_changed   of one of its armatures
    has_other_mesh       points, weights, groups or shape keys may differ
    is_slider_moved      Blender lists the mesh only because values of shape keys changed
    lacks_surface        one of its methods needs triangles, which were not read
    """

    has_other_modifiers: bool = False
    have_bones_changed: bool = False
    has_other_mesh: bool = False
    is_slider_moved: bool = False
    lacks_surface: bool = False


def reading_of(inputs: Inputs) -> Reading:
    if inputs.has_other_modifiers:
        return Reading.ALL
    # While a shape key's slider moves, the mesh is read only at the next event.
    has_other_mesh = inputs.has_other_mesh and not inputs.is_slider_moved
    is_changed = inputs.have_bones_changed or has_other_mesh or inputs.lacks_surface
    return Reading.CHANGED if is_changed else Reading.NOTHING
