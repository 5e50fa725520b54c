# SPDX-License-Identifier: GPL-3.0-or-later
"""Many files at once: what to do, who does it, what became of it. Imports nothing of bpy: Blender works in
processes of its own."""
