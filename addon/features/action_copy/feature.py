# SPDX-License-Identifier: GPL-3.0-or-later
"""Registers the record of a replaced action, and the operator that restores it."""

from __future__ import annotations

from . import action_copy, original_operator

CLASSES = (action_copy.SinewActionCopy, *original_operator.CLASSES)


def register() -> None:
    action_copy.register()


def unregister() -> None:
    action_copy.unregister()
