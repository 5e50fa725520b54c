# SPDX-License-Identifier: GPL-3.0-or-later
"""Batches of many files: inputs, job files, workers, journal, report. Does not import bpy: Blenders run in
separate processes."""
