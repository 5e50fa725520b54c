# SPDX-License-Identifier: GPL-3.0-or-later
"""Blends of motion clips of one armature: numpy in, numpy out, without Blender."""
