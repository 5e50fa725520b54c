# SPDX-License-Identifier: GPL-3.0-or-later
"""The experiments of Smith 2013, chapter 3, done again: what is printed there beside what Sinew gives."""
