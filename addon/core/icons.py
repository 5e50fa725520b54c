# SPDX-License-Identifier: GPL-3.0-or-later
"""What the icons of Sinew's modifier and of the Armature modifiers that it replaces mean.

The viewport and renders each have icons of their own, and exactly one of three things deforms there: Sinew;
an Armature modifier whose icon was switched on; or nothing, where Sinew's icon was switched off.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
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

    shown   for each Armature modifier, whether it deforms by Sinew, or without it
    forced  for each Armature modifier, whether it is shown because of Sinew alone
    hidden  Sinew's icon was switched off
    own     for each Armature modifier, whether it was switched on while Sinew is on
    """

    shown: tuple[bool, ...]
    forced: tuple[bool, ...] = ()
    hidden: bool = False
    own: tuple[bool, ...] = ()

    @property
    def deformer(self) -> Deformer:
        if any(self.own):
            return Deformer.ARMATURE
        return Deformer.NOTHING if self.hidden or not any(self.shown) else Deformer.SINEW

    def switched_on(self, wanted: tuple[bool, ...] = ()) -> View:
        """Returns the view with Sinew in it.

        wanted  which Armature modifiers deform, where none did; empty for all
        """
        if any(self.shown):
            return View(self.shown, self.forced)
        shown = wanted or (True,) * len(self.shown)
        return View(shown, shown)


def taking_part(shown: Sequence[bool], in_other_view: Sequence[bool]) -> Sequence[bool]:
    """Returns which Armature modifiers Sinew deforms by in a view. Where none does, its shape is not shown,
    and is that of the other view, as one evaluation may be for both."""
    return shown if any(shown) else in_other_view


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
    return Icons(situation.is_by_sinew, view.shown if is_on else none)


def follow(view: View, situation: Situation, name: str, now: Icons) -> View:
    """Returns what is known of a view after the artist, or a tool, has switched its icons.

    now  the icons as they are; before, they were as from icons()
    """
    before = icons(view, situation, name)
    if now == before:
        return view
    if situation is Situation.OFF:
        return _followed_off(view, now)
    if now.sinew and not before.sinew:
        return view.switched_on()
    if situation is Situation.BUILT_IN:
        if any(now.modifiers) and view.deformer is Deformer.NOTHING:
            return view.switched_on(now.modifiers)
        if not any(now.modifiers) and view.deformer is Deformer.SINEW:
            return replace(view, hidden=True)
        return replace(view, own=now.modifiers)
    own = now.modifiers
    if view.deformer is Deformer.SINEW:
        # Those that are kept on say nothing.
        own = _each(lambda is_on, was_on: is_on and not was_on, own, before.modifiers)
    hidden = view.hidden or (before.sinew and not now.sinew)
    return replace(view, own=own if any(own) else (), hidden=hidden)


def _followed_off(view: View, now: Icons) -> View:
    """The Armature modifiers' icons are the artist's own choice then, which Remove leaves as it is."""
    is_same = _each(lambda is_on, was_on: is_on == was_on, now.modifiers, view.shown)
    forced = _each(lambda was_forced, same: was_forced and same, view.forced or is_same, is_same)
    return View(
        now.modifiers,
        forced if view.forced else (),
        view.hidden and not now.sinew,
        view.own if all(is_same) else (),
    )


def _each(function: Callable[[bool, bool], bool], *flags: tuple[bool, ...]) -> tuple[bool, ...]:
    return tuple(map(function, *flags))
