# SPDX-License-Identifier: GPL-3.0-or-later
"""Features on top of the deformation: each folder has its state, operators and panel."""
