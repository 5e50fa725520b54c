# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender gets of diagnostics: a panel, and what forgets findings when weights change."""

from .diagnose import register as register
from .diagnose import unregister as unregister
from .diagnostics_panel import CLASSES as CLASSES
