# SPDX-License-Identifier: GPL-3.0-or-later
"""What deformation needs on top of the native library, without Blender: numpy in, numpy out."""
