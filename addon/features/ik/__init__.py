# SPDX-License-Identifier: GPL-3.0-or-later
"""Solves Blender's IK constraints with Sinew's solver, and keys the result."""
