# SPDX-License-Identifier: GPL-3.0-or-later
"""Keys what Sinew computes in a copy of an armature's action, and goes back to the original."""

# What other features may import.
PUBLIC = ("action_copy", "feature")
