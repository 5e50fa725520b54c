# SPDX-License-Identifier: GPL-3.0-or-later
"""Paints the vertex group of the stage Mix: at each vertex the better of two methods over frames."""
