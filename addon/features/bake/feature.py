# SPDX-License-Identifier: GPL-3.0-or-later
"""Registers bakes: operators, and the panel of their errors with its heat map."""

from . import bake_operator, error_map, error_panel

CLASSES = (*bake_operator.CLASSES, *error_panel.CLASSES)

register, unregister = error_map.register, error_map.unregister
