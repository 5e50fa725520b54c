# SPDX-License-Identifier: GPL-3.0-or-later
"""Decides how each object is deformed, and deforms it at Blender's events."""
