# SPDX-License-Identifier: GPL-3.0-or-later
"""Safe mode: nothing of Sinew runs within Blender's evaluation, on Blender's threads."""

import os

from ..io import addon_preferences

VARIABLE = "SINEW_SAFE"

_forced: bool | None = None


def is_on() -> bool:
    """By set_forced(), else the environment, else the preference."""
    if _forced is not None:
        return _forced
    wanted = os.environ.get(VARIABLE)
    if wanted is not None:
        return wanted not in ("", "0")
    return addon_preferences.value("safe_mode", default=False)


def set_forced(on: bool | None) -> None:
    """Overrides the environment and the preference; None: no override. Takes effect with the next evaluation
    of an object that changed, or with session.refresh()."""
    global _forced
    _forced = on
