# SPDX-License-Identifier: GPL-3.0-or-later
"""Converts between Blender's conventions and Sinew's: meshes, armatures, poses, actions, files."""
