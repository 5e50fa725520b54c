# SPDX-License-Identifier: GPL-3.0-or-later
"""Has a rig play stated poses in an action of their own, until the artist's own motion comes back."""

# What other features may import.
PUBLIC = ("clip",)
