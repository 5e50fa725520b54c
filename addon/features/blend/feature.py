# SPDX-License-Identifier: GPL-3.0-or-later
"""Registers blends of actions: their operator."""

from .blend_operator import CLASSES as CLASSES
