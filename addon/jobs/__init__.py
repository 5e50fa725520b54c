# SPDX-License-Identifier: GPL-3.0-or-later
"""Batches of many files: inputs, job files, workers, journal, report. Imports no bpy: Blenders run in
processes of its own."""
