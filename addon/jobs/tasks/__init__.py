# SPDX-License-Identifier: GPL-3.0-or-later
"""The tasks that a batch's Blender performs on one file."""
