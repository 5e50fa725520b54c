# SPDX-License-Identifier: GPL-3.0-or-later
"""Registers bakes: their operator."""

from .bake_operator import CLASSES as CLASSES
