# SPDX-License-Identifier: GPL-3.0-or-later
"""Bones moved between the keyed poses of an action by other means than curves."""
