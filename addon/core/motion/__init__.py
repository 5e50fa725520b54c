# SPDX-License-Identifier: GPL-3.0-or-later
"""Clips of motion of one armature, blended: numpy in, numpy out, without Blender."""
