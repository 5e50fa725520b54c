# SPDX-License-Identifier: GPL-3.0-or-later
"""Blends actions of one armature into a new one."""
