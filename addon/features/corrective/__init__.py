# SPDX-License-Identifier: GPL-3.0-or-later
"""Shape keys that bring what Sinew shows in one pose to the Armature modifiers."""
