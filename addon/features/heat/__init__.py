# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures of the deformation, live: as colours of the mesh, as numbers, and over frames."""
