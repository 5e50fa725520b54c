# SPDX-License-Identifier: GPL-3.0-or-later
"""Registers diagnostics: a panel, and handlers that forget findings when weights change."""

from .diagnose import register as register
from .diagnose import unregister as unregister
from .diagnostics_panel import CLASSES as CLASSES
