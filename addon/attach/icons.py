# SPDX-License-Identifier: GPL-3.0-or-later
"""What the icons of Sinew's modifier and of the Armature modifiers that it replaces mean.

The viewport and renders each have icons of their own, and exactly one of three things deforms there. Sinew,
as long as its icon and an Armature modifier's are on: so tools of others find that modifier, and get the mesh
at rest where they hide it. Nothing, once one of the two is switched off. The Armature modifier, where its
icon is switched on again after Sinew's was switched off. Where Blender would compute the Armature modifier,
too, its icon is off while Sinew deforms (Situation.ALONE), and it deforms once it is switched on.
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
    ALONE = "alone"  # Sinew, with the Armature modifiers off

    @property
    def is_by_sinew(self) -> bool:
        return self in (Situation.SINEW, Situation.ALONE)


@dataclass(frozen=True)
class Icons:
    """The icons of an object in one view: of Sinew's modifier, and of each Armature modifier."""

    sinew: bool
    modifiers: tuple[bool, ...]


@dataclass(frozen=True)
class View:
    """What is known of one view.

    shown     for each Armature modifier, whether it was on before Sinew, or is because of Sinew
    forced    for each Armature modifier, whether it is shown because of Sinew alone
    hidden    Sinew's icon was switched off, and the Armature modifiers' with it
    switched  for each Armature modifier, whether its icon was switched since then, or since Sinew is on
    """

    shown: tuple[bool, ...]
    forced: tuple[bool, ...] = ()
    hidden: bool = False
    switched: tuple[bool, ...] = ()

    @property
    def on(self) -> tuple[bool, ...]:
        """The Armature modifiers' icons while Sinew is on."""
        switched = self.switched or (False,) * len(self.shown)
        return _each(lambda shown, other: (shown and not self.hidden) != other, self.shown, switched)

    @property
    def taking_part(self) -> tuple[bool, ...]:
        switched = self.switched or (False,) * len(self.shown)
        return _each(lambda shown, other: takes_part(shown, self.hidden, other), self.shown, switched)

    @property
    def deformer(self) -> Deformer:
        if not any(self.on):
            return Deformer.NOTHING
        return Deformer.ARMATURE if self.hidden else Deformer.SINEW

    def switched_on(self, wanted: tuple[bool, ...] = ()) -> View:
        """Returns the view with Sinew in it.

        wanted  which Armature modifiers deform, where none did; empty for all
        """
        if any(self.shown):
            return View(self.shown, self.forced)
        shown = wanted or (True,) * len(self.shown)
        return View(shown, shown)


def takes_part(shown: bool, hidden: bool, switched: bool) -> bool:
    """Returns whether Sinew deforms by an Armature modifier, where Sinew deforms. Arguments as in View."""
    return shown != (switched and not hidden)


def taking_part(shown: Sequence[bool], in_other_view: Sequence[bool]) -> Sequence[bool]:
    """Returns which Armature modifiers Sinew deforms by in a view. Where none does, its shape is not shown,
    and is that of the other view, as one evaluation may be for both."""
    return shown if any(shown) else in_other_view


def icons(view: View, situation: Situation) -> Icons:
    """Returns the icons that Sinew sets."""
    if situation is Situation.OFF:
        return Icons(False, view.shown)
    is_sinews = view.deformer is Deformer.SINEW
    are_off = is_sinews and situation is Situation.ALONE
    return Icons(is_sinews and situation.is_by_sinew, (False,) * len(view.shown) if are_off else view.on)


def follow(view: View, situation: Situation, now: Icons) -> View:
    """Returns what is known of a view after the artist, or a tool, has switched its icons.

    now  the icons as they are; before, they were as from icons()
    """
    before = icons(view, situation)
    if now == before:
        return view
    if situation is Situation.OFF:
        return _followed_off(view, now)
    if now.sinew and not before.sinew:
        return view.switched_on()
    if before.sinew and not now.sinew:
        # A tool that hides all but some Armature modifiers means these to deform.
        is_choice = any(now.modifiers) and now.modifiers != before.modifiers
        return replace(view, hidden=True, switched=now.modifiers if is_choice else ())
    if not any(view.shown) and any(now.modifiers):
        return view.switched_on(now.modifiers)
    if situation is Situation.ALONE:
        return replace(view, hidden=any(now.modifiers), switched=now.modifiers)
    was_on = replace(view, switched=()).on
    return replace(view, switched=_each(lambda is_on, was: is_on != was, now.modifiers, was_on))


def _followed_off(view: View, now: Icons) -> View:
    """The Armature modifiers' icons are the artist's own choice then, which Remove leaves as it is."""
    is_same = _each(lambda is_on, was_on: is_on == was_on, now.modifiers, view.shown)
    forced = _each(lambda was_forced, same: was_forced and same, view.forced or is_same, is_same)
    return View(
        now.modifiers,
        forced if view.forced else (),
        view.hidden and not now.sinew,
        view.switched if all(is_same) else (),
    )


def _each(function: Callable[[bool, bool], bool], *flags: tuple[bool, ...]) -> tuple[bool, ...]:
    return tuple(map(function, *flags))
