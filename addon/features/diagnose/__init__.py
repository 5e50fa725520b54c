# SPDX-License-Identifier: GPL-3.0-or-later
"""What is wrong with weights and rig, in the panel, and its vertices selected."""
