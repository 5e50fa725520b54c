# SPDX-License-Identifier: GPL-3.0-or-later
"""Registers inverse kinematics: its operator."""

from __future__ import annotations

from .ik_operator import CLASSES as CLASSES
