# SPDX-License-Identifier: GPL-3.0-or-later
"""Moves bones between the keyed poses of an action by other methods than curves."""

# What other features may import.
PUBLIC = ("interpolation",)
