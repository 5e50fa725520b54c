# SPDX-License-Identifier: GPL-3.0-or-later
"""What all folders use: errors, texts, whole files, locks, interrupts and pipes, without Blender."""
