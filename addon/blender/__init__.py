# SPDX-License-Identifier: GPL-3.0-or-later
"""Sinew inside Blender: thin code on bpy around `..core`."""
