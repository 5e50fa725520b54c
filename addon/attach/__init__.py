# SPDX-License-Identifier: GPL-3.0-or-later
"""Puts Sinew on an object and takes it off without a trace: settings, modifiers, points, driver."""
