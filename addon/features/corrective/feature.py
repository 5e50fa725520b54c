# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender gets of it: one button in the menu."""

from .corrective_operator import CLASSES as CLASSES
