# SPDX-License-Identifier: GPL-3.0-or-later
"""What a Blender of a batch does with one file."""
