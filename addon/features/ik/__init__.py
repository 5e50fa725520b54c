# SPDX-License-Identifier: GPL-3.0-or-later
"""Bones brought to where Blender's IK constraints want them, by Sinew's solver."""
