# SPDX-License-Identifier: GPL-3.0-or-later
"""Shape keys with which the Armature modifiers show Sinew's shape in one pose."""
