# SPDX-License-Identifier: GPL-3.0-or-later
"""What the icons of Sinew's modifier and of the Armature modifiers mean: what they mean in any stack.

The viewport and renders each have icons of their own. Sinew deforms by the Armature modifiers whose icon is
on. Where its own icon is off, they deform by themselves.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from functools import cached_property

# The properties of a modifier that they are.
ICONS = ("show_viewport", "show_render")


class Deformer(Enum):
    """What deforms an object in one view."""

    SINEW = "Sinew"
    ARMATURE = "the Armature modifier"
    NOTHING = "nothing"


@dataclass(frozen=True)
class Icons:
    """The icons of an object in one view: of Sinew's modifier, and of each Armature modifier."""

    sinew: bool
    modifiers: tuple[bool, ...]

    @cached_property
    def deformer(self) -> Deformer:
        if not any(self.modifiers):
            return Deformer.NOTHING
        return Deformer.SINEW if self.sinew else Deformer.ARMATURE
