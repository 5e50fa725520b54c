# SPDX-License-Identifier: GPL-3.0-or-later
"""Registers comparisons: classes, what a scene stores, labels in the 3D views."""

from __future__ import annotations

import bpy

from . import comparison_labels, comparison_operators, comparison_panel, comparison_state

CLASSES = (*comparison_state.CLASSES, *comparison_operators.CLASSES, *comparison_panel.CLASSES)


def register() -> None:
    bpy.types.Scene.sinew_comparison = bpy.props.PointerProperty(type=comparison_state.SinewComparison)
    comparison_labels.register()


def unregister() -> None:
    comparison_labels.unregister()
    del bpy.types.Scene.sinew_comparison
