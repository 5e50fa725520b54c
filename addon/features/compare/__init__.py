# SPDX-License-Identifier: GPL-3.0-or-later
"""Copies of characters beside them in the 3D view, one for each method."""
