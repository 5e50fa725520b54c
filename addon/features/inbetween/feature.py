# SPDX-License-Identifier: GPL-3.0-or-later
"""Registers in-betweens: their operator."""

from __future__ import annotations

from .inbetween_operator import CLASSES as CLASSES
