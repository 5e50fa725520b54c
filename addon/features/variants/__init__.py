# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps variants with a character in the file, and uses them by a click."""

# What other features may import.
PUBLIC = ("choices", "keys", "stored")
