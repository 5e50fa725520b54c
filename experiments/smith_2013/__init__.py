# SPDX-License-Identifier: GPL-3.0-or-later
"""Repeats the experiments of Smith 2013, chapter 3: the printed numbers beside Sinew's."""
