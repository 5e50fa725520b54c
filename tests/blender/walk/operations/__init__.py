# SPDX-License-Identifier: GPL-3.0-or-later
"""The operations of a walk, by what they act on. Each does the same to the file on both sides (walk_sides),
depending on its random numbers and the file's content. Walks of a seed depend on the order of these files."""

PARTS = (
    "on_sinew",
    "on_poses",
    "on_meshes",
    "on_armatures",
    "on_modifiers",
    "on_shape_keys",
    "on_objects",
    "on_scenes",
    "on_files",
)
