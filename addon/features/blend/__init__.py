# SPDX-License-Identifier: GPL-3.0-or-later
"""Actions of one armature blended into a new one."""
