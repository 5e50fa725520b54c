# SPDX-License-Identifier: GPL-3.0-or-later
"""A contact sheet over the 3D view: joints under each variant, from which one goes to what one saw."""
