# SPDX-License-Identifier: GPL-3.0-or-later
"""Registers inverse kinematics: classes, what bakes and live trees store, and handlers."""

from __future__ import annotations

from . import ik_bake, ik_handlers, ik_in_depsgraph, ik_panel, ik_records

CLASSES = (*ik_records.CLASSES, *ik_panel.CLASSES)


def register() -> None:
    ik_bake.register()
    ik_records.register()
    ik_in_depsgraph.register()
    ik_handlers.subscribe()
    ik_handlers.adopt_open_file()


def unregister() -> None:
    ik_handlers.unsubscribe()
    ik_handlers.detach_all()
    ik_in_depsgraph.unregister()
    ik_records.unregister()
    ik_bake.unregister()
