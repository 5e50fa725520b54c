# SPDX-License-Identifier: GPL-3.0-or-later
"""Faults of weights and rig, shown in the panel, with their vertices selected."""

# What other features may import.
PUBLIC = ("diagnose", "mending")
