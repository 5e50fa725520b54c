# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender gets of inverse kinematics: classes, and what a bake remembers."""

from __future__ import annotations

from . import ik_bake, ik_panel

CLASSES = ik_panel.CLASSES


def register() -> None:
    ik_bake.register()


def unregister() -> None:
    ik_bake.unregister()
