# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes: Sinew's deformation as data that plays without it, as shape keys, point caches, bones or exported
files."""
