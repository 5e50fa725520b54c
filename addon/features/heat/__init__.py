# SPDX-License-Identifier: GPL-3.0-or-later
"""Live measures of the deformation: as colours of the mesh, as numbers, and over frames."""

# What other features may import.
PUBLIC = ("heat_legend",)
