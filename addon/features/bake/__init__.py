# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes: Sinew's deformation as data that plays without it, as shape keys, point caches, bones or exported
files."""

# What other features may import.
PUBLIC = (
    "baked_files",
    "bake_apart",
    "bake_bones",
    "bake_export",
    "bake_state",
    "helper_bones",
    "helper_bones_io",
    "segment_bones",
)
