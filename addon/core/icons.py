# SPDX-License-Identifier: GPL-3.0-or-later
"""What the icons of Sinew's modifier and of the Armature modifiers that it replaces mean.

The viewport and renders each have icons of their own, and exactly one of three things deforms there: Sinew;
an Armature modifier whose icon was switched on; or nothing, where Sinew's icon was switched off.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum

VIEWPORT, RENDER = VIEWS = ("viewport", "render")


class Deformer(Enum):
    """What deforms an object in one view."""

    SINEW = "Sinew"
    ARMATURE = "the Armature modifier"
    NOTHING = "nothing"


class Situation(Enum):
    """Who deformed an object when its icons were last set."""

    OFF = ""  # the Armature modifiers, as Sinew is off
    BUILT_IN = "built-in"  # the Armature modifiers, in Sinew's place
    SINEW = "Sinew"
    PAINT = "paint"  # Sinew, with the Armature modifiers on in the viewport

    @property
    def is_by_sinew(self) -> bool:
        return self in (Situation.SINEW, Situation.PAINT)


@dataclass(frozen=True)
class Icons:
    """The icons of an object in one view: of Sinew's modifier, and of each Armature modifier."""

    sinew: bool
    modifiers: tuple[bool, ...]


@dataclass(frozen=True)
class View:
    """What is known of one view.

    shown   for each Armature modifier, whether it is on without Sinew
    hidden  Sinew's icon was switched off
    own     for each Armature modifier, whether it was switched on while Sinew is on
    """

    shown: tuple[bool, ...]
    hidden: bool = False
    own: tuple[bool, ...] = ()

    @property
    def deformer(self) -> Deformer:
        if any(self.own):
            return Deformer.ARMATURE
        return Deformer.NOTHING if self.hidden else Deformer.SINEW


def taking_part(shown: Sequence[bool]) -> tuple[bool, ...]:
    """Returns which Armature modifiers deform in a view by Sinew. Where all of them were off before Sinew,
    the artist has switched Sinew's icon on, so all do."""
    return tuple(shown) if any(shown) else (True,) * len(shown)


def icons(view: View, situation: Situation, name: str) -> Icons:
    """Returns the icons that Sinew sets.

    name  of the view
    """
    deformer, none = view.deformer, (False,) * len(view.shown)
    if situation is Situation.OFF:
        return Icons(False, view.shown)
    if deformer is Deformer.ARMATURE:
        return Icons(False, view.own)
    if deformer is Deformer.NOTHING:
        return Icons(False, none)
    is_kept_on = situation is Situation.PAINT and name == VIEWPORT
    is_on = situation is Situation.BUILT_IN or is_kept_on
    return Icons(situation.is_by_sinew, taking_part(view.shown) if is_on else none)


def follow(view: View, situation: Situation, name: str, now: Icons) -> View:
    """Returns what is known of a view after the artist, or a tool, has switched its icons.

    now  the icons as they are; before, they were as from icons()
    """
    before = icons(view, situation, name)
    if now == before:
        return view
    nothing_own = replace(view, own=())
    if situation is Situation.OFF:
        # These are the artist's own choice for the Armature modifiers, which Remove leaves as it is.
        is_same = any(now.modifiers) == any(before.modifiers)
        hidden = not now.sinew and (view.hidden if is_same else not any(now.modifiers))
        own = view.own if now.modifiers == before.modifiers else ()
        return View(now.modifiers, hidden, own)
    if now.sinew and not before.sinew:
        return replace(nothing_own, hidden=False)
    if situation is Situation.BUILT_IN:
        if any(now.modifiers) and view.deformer is Deformer.NOTHING:
            return replace(nothing_own, hidden=False)
        if not any(now.modifiers) and view.deformer is Deformer.SINEW:
            return replace(nothing_own, hidden=True)
        return replace(view, own=now.modifiers)
    hidden = view.hidden or (before.sinew and not now.sinew)
    own = now.modifiers
    if view.deformer is Deformer.SINEW:
        # Those that are kept on say nothing.
        own = tuple(
            is_on and not was_on for is_on, was_on in zip(now.modifiers, before.modifiers, strict=True)
        )
    return View(view.shown, hidden, own)
