# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures every method over frames, and says which is best at what."""

# What other features may import.
PUBLIC = ("recommend",)
