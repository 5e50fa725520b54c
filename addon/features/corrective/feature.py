# SPDX-License-Identifier: GPL-3.0-or-later
"""Registers corrective shape keys: one button in the menu."""

from .corrective_operator import CLASSES as CLASSES
